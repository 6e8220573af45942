"""Hold the turning of a calibrated camera about its three axes, seen in the image of a far scene."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiegocancel.motion.affine import AffineInterpolation
from tiegocancel.motion.affine_fit import fit_displacement, sensor_grid
from tiegocancel.motion.approximation import ApproximationError, schedule_error
from tiegocancel.motion.intrinsics import CameraIntrinsics
from tiegocancel.motion.rotation import MAX_CENTER_PX, MAX_OMEGA_DOT_RAD_S2, MAX_OMEGA_RAD_S
from tiegocancel.motion.rows import blended, carried, checked_rows, time_mean
from tiegocancel.motion.schedule import MotionSchedule, fixed_point
from tiegocancel.motion.times import checked_times, schedule_times
from tiegocancel.motion.turning import rotation_matrix, turned

__all__ = ["OUTSIDE_PX", "CameraTrajectory"]

Places = tuple[NDArray[np.float64], NDArray[np.float64]]

OUTSIDE_PX = -(1 << 40)
"""Coordinate of a prediction that the camera cannot see: outside every sensor."""

_FIT_POINTS = 15


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CameraTrajectory:
    """Angular velocity of a camera about its own axes (x right, y down, z forward) at instants, with its intrinsics.

    ``t_us`` int64[K], strictly increasing, K ≥ 1, ``|t| ≤ 2^60``; ``omega_rad_s`` float64[K, 3] within ±1e6 rad/s, and
    ``omega_dot_rad_s2`` float64[K, 3], zeros unless given, which serves ``causal`` alone; ``interpolation`` as in
    ``AffineTrajectory``. A camera that turns by ``Ω`` sees a far point at ``X`` move by ``dX/dt = −Ω × X``: after Δt it
    is at ``R(−Ω·Δt)·X``, and its pixel has moved by the homography ``K·R(−Ω·Δt)·K⁻¹``. A positive ``Ω_z`` (the camera
    turns x towards y) therefore turns the image the other way. With a lens that bends, pixels are those of the lens;
    for events that were undistorted give ``intrinsics.pinhole()``. ``width`` and ``height`` in px are those of the
    sensor, over which a schedule is fitted, by default the intrinsics'. Raise ``ValueError`` when a check fails.
    """

    t_us: NDArray[np.int64]
    omega_rad_s: NDArray[np.float64]
    intrinsics: CameraIntrinsics
    omega_dot_rad_s2: NDArray[np.float64] | None = None
    width: int | None = None
    height: int | None = None
    interpolation: AffineInterpolation = "linear"
    source: str = "camera"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.interpolation not in get_args(AffineInterpolation):
            raise ValueError(f"interpolation must be linear or causal, not {self.interpolation!r}")
        times = checked_times(self.t_us)
        times.flags.writeable = False
        shape = (len(times), 3)
        slopes = np.zeros(shape) if self.omega_dot_rad_s2 is None else self.omega_dot_rad_s2
        columns = {
            "t_us": times,
            "omega_rad_s": checked_rows("omega_rad_s", self.omega_rad_s, shape, MAX_OMEGA_RAD_S),
            "omega_dot_rad_s2": checked_rows("omega_dot_rad_s2", slopes, shape, MAX_OMEGA_DOT_RAD_S2),
            "notes": tuple(self.notes),
        }
        for name, column in columns.items():
            object.__setattr__(self, name, column)
        for name in ("width", "height"):
            side = getattr(self, name) or getattr(self.intrinsics, name)
            if side is None or side < 1:
                raise ValueError(f"{name} must be at least 1 px, and the intrinsics do not say it")
            object.__setattr__(self, name, side)

    @classmethod
    def constant(
        cls,
        omega_rad_s: ArrayLike,
        *,
        intrinsics: CameraIntrinsics,
        width: int | None = None,
        height: int | None = None,
        t_us: int = 0,
        source: str = "constant",
    ) -> CameraTrajectory:
        """Return one turning ``(Ω_x, Ω_y, Ω_z)`` for all time."""
        return cls(
            t_us=np.array([t_us], np.int64),
            omega_rad_s=np.array([omega_rad_s], np.float64),
            intrinsics=intrinsics,
            width=width,
            height=height,
            source=source,
        )

    def __len__(self) -> int:
        return len(self.t_us)

    def at(self, t_us: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return ``Ω`` float64[n, 3] at times int64[n] in µs; any chunking gives the same bits."""
        return self._at(np.asarray(t_us, np.int64))[0]

    def places(self, t_us: NDArray[np.int64], x_px: ArrayLike, y_px: ArrayLike, horizon_us: int) -> Places:
        """Return where pixels ``(x, y)`` float64[n] are ``horizon_us`` after the times int64[n] or [1], not rounded.

        NaN for what the lens does not show before or after. The exact homography for constant ``Ω``; one that changes
        is taken at its mean over the horizon.
        """
        return self._ahead(t_us, *self.intrinsics.directions(x_px, y_px), horizon_us)

    def predict(
        self, t_us: NDArray[np.int64], x: NDArray[np.uint16], y: NDArray[np.uint16], horizon_us: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where events are expected ``horizon_us`` later, int64[n] each; ``OUTSIDE_PX`` where out of sight.

        The float path: :meth:`places`, rounded with ``floor(v + 0.5)``. Any chunking gives the same numbers.
        """
        assert self.width is not None  # filled in __post_init__
        assert self.height is not None
        if self.intrinsics.is_pinhole or not len(x) or int(x.max()) >= self.width or int(y.max()) >= self.height:
            seen = self.intrinsics.directions(x, y)
        else:
            # The inverse of a lens costs more than all the rest: it is taken once for each pixel.
            across, down = _pixel_directions(self.intrinsics, self.width, self.height)
            pixel = y.astype(np.int64) * self.width + x
            seen = across[pixel], down[pixel]
        ahead = self._ahead(t_us, *seen, horizon_us)
        lost = np.isnan(ahead[0]) | np.isnan(ahead[1])
        far = float(-OUTSIDE_PX)
        ahead_x, ahead_y = (np.floor(np.clip(np.where(lost, -far, v), -far, far) + 0.5).astype(np.int64) for v in ahead)
        return ahead_x, ahead_y

    def schedule(
        self, horizon_us: int, *, start_us: int | None = None, stop_us: int | None = None, step_us: int = 1000
    ) -> MotionSchedule:
        """Return the fixed-point schedule for one horizon, an entry every ``step_us`` from start to stop inclusive.

        An entry is the affine displacement nearest to the true one by least squares over the sensor, every place of
        equal weight; :meth:`approximation_error` says how near that is. Raise ``ValueError`` when less than three
        places of the sensor stay in sight.
        """
        causal = self.interpolation == "causal"
        times = schedule_times(self.t_us, horizon_us, start_us, stop_us, step_us, causal=causal)
        assert self.width is not None  # filled in __post_init__
        assert self.height is not None
        grid_x, grid_y = sensor_grid(self.width, self.height, _FIT_POINTS)
        distinct = times if len(self) > 1 or causal else times[:1]
        across, down = self.intrinsics.directions(grid_x, grid_y)
        rows = []
        for first in range(0, len(distinct), 1024):  # a block at a time, for memory
            matrices = self._matrices(distinct[first : first + 1024], horizon_us)[:, None]
            ahead_x, ahead_y = self.intrinsics.pixels(*turned(matrices, across, down))
            rows.append(fit_displacement(grid_x, grid_y, ahead_x - grid_x, ahead_y - grid_y))
        return MotionSchedule(times, fixed_point(np.concatenate(rows)), horizon_us)

    def approximation_error(
        self,
        horizon_us: int,
        width: int | None = None,
        height: int | None = None,
        *,
        start_us: int | None = None,
        stop_us: int | None = None,
        step_us: int = 1000,
    ) -> ApproximationError:
        """Return how far the schedule's places lie from the exact ones, in px, over a sensor and over time.

        :func:`~tiegocancel.motion.approximation.schedule_error` says how it is measured. ``width`` and ``height`` are
        by default the trajectory's.
        """
        sensor = replace(self, width=width or self.width, height=height or self.height)
        schedule = sensor.schedule(horizon_us, start_us=start_us, stop_us=stop_us, step_us=step_us)
        assert sensor.width is not None  # filled in __post_init__
        assert sensor.height is not None

        def places(t_us: int, x: NDArray[np.float64], y: NDArray[np.float64]) -> Places:
            return self.places(np.array([t_us], np.int64), x, y, horizon_us)

        speed = np.abs(self.at(schedule.t_us)).sum(axis=1)
        return schedule_error(schedule, places, sensor.width, sensor.height, speed)

    def reported(self, horizon_us: int, *, step_us: int = 1000) -> CameraTrajectory:
        """Return the same motion with a note of what its reduction to an affine schedule costs."""
        worst, rms = self.approximation_error(horizon_us, step_us=step_us)
        return self.noted(
            f"three-axis turn reduced to an affine schedule: at most {worst:.2f} px off, rms {rms:.2f} px, "
            f"over {self.width} × {self.height} px for {horizon_us} µs ahead"
        )

    def reversed(self) -> CameraTrajectory:
        """Return the same path run the other way: a control."""
        return self._times(-1.0, "reversed")

    def stopped(self) -> CameraTrajectory:
        """Return the same path at rest: the control that predicts "same place"."""
        return self._times(0.0, "stopped")

    def noted(self, *notes: str) -> CameraTrajectory:
        """Return the same motion with more remarks."""
        return replace(self, notes=(*self.notes, *notes))

    def mean(
        self, *, start_us: int | None = None, stop_us: int | None = None
    ) -> tuple[tuple[float, float] | None, float]:
        """Return the pixel that the mean axis of turning pierces, ``None`` where none is near, and the mean ``−Ω_z``.

        The image turns about that pixel by ``−Ω_z`` rad/s as seen along the optical axis, positive from x towards y.
        """
        x, y, z = (float(value) for value in time_mean(self.t_us, self.at, start_us, stop_us))
        if abs(z) * MAX_CENTER_PX <= max(abs(x), abs(y)):
            return None, 0.0 - z
        center = [float(place) for place in self.intrinsics.pixels(x / z, y / z)]
        near = all(abs(place) <= MAX_CENTER_PX for place in center)  # false for NaN
        return (center[0], center[1]) if near else None, 0.0 - z

    def described(self, *, start_us: int, stop_us: int) -> str:
        """Say the mean motion in words and numbers."""
        x, y, z = time_mean(self.t_us, self.at, start_us, stop_us)
        return f"camera turns ({x:+.4f}, {y:+.4f}, {z:+.4f}) rad/s about right, down and forward"

    def _times(self, factor: float, word: str) -> CameraTrajectory:
        """Return the same path at ``factor`` times the speed."""
        assert self.omega_dot_rad_s2 is not None  # filled in __post_init__
        return replace(
            self,
            omega_rad_s=factor * self.omega_rad_s + 0.0,
            omega_dot_rad_s2=factor * self.omega_dot_rad_s2 + 0.0,
            source=f"{self.source}, {word}",
        )

    def _ahead(
        self, t_us: NDArray[np.int64], across: NDArray[np.float64], down: NDArray[np.float64], horizon_us: int
    ) -> Places:
        """Return the pixels float64[n] of directions ``horizon_us`` after the times int64[n]."""
        return self.intrinsics.pixels(*turned(self._matrices(t_us, horizon_us), across, down))

    def _matrices(self, t_us: NDArray[np.int64], horizon_us: int) -> NDArray[np.float64]:
        """Return ``R(−Ω·Δt)`` float64[n, 3, 3] for times int64[n], or one for all of them where nothing changes."""
        steady = len(self) == 1 and self.interpolation == "linear"
        times = self.t_us if steady else np.asarray(t_us, np.int64)
        omega, slope = self._at(times)
        horizon_s = horizon_us * 1e-6
        return rotation_matrix(-(omega + slope * (0.5 * horizon_s)) * horizon_s)

    def _at(self, times: NDArray[np.int64]) -> Places:
        """Return ``Ω`` and the slope that a horizon is extrapolated with, float64[n, 3] each."""
        if self.interpolation == "causal":
            assert self.omega_dot_rad_s2 is not None  # filled in __post_init__
            return carried(self.t_us, self.omega_rad_s, self.omega_dot_rad_s2, times)
        return blended(self.t_us, self.omega_rad_s, times), np.zeros((1, 3))


@lru_cache(maxsize=2)
def _pixel_directions(intrinsics: CameraIntrinsics, width: int, height: int) -> Places:
    """Return ``X/Z`` and ``Y/Z`` of every pixel, row by row, float64[height · width] each."""
    y, x = np.divmod(np.arange(width * height), width)
    return intrinsics.directions(x, y)
