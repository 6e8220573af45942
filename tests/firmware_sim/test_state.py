"""The state in bits follows from capacity, sensor and time width."""

from __future__ import annotations

import pytest
from tiegocancel.firmware_sim import state_bits

from tiegocancel import CancelConfig


def test_bits_of_ring_and_table_by_hand() -> None:
    state = state_bits(CancelConfig(ring_capacity=1000), width=320, height=240, time_bits=16)
    assert (state.address, state.ring_entry, state.cell) == (17, 34, 18)
    assert (state.ring, state.table) == (34_000, 18 * 76_800)
    assert state.total_kib == pytest.approx((34_000 + 18 * 76_800) / 8192)


def test_a_time_too_narrow_to_tell_pending_predictions_apart_is_refused() -> None:
    config = CancelConfig(horizon_us=8000, tolerance_us=1000)  # 18,001 instants from −9000 to 9000
    assert state_bits(config, width=8, height=8, time_bits=15).time == 15
    with pytest.raises(ValueError, match="time_bits must be from 15 to 64 for a horizon of 8000 µs, not 14"):
        state_bits(config, width=8, height=8, time_bits=14)
