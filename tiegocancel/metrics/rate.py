"""Follow the event rate over time, before and after cancelling."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events

__all__ = ["RateProfile"]

_MAX_BINS = 1 << 14


class RateProfile:
    """Count events and residual events in bins of equal time from the first event on.

    Bins begin at ``bin_us`` = 1 ms and double whenever the stream outgrows 2^14 of them: constant memory.
    """

    def __init__(self, start_us: int, bin_us: int = 1000) -> None:
        self.start_us, self.bin_us = start_us, bin_us
        self._counts = np.zeros((2, _MAX_BINS), np.int64)
        self._last = 0

    def add(self, events: Events, suppressed: NDArray[np.bool_]) -> None:
        """Count a chunk; ``suppressed`` bool[n]."""
        if not len(events):
            return
        self._last = int(events.t[-1]) - self.start_us
        while self._last >= self.bin_us * _MAX_BINS:
            self._counts[:, : _MAX_BINS // 2] = self._counts.reshape(2, _MAX_BINS // 2, 2).sum(axis=2)
            self._counts[:, _MAX_BINS // 2 :] = 0
            self.bin_us *= 2
        bins = (events.t - self.start_us) // self.bin_us
        self._counts[0] += np.bincount(bins, minlength=_MAX_BINS)
        self._counts[1] += np.bincount(bins[~suppressed], minlength=_MAX_BINS)

    def series(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the start of each bin in s, and events and residual events per second, float64[bins] each."""
        bins = self._last // self.bin_us + 1
        width_s = self.bin_us * 1e-6
        seconds = np.arange(bins, dtype=np.float64) * width_s
        rates = self._counts[:, :bins].astype(np.float64) / width_s
        return seconds, rates[0], rates[1]

    def peak_hz(self) -> float:
        """Return the highest rate of events in a bin."""
        return float(self.series()[1].max())
