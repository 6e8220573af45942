"""Apply the motion to one event at a time, plainly: what the plain models predict with."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.motion.trajectory import Trajectory

__all__ = ["ahead", "displacement"]


def ahead(motion: MotionSchedule | Trajectory, t_us: int, x: int, y: int, horizon_us: int) -> tuple[int, int]:
    """Return where an event at ``(x, y)`` is expected one horizon later by the motion of ``t_us``; may lie outside.

    A schedule gives six integers with 16 fractional bits; a trajectory is the float path.
    """
    if not isinstance(motion, MotionSchedule):
        ahead_x, ahead_y = motion.predict(
            np.array([t_us], np.int64), np.array([x], np.uint16), np.array([y], np.uint16), horizon_us
        )
        return int(ahead_x[0]), int(ahead_y[0])
    across, down = displacement(motion, t_us, x, y)
    return ((x << 16) + across + 32768) >> 16, ((y << 16) + down + 32768) >> 16


def displacement(motion: MotionSchedule, t_us: int, x: int, y: int) -> tuple[int, int]:
    """Return how far an event at ``(x, y)`` moves within the schedule's horizon, with 16 fractional bits."""
    entry = max(bisect_right(motion.t_us, t_us) - 1, 0)
    a, b, c, d, e, f = (int(value) for value in motion.coefficients[entry])
    return a * x + b * y + c, d * x + e * y + f
