"""Draw the two kinds of paper pattern: flowing contour lines and dense scattered shapes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["contour_lines", "scattered_shapes"]

Image = NDArray[np.float64]

STROKES = 3
"""Hills of one page of contour lines."""


def contour_lines(x: Image, y: Image, *, side_px: float, period_px: float, rng: np.random.Generator) -> Image:
    """Return signed distances in px to the ink of a page of concentric flowing lines, negative inside.

    ``x`` and ``y`` are px from the page's middle. The lines are level sets of a smooth minimum of distances to a few
    short strokes, so that they nest around each stroke and flow between them, ``period_px`` apart; a gentle warp
    brings them up to a fifth closer.
    """
    half = 0.5 * side_px
    bend = 0.05 * side_px
    flow = rng.uniform(0.0, math.tau, 2)
    warped_x = x + bend * np.sin(4.2 * y / half + flow[0])
    warped_y = y + bend * np.sin(3.6 * x / half + flow[1])
    total = np.zeros(np.broadcast(x, y).shape)
    softness = 0.04 * side_px
    first = rng.uniform(0.0, math.tau)
    for sector in range(STROKES):
        angle = first + math.tau * (sector + rng.uniform(-0.15, 0.15)) / STROKES
        reach = half * rng.uniform(0.45, 0.85)
        middle_x, middle_y = reach * math.cos(angle), reach * math.sin(angle)
        lean, length = rng.uniform(0.0, math.pi), half * rng.uniform(0.03, 0.25)
        along_x, along_y = math.cos(lean), math.sin(lean)
        share = np.clip((warped_x - middle_x) * along_x + (warped_y - middle_y) * along_y, -length, length)
        distance = np.hypot(warped_x - middle_x - share * along_x, warped_y - middle_y - share * along_y)
        total += np.exp(-distance / softness)
    height = -softness * np.log(np.maximum(total, 1e-300))
    phase = height / period_px + rng.uniform(0.0, 1.0)
    ink: Image = period_px * (np.abs(phase - np.floor(phase) - 0.5) - 0.25)
    return ink


def scattered_shapes(x: Image, y: Image, *, side_px: float, pitch_px: float, rng: np.random.Generator) -> Image:
    """Return signed distances in px to the ink of a page of random shapes, negative inside.

    One shape of random kind, angle and size sits near each point of a staggered lattice of ``pitch_px``.
    """
    kinds: tuple[Callable[[Image, Image, float], Image], ...] = (_ring, _disc, _star, _heart, _cross, _squiggle)
    ink = np.full(np.broadcast(x, y).shape, np.inf)
    rows = max(1, round(side_px / pitch_px))
    for row in range(rows):
        for column in range(rows + row % 2):
            middle_x = (column - 0.5 * (rows - 1 + row % 2) + rng.uniform(-0.12, 0.12)) * side_px / rows
            middle_y = (row - 0.5 * (rows - 1) + rng.uniform(-0.12, 0.12)) * side_px / rows
            angle, size = rng.uniform(0.0, math.tau), 0.38 * pitch_px * rng.uniform(0.85, 1.1)
            shape = kinds[int(rng.integers(len(kinds)))]
            away_x, away_y = x - middle_x, y - middle_y
            turned_x = math.cos(angle) * away_x + math.sin(angle) * away_y
            turned_y = math.cos(angle) * away_y - math.sin(angle) * away_x
            ink = np.minimum(ink, shape(turned_x, turned_y, size))
    return ink


def _disc(x: Image, y: Image, size: float) -> Image:
    """A filled circle."""
    distance: Image = np.hypot(x, y) - 0.75 * size
    return distance


def _ring(x: Image, y: Image, size: float) -> Image:
    """A drawn circle."""
    distance: Image = np.abs(np.hypot(x, y) - 0.78 * size) - 0.2 * size
    return distance


def _star(x: Image, y: Image, size: float) -> Image:
    """Five rounded rays; the distance is measured along the radius, close enough for a soft edge."""
    edge = size * (0.72 + 0.3 * np.cos(5.0 * np.arctan2(y, x)))
    distance: Image = 0.75 * (np.hypot(x, y) - edge)
    return distance


def _heart(x: Image, y: Image, size: float) -> Image:
    """Two round lobes over a point: a circle whose height follows the width."""
    across = np.abs(x) / size
    bent = y / size - 0.55 * np.sqrt(across + 0.02) + 0.2
    distance: Image = 0.8 * size * (np.hypot(across, 1.15 * bent) - 0.78)
    return distance


def _cross(x: Image, y: Image, size: float) -> Image:
    """Two bars at right angles."""
    width, length = 0.24 * size, 0.95 * size
    upright = np.maximum(np.abs(x) - width, np.abs(y) - length)
    level = np.maximum(np.abs(y) - width, np.abs(x) - length)
    return np.minimum(upright, level)


def _squiggle(x: Image, y: Image, size: float) -> Image:
    """A short wave."""
    line = 0.38 * size * np.sin(1.6 * math.pi * x / size)
    distance: Image = np.maximum(0.62 * np.abs(y - line) - 0.16 * size, np.abs(x) - size)
    return distance
