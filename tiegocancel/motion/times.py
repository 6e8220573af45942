"""Check the times of a trajectory's rows and choose those of a schedule's entries."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiegocancel.events import MAX_TIME_US

__all__ = ["EXTRAPOLATE_US", "checked_times", "schedule_times"]

EXTRAPOLATE_US = 50_000
"""An acceleration of a causal row is trusted for this long; after that the motion is held."""


def checked_times(t_us: ArrayLike) -> NDArray[np.int64]:
    """Copy to int64[K]; raise ``ValueError`` unless K ≥ 1, ``|t| ≤ 2^60`` and times increase strictly."""
    times = np.array(t_us)
    if times.dtype.kind not in "iu":
        raise ValueError(f"t_us must be integers, not {times.dtype}")
    if times.ndim != 1 or len(times) == 0:
        raise ValueError(f"t_us must be int64[K] with K ≥ 1, not of shape {times.shape}")
    if int(times.min()) < -MAX_TIME_US or int(times.max()) > MAX_TIME_US:
        raise ValueError(f"t_us must lie within ±{MAX_TIME_US} µs, not from {times.min()} to {times.max()}")
    times = times.astype(np.int64)
    if (times[1:] <= times[:-1]).any():
        row = int(np.argmax(times[1:] <= times[:-1])) + 1
        raise ValueError(f"t_us must increase strictly: row {row} has {times[row]} µs after {times[row - 1]} µs")
    return times


def schedule_times(
    t_us: NDArray[np.int64],
    horizon_us: int,
    start_us: int | None,
    stop_us: int | None,
    step_us: int,
    *,
    causal: bool = False,
) -> NDArray[np.int64]:
    """Return the times of a schedule's entries: from start to stop inclusive, every ``step_us``, within the rows' span.

    ``causal`` rows are valid from their own time on: each begins a grid of its own, which ends where nothing changes
    any more, so that a schedule of any later span has the same entries; the first is at or before start.
    """
    if horizon_us < 0:
        raise ValueError(f"horizon_us must not be negative, not {horizon_us}")
    if step_us < 1:
        raise ValueError(f"step_us must be at least 1 µs, not {step_us}")
    first, last = int(t_us[0]), int(t_us[-1])
    start = first if start_us is None else max(int(start_us), first)
    stop = max(last, start) if stop_us is None else max(int(stop_us), first)
    if not causal:
        start, stop = min(start, last), min(stop, last)
    if stop < start:
        raise ValueError(f"stop_us must not lie before start_us: {stop_us} µs after {start_us} µs")
    if causal:
        return _grids(t_us, start, stop, int(step_us))
    times = np.arange(start, stop + 1, int(step_us), dtype=np.int64)
    return times if times[-1] == stop else np.append(times, np.int64(stop))


def _grids(t_us: NDArray[np.int64], start: int, stop: int, step_us: int) -> NDArray[np.int64]:
    """Return the grid of every row between start and stop, from the last time at or before start on."""
    low = max(int(np.searchsorted(t_us, start, side="right")) - 1, 0)
    rows = t_us[low : int(np.searchsorted(t_us, stop, side="right"))]
    spans = np.minimum(np.append(rows[1:], stop + 1) - rows, EXTRAPOLATE_US + step_us)
    counts = -(-spans // step_us)
    offsets = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    times = np.repeat(rows, counts) + offsets * step_us
    kept: NDArray[np.int64] = times[max(int(np.searchsorted(times, start, side="right")) - 1, 0) :]
    return kept
