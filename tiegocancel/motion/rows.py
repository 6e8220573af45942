"""Hold a table of motion parameters over time: check it, interpolate it, carry it on, average it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiegocancel.motion.times import EXTRAPOLATE_US

__all__ = ["blended", "carried", "checked_rows", "span_of", "time_mean"]


def checked_rows(name: str, values: ArrayLike, shape: tuple[int, ...], bound: ArrayLike) -> NDArray[np.float64]:
    """Copy to a read-only float64[K] or float64[K, D].

    ``bound`` is one number or one for each of the D columns. Raise ``ValueError`` for another shape and for values that
    are not finite or beyond ``±bound``.
    """
    given = np.asarray(values)
    if given.dtype.kind not in "fiu":
        raise ValueError(f"{name} must be numbers, not {given.dtype}")
    table = np.array(given, np.float64)
    if table.shape != shape:
        raise ValueError(f"{name} must be float64{list(shape)}, not of shape {table.shape}")
    limits = np.broadcast_to(np.asarray(bound, np.float64), shape)
    # Written with "not", because a comparison with NaN is false.
    wrong = ~(np.abs(table) <= limits)
    if wrong.any():
        place = tuple(np.argwhere(wrong)[0].tolist())
        raise ValueError(
            f"{name} must be finite and within ±{limits[place]:g}: row {place[0]} has {table[place[0]].tolist()}"
        )
    table.flags.writeable = False
    return table


def blended(t_us: NDArray[np.int64], table: NDArray[np.float64], times: NDArray[np.int64]) -> NDArray[np.float64]:
    """Interpolate the rows float64[K, D] linearly at times int64[n], holding the ends; return float64[n, D].

    Each element depends on its own time alone, so any chunking of the query gives the same bits.
    """
    if len(t_us) == 1:
        return np.broadcast_to(table[0], (*times.shape, table.shape[1]))
    left = np.clip(np.searchsorted(t_us, times, side="right") - 1, 0, len(t_us) - 2)
    # Differences are taken in int64: float64 would lose microseconds of times beyond 2^53.
    elapsed = (times - t_us[left]).astype(np.float64)
    share = (elapsed / (t_us[left + 1] - t_us[left]).astype(np.float64))[:, None]
    before, after = table[left], table[left + 1]
    between = before + share * (after - before)
    mixed: NDArray[np.float64] = np.where(share <= 0.0, before, np.where(share >= 1.0, after, between))
    return mixed


def carried(
    t_us: NDArray[np.int64], table: NDArray[np.float64], slopes: NDArray[np.float64], times: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Carry the last row at or before each time on along its slope (1/s); before the first row, hold it.

    Return the values float64[n, D] and the slopes float64[n, D] that a horizon is extrapolated with: zero once a row is
    older than ``EXTRAPOLATE_US``, where the values are held.
    """
    row = np.maximum(np.searchsorted(t_us, times, side="right") - 1, 0)
    elapsed = np.clip(times - t_us[row], 0, EXTRAPOLATE_US)
    fresh = (times >= t_us[row]) & (elapsed < EXTRAPOLATE_US)
    ahead = table[row] + slopes[row] * (elapsed * 1e-6)[:, None]
    return ahead, np.where(fresh[:, None], slopes[row], 0.0)


def span_of(t_us: NDArray[np.int64], start_us: int | None, stop_us: int | None) -> tuple[int, int]:
    """Return start and stop, by default the rows' own; raise ``ValueError`` when stop lies before start."""
    start = int(t_us[0]) if start_us is None else int(start_us)
    stop = int(t_us[-1]) if stop_us is None else int(stop_us)
    if stop < start:
        raise ValueError(f"stop_us must not lie before start_us: {stop} µs after {start} µs")
    return start, stop


def time_mean(
    t_us: NDArray[np.int64],
    at: Callable[[NDArray[np.int64]], NDArray[np.float64]],
    start_us: int | None,
    stop_us: int | None,
) -> NDArray[np.float64]:
    """Average ``at(times) -> float64[n, D]`` over time, by default over the rows' span; return float64[D].

    The trapezoid over all rows in between: exact for a path that is linear from row to row.
    """
    start, stop = span_of(t_us, start_us, stop_us)
    inner = t_us[(t_us > start) & (t_us < stop)]
    nodes = np.unique(np.concatenate([np.array([start, stop], np.int64), inner]))
    table = at(nodes)
    if len(nodes) == 1:
        only: NDArray[np.float64] = table[0]
        return only
    weights = (nodes[1:] - nodes[:-1]).astype(np.float64)
    mean: NDArray[np.float64] = np.average(0.5 * (table[1:] + table[:-1]), axis=0, weights=weights)
    return mean
