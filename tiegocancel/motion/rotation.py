"""Hold a rotation that varies with time: centre and angular velocity at known instants."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from tiegocancel.motion.rows import blended, carried, checked_rows, time_mean
from tiegocancel.motion.schedule import MotionSchedule, turn_coefficients
from tiegocancel.motion.times import checked_times, schedule_times

__all__ = ["MAX_CENTER_PX", "MAX_OMEGA_RAD_S", "Interpolation", "RotationTrajectory"]

Interpolation = Literal["linear", "spline", "causal"]
"""Between rows: straight lines, a monotone cubic, or the last row alone, carried on with its own acceleration."""

MAX_CENTER_PX = float(1 << 24)
"""Bound of a centre coordinate: predictions of any 16-bit pixel then fit an int64 with room to spare."""
MAX_OMEGA_RAD_S = 1e6
"""Bound of an angular velocity; no camera or rig comes near it, a wrong unit may."""

MAX_OMEGA_DOT_RAD_S2 = 1e9
"""Bound of an angular acceleration."""

_WANDERING_PX = 50.0
_FULL_TURN = 2.0 * np.pi


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RotationTrajectory:
    """Rotation ``(cx, cy, ω)`` at instants, interpolated in between (eq. 3.5).

    ``t_us`` int64[K], strictly increasing, K ≥ 1, ``|t| ≤ 2^60``; ``center_px`` float64[K, 2] within ±2^24 px;
    ``omega_rad_s`` float64[K] within ±1e6 rad/s, positive turns x towards y (y points down); ``omega_dot_rad_s2``
    float64[K], zeros unless given, serves ``causal`` alone. ``interpolation``:

    - ``linear`` between rows, held beyond the first and the last; a horizon turns by ``ω(t)·Δt``.
    - ``spline``: monotone cubic (PCHIP, no overshoot), held and turned in the same way.
    - ``causal``: a time uses the last row at or before it and nothing later, with ``ω`` carried on along
      ``omega_dot_rad_s2`` for at most ``EXTRAPOLATE_US``; a horizon turns by the integral of that ``ω`` over it.

    ``source`` names the origin in reports: ``constant``, a file name, ``fit``. ``notes`` are remarks for the user.
    Raise ``ValueError`` naming column, row and value when a check fails.
    """

    t_us: NDArray[np.int64]
    center_px: NDArray[np.float64]
    omega_rad_s: NDArray[np.float64]
    omega_dot_rad_s2: NDArray[np.float64] | None = None
    interpolation: Interpolation = "linear"
    source: str = "constant"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.interpolation not in get_args(Interpolation):
            raise ValueError(f"interpolation must be linear, spline or causal, not {self.interpolation!r}")
        times = checked_times(self.t_us)
        count = len(times)
        centers = checked_rows("center_px", self.center_px, (count, 2), MAX_CENTER_PX)
        omegas = checked_rows("omega_rad_s", self.omega_rad_s, (count,), MAX_OMEGA_RAD_S)
        slopes = np.zeros(count) if self.omega_dot_rad_s2 is None else self.omega_dot_rad_s2
        slopes = checked_rows("omega_dot_rad_s2", slopes, (count,), MAX_OMEGA_DOT_RAD_S2)
        columns = (
            ("t_us", times),
            ("center_px", centers),
            ("omega_rad_s", omegas),
            ("omega_dot_rad_s2", slopes),
        )
        for name, column in columns:
            column.flags.writeable = False
            object.__setattr__(self, name, column)
        object.__setattr__(self, "notes", tuple(self.notes))

    @classmethod
    def constant(
        cls, *, center_px: tuple[float, float], omega_rad_s: float, t_us: int = 0, source: str = "constant"
    ) -> RotationTrajectory:
        """Return one rotation for all time."""
        return cls(
            t_us=np.array([t_us], np.int64),
            center_px=np.array([center_px], np.float64),
            omega_rad_s=np.array([omega_rad_s], np.float64),
            source=source,
        )

    @classmethod
    def from_csv(cls, path: str | Path) -> RotationTrajectory:
        """Read a tracker's file; columns, units and faults are those of :mod:`tiegocancel.motion.trajectory_csv`."""
        from tiegocancel.motion.trajectory_csv import read_trajectory

        return read_trajectory(path)

    def to_csv(self, path: str | Path) -> None:
        """Write ``timestamp, center_x, center_y, omega_rad_s``, digits enough to read back the same numbers."""
        from tiegocancel.motion.trajectory_csv import write_trajectory

        write_trajectory(self, path)

    def __len__(self) -> int:
        return len(self.t_us)

    def at(self, t_us: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return ``cx``, ``cy`` in px and ``ω`` in rad/s, float64[n] each, at times int64[n] in µs (eq. 3.5).

        Each element depends on its own time alone, so any chunking of the query gives the same bits.
        """
        cx, cy, omega, _ = self._at(np.asarray(t_us, np.int64))
        return cx, cy, omega

    def turns(
        self, t_us: NDArray[np.int64], horizon_us: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return ``cx``, ``cy`` in px and the angle in rad that the image turns by within ``horizon_us`` of each time.

        ``ω(t)·Δt``, and with ``causal`` the integral of the extrapolated ``ω`` over the horizon.
        """
        cx, cy, omega, slope = self._at(np.asarray(t_us, np.int64))
        horizon_s = horizon_us * 1e-6
        return cx, cy, (omega + slope * (0.5 * horizon_s)) * horizon_s

    def predict(
        self, t_us: NDArray[np.int64], x: NDArray[np.uint16], y: NDArray[np.uint16], horizon_us: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where events are expected ``horizon_us`` later, int64[n] each; may lie outside (eq. 3.6).

        The float path: rotate in float64 by the angle of :meth:`turns` about the centre at the event's own time, round
        with ``floor(v + 0.5)``. Any chunking of the events gives the same numbers.
        """
        cx, cy, theta = self.turns(t_us, horizon_us)
        # NumPy's sine may treat a whole vector differently when one lane holds a huge angle; fmod, which leaves
        # angles below a full turn untouched, keeps every element independent of its neighbours.
        theta = np.fmod(theta, _FULL_TURN)
        cosine, sine = np.cos(theta), np.sin(theta)
        right, down = x.astype(np.float64) - cx, y.astype(np.float64) - cy
        ahead_x = cx + (cosine * right - sine * down)
        ahead_y = cy + (sine * right + cosine * down)
        return np.floor(ahead_x + 0.5).astype(np.int64), np.floor(ahead_y + 0.5).astype(np.int64)

    def schedule(
        self, horizon_us: int, *, start_us: int | None = None, stop_us: int | None = None, step_us: int = 1000
    ) -> MotionSchedule:
        """Return the fixed-point schedule for one horizon, an entry every ``step_us`` from start to stop inclusive.

        An entry at ``t_k`` holds the parameters at ``t_k``. Start and stop default to the trajectory's own span and
        are clipped to it, because the parameters are held beyond it (``causal`` may stop later: it goes on
        extrapolating, and has an entry at every row). A constant gives one entry.
        """
        times = schedule_times(self.t_us, horizon_us, start_us, stop_us, step_us, causal=self.interpolation == "causal")
        cx, cy, theta = self.turns(times, horizon_us)
        return MotionSchedule(times, turn_coefficients(cx, cy, theta), horizon_us)

    def reversed(self) -> RotationTrajectory:
        """Return the same path turning the other way: the control −ω."""
        return self._turned(-1.0, "reversed")

    def stopped(self) -> RotationTrajectory:
        """Return the same path at rest: the control ω = 0, which predicts "same place"."""
        return self._turned(0.0, "stopped")

    def noted(self, *notes: str) -> RotationTrajectory:
        """Return the same motion with more remarks."""
        return replace(self, notes=(*self.notes, *notes))

    def described(self, *, start_us: int, stop_us: int) -> str:
        """Say the mean motion in words and numbers."""
        (cx, cy), omega = self.mean(start_us=start_us, stop_us=stop_us)
        inside = (self.t_us >= start_us) & (self.t_us <= stop_us)
        if inside.any() and float(self.center_px[inside].std(axis=0).max()) > _WANDERING_PX:
            return f"a centre that wanders, ω {omega:+.4f} rad/s"
        return f"centre ({cx:.1f}, {cy:.1f}) px, ω {omega:+.4f} rad/s"

    def mean(self, *, start_us: int | None = None, stop_us: int | None = None) -> tuple[tuple[float, float], float]:
        """Return ``((cx, cy), ω)`` averaged over time from start to stop, by default the trajectory's own span."""
        cx, cy, omega = time_mean(self.t_us, lambda times: np.column_stack(self.at(times)), start_us, stop_us).tolist()
        return (cx, cy), omega

    def _turned(self, factor: float, word: str) -> RotationTrajectory:
        """Return the same path at ``factor`` times the speed."""
        assert self.omega_dot_rad_s2 is not None  # filled in __post_init__
        return replace(
            self,
            omega_rad_s=factor * self.omega_rad_s,
            omega_dot_rad_s2=factor * self.omega_dot_rad_s2,
            source=f"{self.source}, {word}",
        )

    def _at(self, times: NDArray[np.int64]) -> tuple[NDArray[np.float64], ...]:
        """Return ``cx``, ``cy``, ``ω`` and the ``dω/dt`` that a horizon is extrapolated with, float64[n] each."""
        table = np.column_stack([self.center_px, self.omega_rad_s])
        slope = np.zeros(times.shape)
        if self.interpolation == "causal":
            slopes = np.zeros(table.shape)
            slopes[:, 2] = self.omega_dot_rad_s2
            values, ahead = carried(self.t_us, table, slopes, times)
            slope = ahead[:, 2]
        elif self.interpolation == "spline" and len(self) > 1:
            from scipy.interpolate import PchipInterpolator

            # Relative to the first row, and held to the span: float64 would lose microseconds of times beyond 2^53.
            elapsed = (self.t_us - self.t_us[0]).astype(np.float64)
            inside = (np.clip(times, self.t_us[0], self.t_us[-1]) - self.t_us[0]).astype(np.float64)
            values = PchipInterpolator(elapsed, table, axis=0)(inside)
        else:
            values = blended(self.t_us, table, times)
        cx, cy, omega = values.T
        return cx, cy, omega, slope
