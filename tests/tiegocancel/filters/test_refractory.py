"""A pixel rests after an event that was kept."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

Pixel = Callable[..., list[bool]]


def test_the_rest_ends_at_exactly_the_period(kept: Pixel) -> None:
    assert kept([0, 999], refractory_us=1000) == [True, False]
    assert kept([0, 1000], refractory_us=1000) == [True, True]


def test_removed_events_do_not_prolong_the_rest(kept: Pixel) -> None:
    t = np.arange(0, 10_000, 300)
    passed = t[np.array(kept(t, refractory_us=1000))]
    assert all(later - sooner == 1200 for sooner, later in pairwise(passed.tolist()))


def test_polarities_rest_together_or_alone(kept: Pixel) -> None:
    assert kept([0, 10, 20], [1, 0, 1], refractory_us=1000) == [True, False, False]
    assert kept([0, 10, 20], [1, 0, 1], refractory_us=1000, refractory_by_polarity=True) == [True, True, False]


def test_pixels_rest_alone(kept: Pixel) -> None:
    assert kept([0, 1, 2], x=[2, 3, 2], y=[1, 1, 2], refractory_us=1000) == [True, True, True]


def test_a_rest_does_not_come_back_when_relative_time_wraps(kept: Pixel) -> None:
    for k in range(28, 36):
        assert all(kept(np.arange(6) * ((1 << k) + 5), refractory_us=(1 << 28) - 1))
