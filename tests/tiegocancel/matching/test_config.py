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
    ],
)
def test_each_parameter_leaves_the_plain_rule(table: dict[str, Any]) -> None:
    assert not CancelConfig(**table).is_plain


def test_defaults_written_out_are_the_plain_rule() -> None:
    assert CancelConfig(early_us=1000, late_us=1000, more_horizons_us=(), ways=2, least_shift_px=0).is_plain


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
    ],
)
def test_warm_up_covers_the_rounds_that_support_needs(table: dict[str, Any], warm_up_us: int) -> None:
    assert CancelConfig(**table).warm_up_us == warm_up_us


def test_whole_numbers_of_numpy_become_plain_ones() -> None:
    config = CancelConfig(horizon_us=np.int64(1500), more_horizons_us=[np.int32(1600)], set_bits=[np.int8(2), 3])  # type: ignore[arg-type]
    assert config == CancelConfig(horizon_us=1500, more_horizons_us=(1600,), set_bits=(2, 3))
    assert type(config.horizon_us) is int
