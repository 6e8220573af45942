"""Simulate the gyroscope that is mounted on the turning camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.check import check_number, check_whole

if TYPE_CHECKING:
    from tiegocancel.scene.camera_config import CameraSceneConfig

__all__ = ["GyroConfig", "gyro_samples"]

GYRO_STREAM = 4
"""Second word of the random seed; the sensor's own streams come before it (see ``scene.sensor``)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GyroConfig:
    """Set rate, noise and word of a three-axis MEMS gyroscope whose axes are the camera's.

    The defaults are typical: InvenSense MPU-6050 (product specification PS-MPU-6000A-00 rev. 3.4, §6.1) states a range
    of ±2000 °/s in 16 bits, a noise density of 0.005 (°/s)/√Hz and a zero-rate output within ±20 °/s; the bias here is
    about 1 °/s an axis. ``noise_rad_s_rthz`` is one-sided and white: a sample deviates by it times √(``rate_hz``/2).
    Stamps are late by ``time_offset_us`` against the event clock, early where it is negative.
    """

    rate_hz: float = 1000.0
    noise_rad_s_rthz: float = math.radians(0.005)
    bias_rad_s: tuple[float, float, float] = (0.02, -0.015, 0.01)
    range_rad_s: float = math.radians(2000.0)
    bits: int = 16
    time_offset_us: int = 0

    def __post_init__(self) -> None:
        check_number(self, "rate_hz", 1.0, 1e5)
        check_number(self, "noise_rad_s_rthz", 0.0, 10.0)
        check_number(self, "range_rad_s", 0.0, 1e4, above=True)
        check_whole(self, "bits", 2, 32)
        check_whole(self, "time_offset_us", -(10**9), 10**9)
        bias = tuple(self.bias_rad_s) if isinstance(self.bias_rad_s, Sequence) else ()
        if len(bias) != 3 or not all(isinstance(v, (int, float)) and abs(v) <= 100.0 for v in bias):
            raise ValueError(f"bias_rad_s must be three numbers within ±100 rad/s, not {self.bias_rad_s!r}")
        object.__setattr__(self, "bias_rad_s", tuple(map(float, bias)))

    @property
    def step_rad_s(self) -> float:
        """Size of one count of the word."""
        return self.range_rad_s / float(1 << (self.bits - 1))


def gyro_samples(
    config: CameraSceneConfig, *, duration_s: float, seed: int = 0, start_us: int = 0
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return stamps int64[N] in µs and rates float64[N, 3] in rad/s about the camera's axes x right, y down, z forward.

    One sample at time 0 and one every 1/``rate_hz`` until ``duration_s`` inclusive: true rate, bias and noise, rounded
    to whole counts and cut at the range. A longer recording begins with the shorter one.
    """
    if not 0.0 <= duration_s <= 1e6:
        raise ValueError(f"duration_s must be from 0 to 1e6 s, not {duration_s!r}")
    gyro = config.gyro
    time_s = np.arange(math.floor(duration_s * gyro.rate_hz + 1e-6) + 1) / gyro.rate_hz
    rng = np.random.default_rng([seed, GYRO_STREAM])
    noise = gyro.noise_rad_s_rthz * math.sqrt(0.5 * gyro.rate_hz) * rng.standard_normal((len(time_s), 3))
    counts = np.rint((config.motion.omega_at(time_s) + np.asarray(gyro.bias_rad_s) + noise) / gyro.step_rad_s)
    most = float(1 << (gyro.bits - 1))
    rate_rad_s = np.clip(counts, -most, most - 1.0) * gyro.step_rad_s
    t_us = np.rint(time_s * 1e6).astype(np.int64) + (gyro.time_offset_us + start_us)
    return t_us, rate_rad_s
