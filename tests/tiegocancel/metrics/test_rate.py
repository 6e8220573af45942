"""The rate profile keeps every event while its bins widen."""

from __future__ import annotations

import numpy as np

from tiegocancel import Events
from tiegocancel.metrics import RateProfile


def test_bins_double_for_long_streams_without_losing_events() -> None:
    rng = np.random.default_rng(1)
    t = np.sort(rng.integers(0, 200_000_000, 5000)) + 7
    events = Events(t, np.zeros(5000, int), np.zeros(5000, int), np.ones(5000, int), 1, 1)
    suppressed = rng.random(5000) < 0.5
    rate = RateProfile(int(t[0]))
    for first in range(0, 5000, 100):
        rate.add(events[first : first + 100], suppressed[first : first + 100])
    seconds, before, after = rate.series()
    assert rate.bin_us == 16_000
    width_s = rate.bin_us * 1e-6
    assert round((before * width_s).sum()) == 5000
    assert round((after * width_s).sum()) == int((~suppressed).sum())
    expected = np.bincount((t - t[0]) // rate.bin_us)
    assert np.allclose(before * width_s, expected)
    assert len(seconds) == len(expected)
    assert rate.peak_hz() == before.max()
