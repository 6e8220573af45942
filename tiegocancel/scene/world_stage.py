"""Hold the far world and render what the turning camera sees of it at given times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import EGO
from tiegocancel.scene.camera_config import CameraSceneConfig
from tiegocancel.scene.foreground import Foreground
from tiegocancel.scene.sprite import Sprite
from tiegocancel.scene.view import View
from tiegocancel.scene.wall import paint_wall

__all__ = ["WorldStage"]


class WorldStage:
    """Paint wall and mover once, then render the pixels that can change.

    ``label_clear`` uint8[size] is ego everywhere: without the mover, only the camera's turning makes events.
    """

    def __init__(self, config: CameraSceneConfig) -> None:
        self.config = config
        self.width, self.height, self.sensor = config.width, config.height, config.sensor
        self.wall = paint_wall(config.wall, config.focal_px)
        self.foreground = Foreground([Sprite(config.mover)], config.width, config.height)
        self.label_clear = np.full(config.width * config.height, EGO, np.uint8)

    def step_us(self, start_s: float) -> int:
        """Return the time between two samples in the block that begins at ``start_s``."""
        return self.config.step_us(start_s)

    def changing(self, time_s: NDArray[np.float64]) -> NDArray[np.int32]:
        """Return the pixels int32[n], rising, whose light can change: all, or the mover's while the camera rests."""
        attitude = self.config.motion.attitude_at(time_s)
        if (attitude != attitude[0]).any():
            return np.arange(self.width * self.height, dtype=np.int32)
        return np.flatnonzero(self.foreground.reached(time_s)).astype(np.int32)

    def look(self, pixels: NDArray[np.int32], time_s: NDArray[np.float64]) -> View:
        """Return what is seen on ``pixels`` at each time."""
        from tiegocancel.kernels.world import render_world

        levels = np.empty((len(pixels), len(time_s)), np.float32)
        render_world(
            pixels,
            wall=self.wall,
            attitude=self.config.motion.attitude_at(time_s).astype(np.float32),
            width=self.width,
            height=self.height,
            focal_px=self.config.focal_px,
            principal_px=self.config.principal_px,
            levels=levels,
        )
        return self.foreground.before(levels, pixels, time_s)
