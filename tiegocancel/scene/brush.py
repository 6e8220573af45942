"""Print on a texture: coordinates of a place, soft edges, the lens's blur."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["SAMPLES_PX", "develop", "fill", "patch"]

SAMPLES_PX = 2.0
"""Samples of a painted texture per px of the image."""

Image = NDArray[np.float64]


def patch(
    x: Image, y: Image, middle: tuple[float, float], lean_rad: float, reach_px: float
) -> tuple[tuple[slice, slice], Image, Image]:
    """Return the view of the texture near ``middle`` and its coordinates, leaning, in px from there."""
    rows, columns = (
        np.flatnonzero(np.abs(axis.reshape(-1) - place) <= reach_px + 2.0)
        for axis, place in ((y, middle[1]), (x, middle[0]))
    )
    view = (slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1))
    away_x, away_y = x[:, view[1]] - middle[0], y[view[0]] - middle[1]
    turned_x = math.cos(lean_rad) * away_x + math.sin(lean_rad) * away_y
    turned_y = math.cos(lean_rad) * away_y - math.sin(lean_rad) * away_x
    return view, turned_x, turned_y


def fill(distance_px: Image) -> Image:
    """Turn signed distances in px into cover, one sample of the texture wide."""
    return np.clip(0.5 - distance_px * SAMPLES_PX, 0.0, 1.0)


def develop(seen: Image, blur: float) -> NDArray[np.float32]:
    """Blur with the lens's point spread of ``blur`` samples and take the logarithm."""
    from scipy.ndimage import gaussian_filter

    soft = gaussian_filter(seen, blur, mode="nearest") if blur > 0.0 else seen
    level: NDArray[np.float32] = np.log(soft).astype(np.float32)
    return level
