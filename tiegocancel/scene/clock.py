"""Let a motion stop and go: the rig's own clock, which slows down, rests and starts again."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["delayed_time", "halting_pace", "halting_time", "starting_pace"]

Times = NDArray[np.float64]


def halting_time(time_s: Times, *, period_s: float, rest_s: float, ramp_s: float) -> Times:
    """Return the time on a clock that runs, slows to rest and starts again once in every ``period_s``.

    A period is: full pace, half a cosine of ``ramp_s`` down to rest, ``rest_s`` at rest, half a cosine up. The pace
    (:func:`halting_pace`) is continuous with a slope of at most π / (2 · ``ramp_s``), and this is its exact integral
    from 0. Whatever moves by this clock keeps its path and only changes its speed.
    """
    go_s = period_s - rest_s - 2.0 * ramp_s
    periods = np.floor(time_s / period_s)
    within = time_s - periods * period_s
    down = np.clip(within - go_s, 0.0, ramp_s)
    up = np.clip(within - (go_s + ramp_s + rest_s), 0.0, ramp_s)
    swing = ramp_s / math.pi * (np.sin(math.pi * down / ramp_s) - np.sin(math.pi * up / ramp_s))
    own: Times = periods * (go_s + ramp_s) + np.minimum(within, go_s) + 0.5 * (down + up + swing)
    return own


def halting_pace(time_s: Times, *, period_s: float, rest_s: float, ramp_s: float) -> Times:
    """Return the pace from 0 to 1 of the clock of :func:`halting_time`."""
    go_s = period_s - rest_s - 2.0 * ramp_s
    within = time_s - np.floor(time_s / period_s) * period_s
    down = np.clip(within - go_s, 0.0, ramp_s)
    up = np.clip(within - (go_s + ramp_s + rest_s), 0.0, ramp_s)
    pace: Times = 0.5 * (1.0 + np.cos(math.pi * down / ramp_s)) + 0.5 * (1.0 - np.cos(math.pi * up / ramp_s))
    return pace


def delayed_time(time_s: Times, *, rest_s: float, ramp_s: float) -> Times:
    """Return the time on a clock that rests for ``rest_s`` and then starts within ``ramp_s``: 0 at rest."""
    since = np.maximum(time_s - rest_s, 0.0)
    up = np.minimum(since, ramp_s)
    own: Times = since - up + 0.5 * (up - ramp_s / math.pi * np.sin(math.pi * up / ramp_s))
    return own


def starting_pace(time_s: Times, *, rest_s: float, ramp_s: float) -> Times:
    """Return the pace from 0 to 1 of the clock of :func:`delayed_time`."""
    pace: Times = 0.5 * (1.0 - np.cos(math.pi * np.clip((time_s - rest_s) / ramp_s, 0.0, 1.0)))
    return pace
