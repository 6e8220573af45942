"""A pixel that fires too often is muted until it calms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Pixel = Callable[..., list[bool]]


def test_a_burst_passes_up_to_the_limit_and_not_beyond(kept: Pixel) -> None:
    assert kept([0] * 5, hot_events=3, hot_window_us=3000) == [True, True, True, False, False]


def test_the_counter_leaks_one_event_in_each_share_of_the_window(kept: Pixel) -> None:
    assert kept([0, 0, 0, 1000], hot_events=3, hot_window_us=3000) == [True] * 4
    assert kept([0, 0, 0, 999], hot_events=3, hot_window_us=3000) == [True] * 3 + [False]


def test_a_pixel_at_the_pace_of_the_leak_is_never_muted_and_one_above_it_for_good(kept: Pixel) -> None:
    assert all(kept(np.arange(500) * 1000, hot_events=3, hot_window_us=3000))
    above = kept(np.arange(500) * 900, hot_events=3, hot_window_us=3000)
    assert all(above[:20])
    assert not any(above[40:])


def test_a_muted_pixel_returns_after_about_a_quiet_window(kept: Pixel) -> None:
    burst = [0] * 100
    assert not kept([*burst, 3999], hot_events=3, hot_window_us=3000)[-1]
    assert kept([*burst, 4000], hot_events=3, hot_window_us=3000)[-1]


def test_other_pixels_have_counters_of_their_own(kept: Pixel) -> None:
    assert kept([0] * 4, x=[2, 2, 3, 2], hot_events=2, hot_window_us=3000) == [True, True, True, False]


def test_a_counter_empties_however_long_the_silence(kept: Pixel) -> None:
    for silence in (1 << 20, 1 << 30, (1 << 32) + 5, 1 << 57):
        assert kept([0] * 9 + [silence] * 2, hot_events=1, hot_window_us=3000)[-2:] == [True, False]
