"""The logic estimate against the runs that it was calibrated on, each predicted from the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares, nnls
from tiegocancel.firmware_sim import logic
from tiegocancel.firmware_sim.logic import LogicShape, estimate_logic
from tiegocancel.firmware_sim.memory_map import LogicalMemory, map_memories
from tiegocancel.firmware_sim.target import load_target
from tiegocancel.firmware_sim.target_fpga import FpgaTarget

FAMILIES = ("ecp5", "gowin", "ice40", "amd")
# The prototype core, serial look-up: family, part, sensor, stamp and cell bits, LUTs, flip-flops (0: not reported).
# The last one had its table in UltraRAM, of as many words a block as RAMB18 has in the mode chosen for it here.
RUNS = [
    ("ecp5", "ecp5-25f", (160, 120), 14, 16, 1133, 1154),
    ("ecp5", "ecp5-45f", (320, 240), 16, 18, 1572, 1253),
    ("ecp5", "ecp5-45f", (320, 320), 14, 16, 1280, 1233),
    ("gowin", "gw1nr-9", (64, 64), 14, 16, 1040 + 412, 1060),
    ("gowin", "gw2a-18", (160, 120), 14, 16, 1418 + 468, 1154),
    ("ice40", "ice40up5k", (160, 120), 14, 16, 1490, 0),
    ("ice40", "ice40up5k", (160, 120), 14, 16, 1494, 0),
    ("amd", "zynq-7020", (320, 320), 14, 16, 651, 819),
    ("amd", "zynq-7020", (640, 480), 14, 16, 1150, 854),
    ("amd", "zu3eg", (640, 480), 14, 16, 1221, 1145),
]


def fpga(name: str) -> FpgaTarget:
    target = load_target(name)
    assert isinstance(target, FpgaTarget)
    return target


def place_bits(sensor: tuple[int, int]) -> int:
    return (sensor[0] * sensor[1] - 1).bit_length()


def table_luts(part: str, sensor: tuple[int, int], cell_bits: int, banks: int = 1) -> int:
    shared = part == "ice40up5k"
    memory = LogicalMemory(
        name="table",
        words=sensor[0] * sensor[1] // banks,
        width_bits=cell_bits,
        read_ports=0 if shared else 1,
        write_ports=0 if shared else 1,
        shared_ports=int(shared),
    )
    return banks * map_memories([memory], fpga(part)).luts


def fit(runs: list[tuple[str, int, int, int, int]]) -> np.ndarray:
    """Return LUTs a place bit, LUTs a time bit, and the factor of each family after the first, least in log error."""

    def residuals(logs: np.ndarray) -> list[float]:
        place, time, *factors = np.exp(logs)
        by_family = dict(zip(FAMILIES, (1.0, *factors), strict=True))
        return [np.log((by_family[f] * (place * p + time * t) + mux) / luts) for f, p, t, mux, luts in runs]

    start = np.log([40, 30, 1.7, 1.5, 0.4])
    return np.asarray(np.exp(least_squares(residuals, start).x))


LUT_RUNS = [
    (family, place_bits(sensor), time, table_luts(part, sensor, cell), luts)
    for family, part, sensor, time, cell, luts, _ in RUNS
]


def test_the_constants_are_the_fit_of_the_runs() -> None:
    place, time, gowin, ice40, amd = fit(LUT_RUNS)
    assert pytest.approx(place, rel=0.01) == logic.LUTS_PER_PLACE_BIT
    assert pytest.approx(time, rel=0.02) == logic.LUTS_PER_TIME_BIT
    assert fpga("gw2a-18").logic.lut_factor == pytest.approx(gowin, rel=0.01)
    assert fpga("ice40up5k").logic.lut_factor == pytest.approx(ice40, rel=0.01)
    assert fpga("zynq-7020").logic.lut_factor == pytest.approx(amd, rel=0.01)


def test_the_stated_error_is_that_of_runs_left_out() -> None:
    errors = []
    for index, (family, place, time, mux, luts) in enumerate(LUT_RUNS):
        lut_place, lut_time, *factors = fit(LUT_RUNS[:index] + LUT_RUNS[index + 1 :])
        factor = dict(zip(FAMILIES, (1.0, *factors), strict=True))[family]
        errors.append(abs((factor * (lut_place * place + lut_time * time) + mux) / luts - 1))
    assert max(errors) == pytest.approx(logic.CALIBRATED_ERROR, abs=0.01)
    assert np.mean(errors) < 0.045


def test_flip_flops_of_runs_left_out_are_within_a_twelfth() -> None:
    runs = [(place_bits(s), t, ffs) for family, _, s, t, _, _, ffs in RUNS if ffs and family != "amd"]

    def solve(rows: list[tuple[int, int, int]]) -> np.ndarray:
        matrix = np.array([[place / ffs, time / ffs] for place, time, ffs in rows])
        return np.asarray(nnls(matrix, np.ones(len(rows)))[0])

    assert solve(runs) == pytest.approx([logic.FFS_PER_PLACE_BIT, logic.FFS_PER_TIME_BIT], rel=0.01)
    for index, (place, time, ffs) in enumerate(runs):
        a, b = solve(runs[:index] + runs[index + 1 :])
        assert a * place + b * time == pytest.approx(ffs, rel=1 / 12)


@pytest.mark.parametrize("run", RUNS, ids=[f"{run[1]} {run[2][0]}x{run[2][1]}" for run in RUNS])
def test_every_serial_run_is_met_within_the_stated_error(
    run: tuple[str, str, tuple[int, int], int, int, int, int],
) -> None:
    _, part, sensor, time, cell, luts, ffs = run
    shape = LogicShape(place_bits=place_bits(sensor), time_bits=time, cell_bits=cell)
    estimate = estimate_logic(shape, fpga(part), memory_luts=table_luts(part, sensor, cell))
    assert estimate.error_share == logic.CALIBRATED_ERROR
    assert abs(estimate.luts / luts - 1) <= estimate.error_share
    if ffs and run[0] != "amd":
        assert estimate.ffs == pytest.approx(ffs, rel=1 / 12)


def test_multipliers_are_those_of_the_runs_to_one() -> None:
    """The prototype took 6 on ECP5, 5 on iCE40 and Gowin, 4 where a row is a power of two long."""
    shape = LogicShape(place_bits=15, time_bits=14, cell_bits=16, coefficient_bits=16, coordinate_bits=9)
    for part, taken in (("ecp5-25f", 6), ("ice40up5k", 5), ("gw2a-18", 5)):
        assert abs(estimate_logic(shape, fpga(part)).multipliers - taken) <= 1
    assert estimate_logic(replace(shape, place_bits=12, row_product=False), fpga("gw1nr-9")).multipliers == 4


def test_a_product_wider_than_a_multiplier_takes_two() -> None:
    shape = LogicShape(place_bits=15, time_bits=14, cell_bits=16, coefficient_bits=18, coordinate_bits=11)
    assert estimate_logic(shape, fpga("ecp5-25f")).multipliers == 5
    assert estimate_logic(shape, fpga("ice40up5k")).multipliers == 10


def test_nine_comparators_on_sixteen_banks_cost_what_they_did() -> None:
    """Unpipelined, 320 × 240: 1729 LUTs and 482 flip-flops serial, 5151 and 1689 banked."""
    serial = LogicShape(place_bits=17, time_bits=16, cell_bits=18)
    banked = replace(serial, comparators=9, banks=16)
    few = estimate_logic(serial, fpga("ecp5-45f"), memory_luts=table_luts("ecp5-45f", (320, 240), 18))
    many = estimate_logic(banked, fpga("ecp5-45f"), memory_luts=table_luts("ecp5-45f", (320, 240), 18, banks=16))
    assert many.luts - few.luts == pytest.approx(5151 - 1729, rel=0.05)
    assert many.ffs - few.ffs == pytest.approx(1689 - 482, rel=0.05)
    assert many.error_share == logic.UNPROVEN_ERROR
    assert many.reasons == ("more than one comparator or bank: one run",)


def test_a_part_without_multipliers_makes_them_of_luts() -> None:
    """64 × 64 on an iCE40HX8K: 2461 logic cells; the operands of the prototype there are 16 and 7 bits."""
    shape = LogicShape(
        place_bits=12, time_bits=14, cell_bits=16, coefficient_bits=16, coordinate_bits=7, row_product=False
    )
    estimate = estimate_logic(shape, fpga("ice40hx8k"), memory_luts=table_luts("ice40hx8k", (64, 64), 16))
    assert estimate.multipliers == 0
    assert estimate.luts == pytest.approx(2461, rel=0.05)
    assert "products in LUTs: one run" in estimate.reasons


@pytest.mark.parametrize("field", ["place_bits", "time_bits", "comparators", "banks", "lanes", "horizons"])
def test_more_of_anything_never_takes_less(field: str) -> None:
    shape = LogicShape(place_bits=15, time_bits=14, cell_bits=16, comparators=2, banks=4)
    more = replace(shape, **{field: getattr(shape, field) + 1})
    small, large = (estimate_logic(which, fpga("ecp5-85f")) for which in (shape, more))
    assert small.luts < large.luts
    assert small.ffs <= large.ffs
