"""Hold the painted scene and render it at given times."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import EGO, NOISE
from tiegocancel.scene.config import SceneConfig
from tiegocancel.scene.mover import MOVER_SAMPLES_PX, draw_mover
from tiegocancel.scene.paint import DISC_SAMPLES_PX, disc_cover, paint_board, paint_disc

__all__ = ["Stage"]


class Stage:
    """Paint disc, board and mover once, then render the pixels that can change.

    ``label_clear`` uint8[size] is the label of an event that no mover causes: ego on the disc; elsewhere nothing moves,
    and what flickering light makes there counts as noise.
    """

    def __init__(self, config: SceneConfig) -> None:
        self.config = config
        self.board = paint_board(config.rig, config.width, config.height)
        self.disc = paint_disc(config.rig)
        self.cover = disc_cover(config.rig, config.width, config.height)
        self.label_clear = np.where(self.cover > 0.0, EGO, NOISE).astype(np.uint8)
        if config.mover.enabled:
            self.mover, self.mover_cover = draw_mover(config.mover)
        else:
            self.mover, self.mover_cover = np.zeros((1, 1), np.float32), np.zeros((1, 1), np.float32)
        rows, columns = self.mover.shape
        self._half_px = np.array([columns - 1, rows - 1]) / (2.0 * MOVER_SAMPLES_PX)

    def changing(self, time_s: NDArray[np.float64]) -> NDArray[np.int32]:
        """Return the pixels int32[n], rising, whose light can change between the first and the last time."""
        config = self.config
        if config.flicker_depth > 0.0:
            return np.arange(config.width * config.height, dtype=np.int32)
        changes = (self.cover > 0.0).reshape(config.height, config.width)
        if config.mover.enabled:
            centers = config.mover.center_at(time_s)
            low = np.floor(centers.min(axis=0) - self._half_px).astype(int)
            high = np.ceil(centers.max(axis=0) + self._half_px).astype(int) + 1
            columns = slice(max(low[0], 0), max(high[0], 0))
            changes[max(low[1], 0) : max(high[1], 0), columns] = True
        return np.flatnonzero(changes).astype(np.int32)

    def look(
        self, pixels: NDArray[np.int32], time_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return log-intensity float32[n, steps] and cover by the mover uint8[n, steps] of ``pixels`` at each time."""
        from tiegocancel.kernels.render import render

        config = self.config
        levels = np.empty((len(pixels), len(time_s)), np.float32)
        covered = np.empty((len(pixels), len(time_s)), np.uint8)
        angle = config.rig.angle_at(time_s)
        light = 1.0 + config.flicker_depth * np.sin(math.tau * config.flicker_hz * time_s)
        render(
            pixels,
            board=self.board,
            disc_cover=self.cover,
            disc=self.disc,
            mover=self.mover,
            mover_cover=self.mover_cover,
            turn=np.stack([np.cos(angle), np.sin(angle)], axis=-1).astype(np.float32),
            corner_px=(config.mover.center_at(time_s) - self._half_px).astype(np.float32),
            gain=np.log(light).astype(np.float32),
            width=config.width,
            center_px=config.rig.center_px,
            samples_px=(DISC_SAMPLES_PX, MOVER_SAMPLES_PX),
            levels=levels,
            covered=covered,
        )
        return levels, covered
