"""Hold the painted disc scene and render it at given times."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import EGO, NOISE
from tiegocancel.scene.companion import Ride
from tiegocancel.scene.config import SceneConfig
from tiegocancel.scene.foreground import Foreground
from tiegocancel.scene.paint import DISC_SAMPLES_PX, disc_cover, paint_board, paint_disc
from tiegocancel.scene.sprite import Sprite
from tiegocancel.scene.view import View

__all__ = ["Stage"]


class Stage:
    """Paint disc, board and movers once, then render the pixels that can change.

    ``label_clear`` uint8[size] is the label of an event that no mover causes: ego wherever the disc ever comes;
    elsewhere nothing moves, and what flickering light makes there counts as noise.
    """

    def __init__(self, config: SceneConfig) -> None:
        self.config = config
        self.width, self.height, self.sensor = config.width, config.height, config.sensor
        self.board = paint_board(config.rig, config.width, config.height)
        self.disc = paint_disc(config.rig)
        self.cover = disc_cover(config.rig, config.width, config.height)
        self.label_clear = np.where(self.cover > 0.0, EGO, NOISE).astype(np.uint8)
        companion = Sprite(config.companion.hand, Ride(config.companion, config.rig))
        self.foreground = Foreground([companion, Sprite(config.mover)], config.width, config.height)

    def step_us(self, start_s: float) -> int:
        """Return the time between two samples in the block that begins at ``start_s``."""
        return self.config.step_us(start_s)

    def changing(self, time_s: NDArray[np.float64]) -> NDArray[np.int32]:
        """Return the pixels int32[n], rising, whose light can change between the first and the last time."""
        if self.config.flicker_depth > 0.0:
            return np.arange(self.width * self.height, dtype=np.int32)
        changes = (self.cover > 0.0).reshape(self.height, self.width)
        return np.flatnonzero(changes | self.foreground.reached(time_s)).astype(np.int32)

    def look(self, pixels: NDArray[np.int32], time_s: NDArray[np.float64]) -> View:
        """Return what is seen on ``pixels`` at each time."""
        from tiegocancel.kernels.render import render

        config, rig = self.config, self.config.rig
        levels = np.empty((len(pixels), len(time_s)), np.float32)
        angle = rig.angle_at(time_s)
        light = 1.0 + config.flicker_depth * np.sin(math.tau * config.flicker_hz * time_s)
        gain = np.log(light).astype(np.float32)
        render(
            pixels,
            board=self.board,
            disc_cover=self.cover,
            disc=self.disc,
            turn=np.stack([np.cos(angle), np.sin(angle)], axis=-1).astype(np.float32),
            center_px=rig.center_at(time_s).astype(np.float32) if rig.wobbles else rig.center_px,
            radius_px=rig.radius_px,
            gain=gain,
            width=config.width,
            samples_px=DISC_SAMPLES_PX,
            levels=levels,
        )
        return self.foreground.before(levels, pixels, time_s, gain)
