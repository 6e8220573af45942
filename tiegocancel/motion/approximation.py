"""Measure how far the places of a schedule lie from the true ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tiegocancel.motion.affine_fit import sensor_grid
from tiegocancel.motion.schedule import FRACTION_BITS, MotionSchedule

__all__ = ["ApproximationError", "schedule_error"]

_POINTS = 41
_ENTRIES = 256

Floats = NDArray[np.float64]


class ApproximationError(NamedTuple):
    """Say how far a schedule's places lie from the true ones: the largest and the root mean square, in px."""

    max_px: float
    rms_px: float


def schedule_error(
    schedule: MotionSchedule,
    places: Callable[[int, Floats, Floats], tuple[Floats, Floats]],
    width: int,
    height: int,
    speed: Floats,
) -> ApproximationError:
    """Compare a schedule with the true ``places(t_us, x, y) -> (x', y')`` in px over a sensor and over time.

    ``places`` takes one time and float64[n] twice; NaN is out of sight and left out. Measured on 41 × 41 places from
    edge to edge, when an entry begins and just before the next one does; of more than 256 entries, evenly chosen ones
    and that of the largest ``speed`` float64[K]. Rounding to whole pixels comes on top.
    """
    x, y = sensor_grid(width, height, _POINTS)
    chosen = np.linspace(0, len(schedule) - 1, _ENTRIES).round().astype(np.int64)
    largest, total, count = 0.0, 0.0, 0
    for row in np.union1d(chosen, np.argmax(speed)).tolist():
        a, b, c, d, e, f = schedule.coefficients[row] / (1 << FRACTION_BITS)
        begin, after = int(schedule.t_us[row]), schedule.t_us[row + 1 : row + 2] - 1
        for time in {begin, *after.tolist()}:
            ahead_x, ahead_y = places(time, x, y)
            miss = np.hypot(x + a * x + b * y + c - ahead_x, y + d * x + e * y + f - ahead_y)
            seen = miss[~np.isnan(miss)]
            largest = max(largest, float(seen.max(initial=0.0)))
            total, count = total + float(np.square(seen).sum()), count + len(seen)
    return ApproximationError(largest, float(np.sqrt(total / max(count, 1))))
