"""Hold causal estimates of the motion: what every estimator returns, one row an update."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tiegocancel.events import Events
from tiegocancel.motion.rotation import RotationTrajectory

__all__ = ["Estimator", "MotionEstimate", "trajectory_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionEstimate:
    """The rotation for use from ``t_us`` on, made of events before ``t_us`` alone.

    ``center_px`` and ``omega_rad_s`` (ω at ``t_us``, to be carried on with ``omega_dot_rad_s2``) with one standard
    deviation each, ∞ where the window does not constrain the value: then the last value that was known stands there, or
    NaN for a centre that never was. ``sharpness`` is the variance of the window's image of warped events over that of
    the events as they are (residual sharpness; NaN where an estimator makes none). ``confident``: fit for use;
    otherwise ``doubt`` says why not in a few words. ``doubt`` may be given with ``confident`` too (a centre that is
    held). ``events_used`` of the ``events_seen`` in the window. ``window``: mean time in µs of the window's events and
    ω of them alone, before any filter, which lags where ω swings; ``None`` where an estimator has none. ``turn_rad_s``:
    the camera's own turn about right, down and forward, where it is measured.
    """

    t_us: int
    center_px: tuple[float, float]
    omega_rad_s: float
    omega_dot_rad_s2: float = 0.0
    center_sigma_px: float = math.inf
    omega_sigma_rad_s: float = math.inf
    sharpness: float = math.nan
    confident: bool = True
    doubt: str = ""
    events_used: int = 0
    events_seen: int = 0
    window: tuple[int, float] | None = None
    turn_rad_s: tuple[float, float, float] | None = None

    @property
    def has_center(self) -> bool:
        """Tell whether a centre is or ever was known."""
        return math.isfinite(self.center_px[0]) and math.isfinite(self.center_px[1])


class Estimator(Protocol):
    """Find the motion of a stream causally, chunk by chunk; chunk borders change nothing."""

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the estimates that became due, times strictly increasing.

        Every event of the chunk before an estimate's ``t_us`` may have been used, none at or after it.
        """
        ...


def trajectory_of(estimates: Sequence[MotionEstimate], *, source: str) -> RotationTrajectory:
    """Return the causal trajectory of estimates; those whose centre never was known are left out, with a note.

    Raise ``ValueError`` when none remains.
    """
    known = [estimate for estimate in estimates if estimate.has_center]
    if not known:
        raise ValueError(f"none of {len(estimates)} estimates knows a centre")
    notes = []
    if len(known) < len(estimates):
        notes.append(f"{len(estimates) - len(known)} of {len(estimates)} estimates know no centre and were left out")
    doubtful = sum(not estimate.confident for estimate in known)
    if doubtful:
        notes.append(f"{doubtful} of {len(known)} estimates are marked doubtful")
    return RotationTrajectory(
        t_us=np.array([estimate.t_us for estimate in known], np.int64),
        center_px=np.array([estimate.center_px for estimate in known], np.float64),
        omega_rad_s=np.array([estimate.omega_rad_s for estimate in known], np.float64),
        omega_dot_rad_s2=np.array([estimate.omega_dot_rad_s2 for estimate in known], np.float64),
        interpolation="causal",
        source=source,
        notes=tuple(notes),
    )
