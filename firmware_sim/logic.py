"""Estimate the LUTs, flip-flops and multipliers of a matching core on an FPGA, with the error of the estimate.

The model is small because little was measured: ten place-and-route or synthesis runs of one prototype core (predict,
ring, table, serial look-up) on four families, and one core with nine comparators on sixteen banks. In LUTs of an ECP5,
``53.4 · place_bits + 14.4 · time_bits``, times the family's ``lut_factor``, and half a LUT for each bit of a
multiplexer, which the memory map counts. Leaving each run out and predicting it from the others is at worst 10 % off
in LUTs (4 % on average) and 8 % in flip-flops (AMD parts draw 10 to 35 % fewer: their DSPs hold registers). A window of
5 × 5 instead of 3 × 3, read one cell a cycle, changed nothing (1494 LUTs for 1490). What a comparator, a bank or a
product in LUTs costs rests on one run each, so it is right there and unproven elsewhere: those estimates say 50 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

from tiegocancel.firmware_sim.target_fpga import FpgaTarget

__all__ = ["LogicEstimate", "LogicShape", "estimate_logic"]

LUTS_PER_PLACE_BIT = 53.4
LUTS_PER_TIME_BIT = 14.4
FFS_PER_PLACE_BIT = 32.8
FFS_PER_TIME_BIT = 46.8
COMPARATOR_LUTS_PER_TIME_BIT = 12.0
COMPARATOR_FFS_PER_TIME_BIT = 9.5
BANK_LUTS_PER_PLACE_BIT = 2.0
SOFT_MULTIPLIER_LUTS_PER_BIT = 1.82
MUX_LUTS_PER_BIT = 0.5

CALIBRATED_ERROR = 0.10
"""Worst leave-one-out error of the LUTs of a serial core with multipliers in DSPs."""

UNPROVEN_ERROR = 0.50
"""Said of everything that rests on one run or on none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LogicShape:
    """The numbers of a core that its logic grows with.

    ``place_bits``: address of a cell of the table. ``time_bits``: stamp that the look-up compares. ``cell_bits``: of a
    cell. ``comparators``: cells compared in one cycle (bins a cycle times ways read together). ``banks``: of the table,
    read at once. ``lanes``: whole cores side by side. ``horizons`` beyond the first each add a pointer of
    ``ring_bits`` and a comparison. ``products``: multiplications of a coefficient of ``coefficient_bits`` with a
    coordinate of ``coordinate_bits`` that run at once; ``row_product``: one more, where a row of the table is not a
    power of two long.
    """

    place_bits: int
    time_bits: int
    cell_bits: int
    comparators: int = 1
    banks: int = 1
    lanes: int = 1
    horizons: int = 1
    ring_bits: int = 10
    products: int = 4
    coefficient_bits: int = 18
    coordinate_bits: int = 11
    row_product: bool = True

    def __post_init__(self) -> None:
        for name in ("place_bits", "time_bits", "cell_bits", "comparators", "banks", "lanes", "horizons", "ring_bits"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        for name in ("products", "coefficient_bits", "coordinate_bits"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, not {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class LogicEstimate:
    """What a core is estimated to take. ``error_share``: of ``luts``; ``reasons``: why it is not the calibrated one."""

    luts: int
    ffs: int
    multipliers: int
    error_share: float
    reasons: tuple[str, ...] = ()


def estimate_logic(
    shape: LogicShape, target: FpgaTarget, *, memory_luts: int = 0, memory_ffs: int = 0
) -> LogicEstimate:
    """Estimate the core of ``shape`` on ``target``; ``memory_luts`` and ``memory_ffs`` come from its memory map.

    A product wider than the part's multipliers takes several; a part without any makes it of LUTs.
    """
    reasons = []
    logic = LUTS_PER_PLACE_BIT * shape.place_bits + LUTS_PER_TIME_BIT * shape.time_bits
    ffs = FFS_PER_PLACE_BIT * shape.place_bits + FFS_PER_TIME_BIT * shape.time_bits
    mux = 0.0
    if shape.comparators > 1 or shape.banks > 1:
        reasons.append("more than one comparator or bank: one run")
        logic += COMPARATOR_LUTS_PER_TIME_BIT * shape.time_bits * (shape.comparators - 1)
        logic += BANK_LUTS_PER_PLACE_BIT * shape.place_bits * (shape.banks - 1)
        ffs += COMPARATOR_FFS_PER_TIME_BIT * shape.time_bits * (shape.comparators - 1)
        mux += MUX_LUTS_PER_BIT * shape.cell_bits * shape.comparators * (shape.banks - 1)
    if shape.horizons > 1:
        reasons.append("more than one horizon: not measured")
        logic += 2 * (shape.horizons - 1) * (shape.ring_bits + shape.time_bits)
        ffs += (shape.horizons - 1) * (shape.ring_bits + shape.time_bits)
    if shape.lanes > 1:
        reasons.append("more than one lane: not measured, counted as whole cores")
    products = shape.products + shape.row_product
    multipliers = 0
    if target.multipliers:
        multipliers = products * min(
            min(
                ceil(shape.coefficient_bits / a) * ceil(shape.coordinate_bits / b)
                for a, b in ((kind.a_bits, kind.b_bits), (kind.b_bits, kind.a_bits))
            )
            for kind in target.multipliers
        )
    elif products:
        reasons.append("products in LUTs: one run")
        logic += SOFT_MULTIPLIER_LUTS_PER_BIT * products * shape.coefficient_bits * shape.coordinate_bits
    return LogicEstimate(
        luts=round(shape.lanes * (target.logic.lut_factor * logic + mux)) + memory_luts,
        ffs=round(shape.lanes * ffs) + memory_ffs,
        multipliers=shape.lanes * multipliers,
        error_share=UNPROVEN_ERROR if reasons else CALIBRATED_ERROR,
        reasons=tuple(reasons),
    )
