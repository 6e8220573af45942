"""Say what every description of the ego-motion offers, whatever its parameters are."""

from __future__ import annotations

from typing import Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["Trajectory"]


@runtime_checkable
class Trajectory(Protocol):
    """A motion of the image that varies with time.

    ``RotationTrajectory`` turns about a centre, ``AffineTrajectory`` pans, zooms, rolls and shears,
    ``CameraTrajectory`` turns a calibrated camera about three axes. All are immutable.
    """

    @property
    def t_us(self) -> NDArray[np.int64]:
        """Times of the rows, int64[K], strictly increasing."""
        ...

    @property
    def source(self) -> str:
        """Where the motion comes from, for reports."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user."""
        ...

    def predict(
        self, t_us: NDArray[np.int64], x: NDArray[np.uint16], y: NDArray[np.uint16], horizon_us: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where events are expected ``horizon_us`` later (the float path), int64[n] each; may lie outside."""
        ...

    def schedule(
        self, horizon_us: int, *, start_us: int | None = None, stop_us: int | None = None, step_us: int = 1000
    ) -> MotionSchedule:
        """Return the fixed-point schedule for one horizon, an entry every ``step_us`` from start to stop inclusive."""
        ...

    def reversed(self) -> Self:
        """Return the same path run the other way: a control."""
        ...

    def stopped(self) -> Self:
        """Return the same path at rest: the control that predicts "same place"."""
        ...

    def noted(self, *notes: str) -> Self:
        """Return the same motion with more remarks."""
        ...

    def mean(
        self, *, start_us: int | None = None, stop_us: int | None = None
    ) -> tuple[tuple[float, float] | None, float]:
        """Return ``((cx, cy), ω)`` averaged over time; the centre is ``None`` where nothing stands still."""
        ...

    def described(self, *, start_us: int, stop_us: int) -> str:
        """Say the mean motion in words and numbers, for a summary."""
        ...
