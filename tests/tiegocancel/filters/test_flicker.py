"""A pixel whose onsets follow each other at a period of the band is muted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

Pixel = Callable[..., list[bool]]

BAND = {"flicker_periods": 3, "flicker_min_hz": 90.0, "flicker_max_hz": 130.0}


def light(periods: int, period_us: int = 10_000, start_us: int = 0) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return times of an ON and an OFF event a period."""
    onsets = start_us + np.arange(periods) * period_us
    return np.sort(np.concatenate([onsets, onsets + period_us // 2]))


def test_flicker_is_removed_from_the_onset_that_completes_the_count(kept: Pixel) -> None:
    t = light(10)
    assert kept(t, [1, 0] * 10, **BAND) == [True] * 6 + [False] * 14


@pytest.mark.parametrize(("period_us", "muted"), [(7691, False), (7692, True), (11_112, True), (11_113, False)])
def test_the_band_is_inclusive_at_both_ends_in_whole_microseconds(kept: Pixel, period_us: int, muted: bool) -> None:
    assert kept(light(9, period_us), [1, 0] * 9, **BAND)[-1] is not muted


def test_several_events_of_one_polarity_are_one_swing(kept: Pixel) -> None:
    t = np.repeat(light(8), 3)
    assert kept(t, np.repeat([1, 0] * 8, 3), **BAND) == [True] * 18 + [False] * 30


def test_one_irregular_onset_does_not_bring_a_muted_pixel_back(kept: Pixel) -> None:
    t = np.concatenate([light(8), light(8, start_us=95_000)])
    assert not any(kept(t, [1, 0] * 16, **BAND)[6:])


def test_an_unlike_rhythm_brings_the_pixel_back_after_as_many_onsets(kept: Pixel) -> None:
    t = np.concatenate([light(8), light(6, period_us=3000, start_us=76_000)])
    assert kept(t, [1, 0] * 14, **BAND)[16:] == [False] * 4 + [True] * 8


def test_silence_forgets(kept: Pixel) -> None:
    ages = [44_448, 44_449, 1 << 26, (1 << 32) + 70_000, 1 << 57]  # after the last onset; 4 · 11,112 µs are remembered
    last = [kept([*light(8), 70_000 + age], [1, 0] * 8 + [0], **BAND)[-1] for age in ages]
    assert last == [False, True, True, True, True]


def test_a_muted_pixel_stays_muted_while_the_base_of_relative_times_moves(kept: Pixel) -> None:
    """A light of 10 Hz for two minutes; the packed times hold half a minute."""
    t = light(1200, period_us=100_000)
    assert not any(kept(t, [1, 0] * 1200, flicker_periods=3, flicker_min_hz=8.0, flicker_max_hz=12.0)[6:])


def test_one_polarity_alone_is_no_flicker(kept: Pixel) -> None:
    assert all(kept(light(20), 1, **BAND))
    assert all(kept(light(20), 0, **BAND))
