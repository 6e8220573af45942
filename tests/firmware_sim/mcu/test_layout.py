"""Words hold what the canceller must know, and 32 bits are taken only where they compute the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.mcu.layout import SWEEP_SHARE, fits_32_bits, lay_out_words
from tiegocancel.firmware_sim.state import state_bits

from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.presets import PRESETS
from tiegocancel.motion.schedule import MotionSchedule

SIZES = ((128, 128), (320, 240), (640, 480), (1280, 720))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", PRESETS)
def test_cells_and_entries_hold_their_fields_with_stamps_that_hide_aliases(name: str, size: tuple[int, int]) -> None:
    config = CancelConfig(**PRESETS[name])
    words = lay_out_words(config, width=size[0], height=size[1], sweep_cycles=20, clock_mhz=100)
    bits = state_bits(config, width=size[0], height=size[1], time_bits=None if not config.is_plain else words.time)
    gate = (config.early_gate_us + config.late_gate_us >> config.tick_bits) + 1
    assert words.cells == bits.cells
    assert words.cell >= bits.cell - bits.time + words.time
    assert words.cell in (8, 16, 32, 64)
    assert words.ring_entry >= bits.ring_entry if not config.is_plain else words.ring_entry >= 32
    assert words.sweep_ticks == (1 << words.time) - gate > 0
    assert 1 << words.ring_stamp > (config.horizons_us[-1] + config.late_gate_us >> config.tick_bits) + 1
    sweep_us = words.sweep_ticks << config.tick_bits
    assert words.cells * 20 / (sweep_us * 100) <= SWEEP_SHARE


def test_a_stamp_may_be_given_and_must_hold_the_gate() -> None:
    plain = CancelConfig()
    assert lay_out_words(plain, width=160, height=120, time_bits=14).cell == 16
    assert lay_out_words(plain, width=160, height=120, time_bits=15).cell == 32
    with pytest.raises(ValueError, match="time_bits must be from 11 to"):
        lay_out_words(plain, width=160, height=120, time_bits=10)


def test_entries_hold_places_where_each_has_one_prediction_made_at_once() -> None:
    one = {"horizon_us": 8000, "early_us": 1000, "late_us": 1000}
    more = {**one, "more_horizons_us": (9000,)}
    for table, places in (
        (one, True),
        (more, False),
        ({**more, "choose_px": 2.0}, True),
        ({**one, "motion_at": "gate"}, False),
    ):
        assert lay_out_words(CancelConfig(**table), width=64, height=48).places == places


@settings(max_examples=200, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_32_bits_compute_the_same_place_wherever_they_are_said_to_fit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    width, height = (int(rng.integers(1, 2000)) for _ in range(2))
    scale = 1 << int(rng.integers(1, 40))
    row = rng.integers(-scale, scale, 6) >> rng.integers(0, 30, 6)
    fits = fits_32_bits(row[None, :], width=width, height=height)
    x, y = rng.integers(0, width, 50), rng.integers(0, height, 50)
    x[:4], y[:4] = (0, width - 1, 0, width - 1), (0, 0, height - 1, height - 1)
    same = True
    for own, limit, part in ((x, width, row[:3]), (y, height, row[3:])):
        exact = (own << 16) + part[0] * x + part[1] * y + part[2] + 32768
        wrapped = (exact + (1 << 31)) % (1 << 32) - (1 << 31)
        beyond = (exact >> 16 < 0).all() or (exact >> 16 >= limit).all()
        same &= bool((wrapped == exact).all()) or bool(beyond)
    assert same or not fits


def test_a_rotation_fits_and_so_does_a_motion_that_is_unknown() -> None:
    turn = MotionSchedule.rotation(center_px=(640.0, 360.0), omega_rad_s=20.0, horizon_us=12_000)
    for schedule in (turn, MotionSchedule.still(), MotionSchedule.unknown()):
        assert fits_32_bits(schedule.coefficients, width=1280, height=720)
    assert not fits_32_bits(np.array([[1 << 28, 0, -(1 << 35), 0, 0, 0]]), width=1280, height=720)
