"""Measure how long bytes wait until their events are decided: a histogram in constant memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Latency"]

_BINS_PER_DECADE = 100
_LEAST_S = 1e-6
_DECADES = 8


class Latency:
    """Count events by the logarithm of their latency: 1 µs to 100 s in bins of 2.3 %.

    A quantile is the upper edge of its bin, so that it is never flattered; the largest is exact.
    """

    def __init__(self) -> None:
        self._counts: NDArray[np.int64] = np.zeros(_BINS_PER_DECADE * _DECADES, np.int64)
        self.max_s = 0.0

    @property
    def count(self) -> int:
        """Number of events measured."""
        return int(self._counts.sum())

    def add(self, latency_s: float, events: int = 1) -> None:
        """Count ``events`` that waited for ``latency_s``."""
        if events < 1:
            return
        place = int(np.log10(max(latency_s, _LEAST_S) / _LEAST_S) * _BINS_PER_DECADE)
        self._counts[min(place, len(self._counts) - 1)] += events
        self.max_s = max(self.max_s, latency_s)

    def quantile(self, share: float) -> float:
        """Return the latency in s that this share of events did not exceed; 0 without events."""
        total = self.count
        if not total:
            return 0.0
        place = int(np.searchsorted(np.cumsum(self._counts), share * total, side="left"))
        return float(min(_LEAST_S * 10.0 ** ((place + 1) / _BINS_PER_DECADE), self.max_s))

    def to_json(self) -> dict[str, float | int]:
        """Return the numbers of a report, in ms."""
        return {
            "events": self.count,
            "p50_ms": self.quantile(0.5) * 1e3,
            "p99_ms": self.quantile(0.99) * 1e3,
            "max_ms": self.max_s * 1e3,
        }

    def text(self) -> str:
        """Say the numbers in a line."""
        p50, p99, most = (1e3 * seconds for seconds in (self.quantile(0.5), self.quantile(0.99), self.max_s))
        return f"p50 {p50:.2f} ms, p99 {p99:.2f} ms, max {most:.2f} ms"
