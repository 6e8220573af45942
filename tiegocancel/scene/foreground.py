"""Hold the movers of a scene, the farthest first, and draw them before the background."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.mover import MOVER_SAMPLES_PX
from tiegocancel.scene.sprite import Sprite
from tiegocancel.scene.view import View

__all__ = ["Foreground"]


class Foreground:
    """Draw movers over one another on a sensor of ``width`` × ``height`` px."""

    def __init__(self, sprites: Sequence[Sprite], width: int, height: int) -> None:
        self.sprites = tuple(sprite for sprite in sprites if sprite.is_seen)
        self.width, self.height = width, height

    def reached(self, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return where any mover may be seen between the first and the last time, bool[height, width]."""
        reached = np.zeros((self.height, self.width), np.bool_)
        for sprite in self.sprites:
            reached[sprite.reaches(time_s, self.width, self.height)] = True
        return reached

    def before(
        self,
        levels: NDArray[np.float32],
        pixels: NDArray[np.int32],
        time_s: NDArray[np.float64],
        gain: NDArray[np.float32] | None = None,
    ) -> View:
        """Draw the movers into the background's ``levels`` float32[n, steps], in place, and return what is seen.

        ``gain`` float32[steps] is the logarithm of the light's strength where that changes; ``levels`` include it.
        """
        from tiegocancel.kernels.veil import veil

        light = np.zeros(len(time_s), np.float32) if gain is None else gain

        touched = self.reached(time_s).reshape(-1)[pixels]
        rows = np.flatnonzero(touched).astype(np.int32)
        veiled = np.full(len(pixels), -1, np.int32)
        veiled[rows] = np.arange(len(rows), dtype=np.int32)
        behind = levels[rows]
        clear = np.ones_like(behind)
        for sprite in self.sprites:
            veil(
                rows,
                pixels,
                mover=sprite.level,
                mover_cover=sprite.cover,
                corner_px=sprite.corner_px(time_s),
                turn=sprite.turn(time_s),
                gain=light,
                width=self.width,
                samples_px=MOVER_SAMPLES_PX,
                levels=levels,
                clear=clear,
            )
        return View(levels=levels, veiled=veiled, clear=clear, behind=behind)
