"""Gather every setting of the scene that a turning camera sees."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from tiegocancel.events import MAX_SIDE_PX
from tiegocancel.scene.camera_motion import CameraMotionConfig
from tiegocancel.scene.check import check_number, check_point, check_whole
from tiegocancel.scene.gyro import GyroConfig
from tiegocancel.scene.layout import FIT, FIT_POINT, Layout
from tiegocancel.scene.mover import MoverConfig
from tiegocancel.scene.sensor import SensorConfig
from tiegocancel.scene.steps import BLOCK_SPAN_S, LONGEST_STEP_US, step_for
from tiegocancel.scene.wall import WallConfig

__all__ = ["CameraSceneConfig"]

MAX_FOCAL_PX = 2000.0
"""The wall is painted as finely as the lens shows it: beyond this it would take too much memory."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraSceneConfig:
    """Set sensor size, pinhole lens, motion, world, mover, pixel model and gyroscope.

    A pixel (x, y) looks along ((x − cx)/f, (y − cy)/f, 1) in the camera frame: x right, y down, z forward. Left open,
    ``focal_px`` is 600 px on a sensor 640 px wide, in proportion, and ``principal_px`` the middle of the pixels. The
    world is so far away that only turning matters. The mover crosses the image on a path of its own. ``step_px`` is
    the farthest that anything moves between two samples of the intensity. Raise ``ValueError`` for values out of range.
    """

    width: int = 640
    height: int = 480
    focal_px: float = FIT
    principal_px: tuple[float, float] = FIT_POINT
    motion: CameraMotionConfig = field(default_factory=CameraMotionConfig)
    wall: WallConfig = field(default_factory=WallConfig)
    mover: MoverConfig = field(default_factory=MoverConfig)
    sensor: SensorConfig = field(default_factory=SensorConfig)
    gyro: GyroConfig = field(default_factory=GyroConfig)
    step_px: float = 0.5

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            check_whole(self, name, 1, MAX_SIDE_PX)
        if self.width * self.height > 1 << 26:
            raise ValueError(f"the scene holds at most 2^26 pixels, not {self.width} × {self.height}")
        kinds = {
            "motion": CameraMotionConfig, "wall": WallConfig, "mover": MoverConfig, "sensor": SensorConfig,
            "gyro": GyroConfig,
        }  # fmt: skip
        for name, kind in kinds.items():
            if not isinstance(getattr(self, name), kind):
                raise TypeError(f"{name} must be a {kind.__name__}, not {type(getattr(self, name)).__name__}")
        check_number(self, "focal_px", 10.0, MAX_FOCAL_PX, fit=True)
        if math.isnan(self.focal_px):
            object.__setattr__(self, "focal_px", min(max(600.0 / 640.0 * self.width, 10.0), MAX_FOCAL_PX))
        check_point(self, "principal_px")
        if math.isnan(self.principal_px[0]):
            object.__setattr__(self, "principal_px", (0.5 * (self.width - 1), 0.5 * (self.height - 1)))
        object.__setattr__(self, "mover", self.mover.fitted(Layout(width=self.width, height=self.height)))
        check_number(self, "step_px", 0.05, 2.0)

    def step_us(self, start_s: float = 0.0) -> int:
        """Return the time between two samples in the block that begins at ``start_s``, short enough for ``step_px``.

        A point at the distance ρ from the principal point, in focal lengths, moves at no more than
        f·((1 + ρ²)·|Ωxy| + ρ·|Ωz|); ρ is that of the farthest corner.
        """
        corner_x = max(self.principal_px[0], self.width - 1 - self.principal_px[0])
        corner_y = max(self.principal_px[1], self.height - 1 - self.principal_px[1])
        away = math.hypot(corner_x, corner_y) / self.focal_px
        samples_s = start_s + np.linspace(0.0, BLOCK_SPAN_S, 1 + round(BLOCK_SPAN_S * 1e6 / LONGEST_STEP_US))
        omega = self.motion.omega_at(samples_s)
        across = np.hypot(omega[:, 0], omega[:, 1])
        speed_px_s = self.focal_px * float(np.max((1.0 + away**2) * across + away * np.abs(omega[:, 2])))
        return step_for(self.step_px, max(speed_px_s, self.mover.speed_px_s if self.mover.enabled else 0.0))
