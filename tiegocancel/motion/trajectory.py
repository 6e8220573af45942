"""Hold a rotation that varies with time: centre and angular velocity at known instants."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiegocancel.events import MAX_TIME_US
from tiegocancel.motion.schedule import MotionSchedule, rotation_coefficients

__all__ = ["MAX_CENTER_PX", "MAX_OMEGA_RAD_S", "RotationTrajectory"]

MAX_CENTER_PX = float(1 << 24)
"""Bound of a centre coordinate: predictions of any 16-bit pixel then fit an int64 with room to spare."""
MAX_OMEGA_RAD_S = 1e6
"""Bound of an angular velocity; no camera or rig comes near it, a wrong unit may."""

_FULL_TURN = 2.0 * np.pi


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RotationTrajectory:
    """Rotation ``(cx, cy, ω)`` at instants; linear in between, held beyond the first and the last (eq. 3.5).

    ``t_us`` int64[K], strictly increasing, K ≥ 1, ``|t| ≤ 2^60``; ``center_px`` float64[K, 2] within ±2^24 px;
    ``omega_rad_s`` float64[K] within ±1e6 rad/s, positive turns x towards y (y points down). ``source`` names the
    origin in reports: ``constant``, a file name, ``fit``. ``notes`` are remarks for the user. Raise ``ValueError``
    naming column, row and value when a check fails.
    """

    t_us: NDArray[np.int64]
    center_px: NDArray[np.float64]
    omega_rad_s: NDArray[np.float64]
    source: str = "constant"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        times = np.array(self.t_us)
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
        count = len(times)
        centers = _bounded("center_px", self.center_px, (count, 2), MAX_CENTER_PX)
        omegas = _bounded("omega_rad_s", self.omega_rad_s, (count,), MAX_OMEGA_RAD_S)
        for name, column in (("t_us", times), ("center_px", centers), ("omega_rad_s", omegas)):
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
        times = np.asarray(t_us, np.int64)
        columns = (self.center_px[:, 0], self.center_px[:, 1], self.omega_rad_s)
        if len(self) == 1:
            cx, cy, omega = (np.full(times.shape, column[0]) for column in columns)
            return cx, cy, omega
        left = np.clip(np.searchsorted(self.t_us, times, side="right") - 1, 0, len(self) - 2)
        # Differences are taken in int64: float64 would lose microseconds of times beyond 2^53.
        elapsed = (times - self.t_us[left]).astype(np.float64)
        share = elapsed / (self.t_us[left + 1] - self.t_us[left]).astype(np.float64)
        cx, cy, omega = (_mix(column[left], column[left + 1], share) for column in columns)
        return cx, cy, omega

    def predict(
        self, t_us: NDArray[np.int64], x: NDArray[np.uint16], y: NDArray[np.uint16], horizon_us: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where events are expected ``horizon_us`` later, int64[n] each; may lie outside (eq. 3.6).

        The float path: rotate in float64 by ``ω(t)·Δt`` about the centre at the event's own time, round with
        ``floor(v + 0.5)``. Any chunking of the events gives the same numbers.
        """
        cx, cy, omega = self.at(t_us)
        # NumPy's sine may treat a whole vector differently when one lane holds a huge angle; fmod, which leaves
        # angles below a full turn untouched, keeps every element independent of its neighbours.
        theta = np.fmod(omega * (horizon_us * 1e-6), _FULL_TURN)
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
        are clipped to it, because the parameters are held beyond it. A constant gives one entry.
        """
        if horizon_us < 0:
            raise ValueError(f"horizon_us must not be negative, not {horizon_us}")
        if step_us < 1:
            raise ValueError(f"step_us must be at least 1 µs, not {step_us}")
        first, last = int(self.t_us[0]), int(self.t_us[-1])
        start = first if start_us is None else min(max(int(start_us), first), last)
        stop = last if stop_us is None else min(max(int(stop_us), first), last)
        if stop < start:
            raise ValueError(f"stop_us must not lie before start_us: {stop_us} µs after {start_us} µs")
        times = np.arange(start, stop + 1, int(step_us), dtype=np.int64)
        if times[-1] != stop:
            times = np.append(times, np.int64(stop))
        cx, cy, omega = self.at(times)
        return MotionSchedule(times, rotation_coefficients(cx, cy, omega, horizon_us))

    def reversed(self) -> RotationTrajectory:
        """Return the same path turning the other way: the control −ω."""
        return replace(self, omega_rad_s=-self.omega_rad_s, source=f"{self.source}, reversed")

    def stopped(self) -> RotationTrajectory:
        """Return the same path at rest: the control ω = 0, which predicts "same place"."""
        return replace(self, omega_rad_s=np.zeros_like(self.omega_rad_s), source=f"{self.source}, stopped")

    def mean(self, *, start_us: int | None = None, stop_us: int | None = None) -> tuple[tuple[float, float], float]:
        """Return ``((cx, cy), ω)`` averaged over time from start to stop, by default the trajectory's own span."""
        start = int(self.t_us[0]) if start_us is None else int(start_us)
        stop = int(self.t_us[-1]) if stop_us is None else int(stop_us)
        if stop < start:
            raise ValueError(f"stop_us must not lie before start_us: {stop} µs after {start} µs")
        inner = self.t_us[(self.t_us > start) & (self.t_us < stop)]
        nodes = np.unique(np.concatenate([np.array([start, stop], np.int64), inner]))
        columns = self.at(nodes)
        if len(nodes) == 1:
            cx, cy, omega = (float(column[0]) for column in columns)
            return (cx, cy), omega
        weights = (nodes[1:] - nodes[:-1]).astype(np.float64)
        # The path is linear between nodes, so the trapezoid is exact.
        cx, cy, omega = (float(np.average(0.5 * (column[1:] + column[:-1]), weights=weights)) for column in columns)
        return (cx, cy), omega


def _mix(before: NDArray[np.float64], after: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolate, and hold the ends exactly where ``share`` leaves [0, 1]."""
    between = before + share * (after - before)
    mixed: NDArray[np.float64] = np.where(share <= 0.0, before, np.where(share >= 1.0, after, between))
    return mixed


def _bounded(name: str, values: ArrayLike, shape: tuple[int, ...], bound: float) -> NDArray[np.float64]:
    """Copy to float64, refusing another shape and numbers that are not finite or beyond ``±bound``."""
    given = np.asarray(values)
    if given.dtype.kind not in "fiu":
        raise ValueError(f"{name} must be numbers, not {given.dtype}")
    column = np.array(given, np.float64)
    if column.shape != shape:
        raise ValueError(f"{name} must be float64{list(shape)}, not of shape {column.shape}")
    # Written with "not", because a comparison with NaN is false.
    wrong = ~(np.abs(column) <= bound)
    if wrong.any():
        row = int(np.argwhere(wrong)[0, 0])
        raise ValueError(f"{name} must be finite and within ±{bound:g}: row {row} has {column[row]}")
    return column
