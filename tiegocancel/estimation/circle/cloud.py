"""Hold a thinned cloud of the events of the past, bounded in size."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

__all__ = ["EventCloud"]


class EventCloud:
    """Coordinates of past events, a few a slice of time, for fits over stretches much longer than a window.

    Each slice keeps at most ``slice_events``, evenly taken by rank and not drawn, so that the cloud depends on the
    slices alone; slices older than ``span_us`` are dropped.
    """

    def __init__(self, *, span_us: int, slice_events: int) -> None:
        self._span_us = span_us
        self._slice_events = slice_events
        self._slices: deque[tuple[int, NDArray[np.float32]]] = deque()

    def add(self, stop_us: int, x: NDArray[np.uint16], y: NDArray[np.uint16]) -> None:
        """Add the slice that ends before ``stop_us``, later than all before."""
        if len(x):
            rows = _even_rows(len(x), self._slice_events)
            self._slices.append((stop_us, np.column_stack([x[rows], y[rows]]).astype(np.float32)))
        while self._slices and self._slices[0][0] <= stop_us - self._span_us:
            self._slices.popleft()

    def age_us(self, t_us: int) -> int:
        """Return how long before ``t_us`` the oldest slice ended, 0 where there is none."""
        return t_us - self._slices[0][0] if self._slices else 0

    def after(self, start_us: int, most: int) -> NDArray[np.float64]:
        """Return at most ``most`` points float64[n, 2] of the slices that ended after ``start_us``, evenly taken."""
        parts = []
        for stop_us, points in reversed(self._slices):
            if stop_us <= start_us:
                break
            parts.append(points)
        if not parts:
            return np.zeros((0, 2))
        total = sum(len(points) for points in parts)
        stride = max(total // (4 * most), 1)  # far more than needed is not even joined
        joined = np.concatenate([points[::stride] for points in reversed(parts)])
        return joined[_even_rows(len(joined), most)].astype(np.float64)


def _even_rows(count: int, most: int) -> NDArray[np.int64]:
    if count <= most:
        return np.arange(count)
    return (np.arange(most) * count) // most
