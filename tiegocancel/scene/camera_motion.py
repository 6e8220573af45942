"""Describe how the camera turns: a pan, tilt and roll head whose three axes swing smoothly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.check import check_number, check_whole
from tiegocancel.scene.clock import delayed_time, starting_pace

__all__ = ["CameraMotionConfig"]

Columns = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraMotionConfig:
    """Set the swing of each axis of the head; the camera frame is x right, y down, z forward.

    ``pan_rad_s`` (about y), ``tilt_rad_s`` (about x) and ``roll_rad_s`` (about z, innermost) bound the swinging part
    of each axis's rate: a sum of ``tones`` sines from ``slowest_hz`` to ``fastest_hz``, their amplitudes falling with
    the root of the frequency, their phases drawn by ``motion_seed``. The ``_drift_rad_s`` are constant and come on
    top. The camera rests for ``rest_s`` and then starts within ``start_s``.
    """

    pan_rad_s: float = 0.3
    tilt_rad_s: float = 0.25
    roll_rad_s: float = 1.0
    pan_drift_rad_s: float = 0.0
    tilt_drift_rad_s: float = 0.0
    roll_drift_rad_s: float = 0.0
    slowest_hz: float = 0.4
    fastest_hz: float = 3.0
    tones: int = 3
    motion_seed: int = 1
    rest_s: float = 0.0
    start_s: float = 0.1

    def __post_init__(self) -> None:
        for axis in ("pan", "tilt", "roll"):
            check_number(self, f"{axis}_rad_s", 0.0, 100.0)
            check_number(self, f"{axis}_drift_rad_s", -100.0, 100.0)
        check_number(self, "slowest_hz", 1e-3, 50.0)
        check_number(self, "fastest_hz", 1e-3, 50.0)
        if self.fastest_hz < self.slowest_hz:
            raise ValueError(f"fastest_hz {self.fastest_hz!r} must be at least slowest_hz {self.slowest_hz!r}")
        check_whole(self, "tones", 1, 16)
        check_whole(self, "motion_seed", 0, 2**32 - 1)
        check_number(self, "rest_s", 0.0, 1e6)
        check_number(self, "start_s", 1e-3, 1e3)

    def omega_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the camera's angular rates float64[n, 3] in rad/s about its own axes x, y, z, right-handed."""
        (_, tilt, roll), (pan_rate, tilt_rate, roll_rate) = self._head(time_s)
        level_y, level_z = pan_rate * np.cos(tilt), -pan_rate * np.sin(tilt)
        x = np.cos(roll) * tilt_rate + np.sin(roll) * level_y
        y = np.cos(roll) * level_y - np.sin(roll) * tilt_rate
        return np.stack([x, y, roll_rate + level_z], axis=-1)

    def attitude_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the matrices float64[n, 3, 3] that take camera directions to world directions; the unit at time 0.

        The product Ry(pan) · Rx(tilt) · Rz(roll), whose derivative is itself times the cross product with
        :meth:`omega_at`: exact, so that nothing accumulates.
        """
        pan, tilt, roll = self._head(time_s)[0]
        return np.asarray(_turn(1, pan) @ _turn(0, tilt) @ _turn(2, roll))

    def _head(self, time_s: NDArray[np.float64]) -> tuple[Columns, Columns]:
        """Return angles and rates of pan, tilt and roll, float64[3, n] each."""
        own_s = delayed_time(time_s, rest_s=self.rest_s, ramp_s=self.start_s) if self.rest_s > 0.0 else time_s
        pace = starting_pace(time_s, rest_s=self.rest_s, ramp_s=self.start_s) if self.rest_s > 0.0 else 1.0
        rng = np.random.default_rng(self.motion_seed)
        span = np.geomspace(self.slowest_hz, self.fastest_hz, self.tones)
        angles, rates = np.empty((3, len(time_s))), np.empty((3, len(time_s)))
        for row, axis in enumerate(("pan", "tilt", "roll")):
            # Three axes in step would turn about one fixed axis: the frequencies of each are drawn a little apart.
            omega = math.tau * np.clip(span * rng.uniform(0.85, 1.18, self.tones), self.slowest_hz, self.fastest_hz)
            phase = rng.uniform(0.0, math.tau, self.tones)
            weight = omega**-0.5 / np.sum(omega**-0.5) * getattr(self, f"{axis}_rad_s")
            drift = getattr(self, f"{axis}_drift_rad_s")
            swing = omega[:, None] * own_s + phase[:, None]
            angles[row] = drift * own_s + (weight / omega) @ (np.cos(phase)[:, None] - np.cos(swing))
            rates[row] = pace * (drift + weight @ np.sin(swing))
        return angles, rates


def _turn(axis: int, angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return right-handed turns about one axis, float64[n, 3, 3]."""
    turn = np.zeros((len(angle_rad), 3, 3))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn[:, axis, axis] = 1.0
    turn[:, first, first] = turn[:, second, second] = np.cos(angle_rad)
    turn[:, second, first] = np.sin(angle_rad)
    turn[:, first, second] = -np.sin(angle_rad)
    return turn
