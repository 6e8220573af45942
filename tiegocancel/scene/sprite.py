"""Hold a drawn mover and say where its picture lies at each time."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.mover import MOVER_SAMPLES_PX, MoverConfig, draw_mover

__all__ = ["Path", "Sprite"]


class Path(Protocol):
    """Where a picture goes."""

    def center_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the position of the picture's middle float64[n, 2] in px."""
        ...

    def angle_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Return by how much the picture is turned, float64[n] in rad, x towards y; ``None``: it stays upright."""
        ...


class Sprite:
    """Draw the hand once; one that is switched off is an empty picture. It goes along ``path``, by default its own.

    ``level`` float32[rows, columns] is its log-intensity, ``cover`` the share that it covers, 0 along the border.
    """

    def __init__(self, config: MoverConfig, path: Path | None = None) -> None:
        self.is_seen = config.enabled
        self.path: Path = config if path is None else path
        self.level, self.cover = np.zeros((1, 1), np.float32), np.zeros((1, 1), np.float32)
        if config.enabled:
            self.level, self.cover = draw_mover(config)
        rows, columns = self.level.shape
        self._half_px = np.array([columns - 1, rows - 1]) / (2.0 * MOVER_SAMPLES_PX)

    def corner_px(self, time_s: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return where the first sample of the upright picture lies, float32[n, 2], x and y."""
        return (self.path.center_at(time_s) - self._half_px).astype(np.float32)

    def turn(self, time_s: NDArray[np.float64]) -> NDArray[np.float32] | None:
        """Return cosine and sine of the picture's angle about its middle, float32[n, 2]; ``None``: it stays upright."""
        angle = self.path.angle_at(time_s)
        return None if angle is None else np.stack([np.cos(angle), np.sin(angle)], axis=-1).astype(np.float32)

    def reaches(self, time_s: NDArray[np.float64], width: int, height: int) -> tuple[slice, slice]:
        """Return the rows and columns of the sensor that the picture touches between the first and the last time."""
        if not self.is_seen:
            return slice(0, 0), slice(0, 0)
        centers = self.path.center_at(time_s)
        half_px = self._half_px if self.path.angle_at(time_s) is None else np.hypot(*self._half_px)
        low = np.clip(np.floor(centers.min(axis=0) - half_px), 0, (width, height)).astype(int)
        high = np.clip(np.ceil(centers.max(axis=0) + half_px) + 1, 0, (width, height)).astype(int)
        return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))
