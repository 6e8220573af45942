"""A configuration refuses what no canceller can run, naming field, rule and value."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.matching.config import CancelConfig


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"horizon_us": -1}, "horizon_us must be an integer from 0 to 268435455, not -1"),
        ({"horizon_us": 1.5}, "horizon_us must be an integer from 0 to 268435455, not 1.5"),
        ({"ring_capacity": 0}, "ring_capacity must be an integer from 1 to 268435456, not 0"),
        ({"carry": 16}, "carry must be an integer from 0 to 15, not 16"),
        ({"uses": -1}, "uses must be an integer from 0 to 15, not -1"),
        ({"uses": True}, "uses must be an integer from 0 to 15, not True"),
        ({"tick_bits": 17}, "tick_bits must be an integer from 0 to 16, not 17"),
        ({"bin_bits": 5}, "bin_bits must be an integer from 0 to 4, not 5"),
        ({"ways": 0}, "ways must be an integer from 1 to 64, not 0"),
        ({"early_us": -3}, "early_us must be an integer from 0 to 268435455, not -3"),
        ({"late_us": "1"}, "late_us must be an integer from 0 to 268435455, not '1'"),
        ({"tolerance_px": float("nan")}, "tolerance_px must be a number from 0 to 64, not nan"),
        ({"least_shift_px": 65}, "least_shift_px must be a number from 0 to 64, not 65"),
        ({"polarity": "same"}, "polarity must be 'opposite', 'equal' or 'ignore', not 'same'"),
        ({"motion_at": "arrival"}, "motion_at must be 'event' or 'gate', not 'arrival'"),
        ({"need": 0}, "need must be an integer from 1 to 1, not 0"),
        ({"need": 2}, "need must be an integer from 1 to 1, not 2"),
        ({"carry": 3, "need": 5}, "need must be an integer from 1 to 4, not 5"),
        ({"more_horizons_us": (9000, 10_000), "need": 4}, "need must be an integer from 1 to 3, not 4"),
        ({"more_horizons_us": (8000,)}, "more_horizons_us must be at most 3, rising from horizon_us, not [8000]"),
        ({"more_horizons_us": (7000,)}, "more_horizons_us must be at most 3, rising from horizon_us, not [7000]"),
        ({"more_horizons_us": (8001, 8002, 8003, 8004)}, "more_horizons_us must be at most 3"),
        ({"more_horizons_us": (9000.5,)}, "more_horizons_us must be an integer from 0 to 268435455, not 9000.5"),
        ({"set_bits": (1, 2, 3)}, "set_bits must be two numbers, for columns and rows, not (1, 2, 3)"),
        ({"set_bits": (17, 0)}, "set_bits must be an integer from 0 to 16, not 17"),
        ({"uses": 0, "early_us": 8000}, "early_us must be below horizon_us when the canceller is selective, not 8000"),
        ({"uses": 0, "tolerance_us": 9000}, "early_us must be below horizon_us when the canceller is selective"),
        (
            {"tick_bits": 9, "tolerance_us": 512},
            "horizon_us must be whole ticks of 512 µs (tick_bits): 7680 or 8192, not 8000",
        ),
        ({"tick_bits": 4}, "early_us must be whole ticks of 16 µs (tick_bits): 992 or 1008, not 1000"),
        ({"choose_px": 4}, "choose_px needs more_horizons_us to choose from, and must be 0, not 4"),
        ({"choose_px": 4, "more_horizons_us": (9000,), "motion_at": "gate"}, "choose_px needs motion_at = 'event'"),
        ({"more_ring_capacities": (5,)}, "more_ring_capacities must be one for each of more_horizons_us, under choose"),
        (
            {"choose_px": 4, "more_horizons_us": (9000,), "more_ring_capacities": (5, 6)},
            "more_ring_capacities must be one for each of more_horizons_us, under choose_px, not [5, 6]",
        ),
        (
            {"choose_px": 4, "more_horizons_us": (9000,), "more_ring_capacities": (0,)},
            "more_ring_capacities must be an integer from 1 to 268435456, not 0",
        ),
        ({"spread_us": -1}, "spread_us must be an integer from 0 to 268435455, not -1"),
        ({"spread_px": "1"}, "spread_px must be a number from 0 to 64, not '1'"),
        ({"line_px": -1}, "line_px must be a number from 0 to 64, not -1"),
        ({"line_px": 1, "fraction_bits": 4}, "fraction_bits must be an integer from 0 to 3, not 4"),
        ({"fraction_bits": 2}, "fraction_bits needs line_px, and must be 0, not 2"),
        ({"off_tolerance_px": 65}, "off_tolerance_px must be a number from 0 to 64, not 65"),
        ({"off_late_us": 0.5}, "off_late_us must be an integer from 0 to 268435455, not 0.5"),
        (
            {"horizon_us": 8192, "tick_bits": 4, "tolerance_us": 16, "off_late_us": 20},
            "off_late_us must be whole ticks of 16 µs (tick_bits): 16 or 32, not 20",
        ),
        ({"tick_bits": 4, "early_us": 16}, "late_us must be whole ticks of 16 µs (tick_bits): 992 or 1008, not 1000"),
    ],
)
def test_what_cannot_run_is_refused(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        CancelConfig(**table)
    assert message in str(caught.value)


def test_the_plain_rule_may_open_its_gate_before_its_event() -> None:
    assert CancelConfig(horizon_us=0, tolerance_us=1000).is_plain


@pytest.mark.parametrize(
    "table",
    [
        {"more_horizons_us": (9000,)},
        {"carry": 1},
        {"uses": 0},
        {"uses": 2},
        {"early_us": 999},
        {"late_us": 0},
        {"tick_bits": 3},
        {"bin_bits": 1},
        {"set_bits": (0, 0)},
        {"least_shift_px": 0.5},
        {"motion_at": "gate"},
        {"spread_us": 5},
        {"spread_px": 1.0},
        {"line_px": 1.0},
        {"off_late_us": 0},
        {"off_tolerance_px": 1.0},
    ],
)
def test_each_parameter_leaves_the_plain_rule(table: dict[str, Any]) -> None:
    assert not CancelConfig(**table).is_plain


def test_defaults_written_out_are_the_plain_rule() -> None:
    assert CancelConfig(early_us=1000, late_us=1000, more_horizons_us=(), ways=2, least_shift_px=0).is_plain
    assert CancelConfig(off_late_us=1000, off_tolerance_px=2.0, choose_px=0, spread_us=0).is_plain


def test_a_gate_that_spreads_asks_each_offset_for_its_shift() -> None:
    # The gate is 0.5 px + a quarter of the shift: 1 px asks for 2 px, √2 px for 3.66, 2 px for 6.
    config = CancelConfig(horizon_us=8000, tolerance_px=2.0, spread_us=2000, spread_px=0.5)
    needed = dict(zip(config.offsets, config.spread_shifts_squared, strict=True))
    assert (needed[0, 0], needed[1, 0], needed[1, 1], needed[0, -2]) == (0, 4, 14, 36)
    alone = CancelConfig(tolerance_px=2.0, spread_px=1.0)
    needed = dict(zip(alone.offsets, alone.spread_shifts_squared, strict=True))
    assert (needed[0, 1], needed[1, 1]) == (0, 1 << 34)
    assert set(CancelConfig(tolerance_px=2.0).spread_shifts_squared) == {0}


def test_gates_of_off_are_those_of_on_unless_given() -> None:
    config = CancelConfig(early_us=500, off_late_us=3000, off_tolerance_px=1.0)
    assert (config.late_gates_us, config.late_gate_us, config.early_gate_us) == ((3000, 1000), 3000, 500)
    assert (config.reaches_squared_px, config.reach_squared_px) == ((1, 4), 4)


def test_zero_motion_is_tried_with_room_for_all_in_the_longest_horizon() -> None:
    table: dict[str, Any] = {"more_horizons_us": (16_000,), "ring_capacity": 100, "least_shift_px": 1.0}
    chosen = CancelConfig(**table, choose_px=4, more_ring_capacities=(50,)).without_motion()
    assert (chosen.ring_capacities, chosen.least_shift_px) == ((100, 100 * 2 + 50), 0.0)
    assert CancelConfig(**table).without_motion() == CancelConfig(**{**table, "least_shift_px": 0.0})


def test_events_that_choose_fill_a_ring_for_each_horizon() -> None:
    table: dict[str, Any] = {"more_horizons_us": (16_000, 32_000), "ring_capacity": 100}
    assert CancelConfig(**table).ring_capacities == (100,)
    assert CancelConfig(**table, choose_px=4).ring_capacities == (100, 100, 100)
    assert CancelConfig(**table, choose_px=4, more_ring_capacities=(50, 20)).ring_capacities == (100, 50, 20)


@given(squared=st.integers(0, 64 * 64))
def test_distances_that_are_roots_reach_and_require_their_square(squared: int) -> None:
    config = CancelConfig(tolerance_px=squared**0.5, least_shift_px=squared**0.5)
    assert (config.reach_squared_px, config.least_shift_squared_px) == (squared, squared)


def test_a_shift_between_two_lattice_distances_requires_the_farther() -> None:
    assert CancelConfig(least_shift_px=1.2).least_shift_squared_px == 2


@pytest.mark.parametrize(
    ("table", "warm_up_us"),
    [
        ({}, 9000),
        ({"late_us": 200}, 8200),
        ({"more_horizons_us": (16_000,), "need": 2}, 17_000),
        ({"carry": 3, "need": 4}, 33_000),
        ({"carry": 3, "need": 4, "more_horizons_us": (9000,)}, 28_000),
        ({"carry": 3, "need": 4, "more_horizons_us": (9000,), "choose_px": 3}, 37_000),
    ],
)
def test_warm_up_covers_the_rounds_that_support_needs(table: dict[str, Any], warm_up_us: int) -> None:
    assert CancelConfig(**table).warm_up_us == warm_up_us


def test_whole_numbers_of_numpy_become_plain_ones() -> None:
    config = CancelConfig(horizon_us=np.int64(1500), more_horizons_us=[np.int32(1600)], set_bits=[np.int8(2), 3])  # type: ignore[arg-type]
    assert config == CancelConfig(horizon_us=1500, more_horizons_us=(1600,), set_bits=(2, 3))
    assert type(config.horizon_us) is int
