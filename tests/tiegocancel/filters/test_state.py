"""The state in bits follows from the filters that are on, the sensor and the width of a stamp."""

from __future__ import annotations

import pytest

from tiegocancel.filters import FilterConfig, filter_state_bits


def test_bits_of_each_table_by_hand() -> None:
    config = FilterConfig(hot_events=10, flicker_periods=4, refractory_us=5, refractory_by_polarity=True)
    state = filter_state_bits(config, width=10, height=8, time_bits=20)
    assert (state.hot_pixel, state.flicker, state.refractory, state.background) == (1600, 80 * 25, 3200, 0)
    assert state.total_kib == pytest.approx(6800 / 8192)


def test_nothing_on_holds_nothing() -> None:
    assert filter_state_bits(FilterConfig(), width=10, height=8).total == 0


def test_a_stamp_too_narrow_for_what_a_filter_looks_back_is_refused() -> None:
    config = FilterConfig(background_us=2000)  # 4001 instants
    assert filter_state_bits(config, width=8, height=8, time_bits=12).background == 768
    with pytest.raises(ValueError, match="time_bits must be from 12 to 64 for these filters, not 11"):
        filter_state_bits(config, width=8, height=8, time_bits=11)
