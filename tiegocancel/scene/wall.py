"""Describe and paint the far world: a cube of walls, each hung with printed pages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.brush import SAMPLES_PX, develop, fill, patch
from tiegocancel.scene.check import check_number, check_whole
from tiegocancel.scene.layout import MAX_SIZE_PX
from tiegocancel.scene.patterns import contour_lines, scattered_shapes

__all__ = ["WALL_SLOPE", "WallConfig", "paint_wall"]

WALL_SLOPE = 1.2
"""Slope at 0 of the map from the tangent u of the angle across a wall to its place m(u) = u·(1.2 − 0.2·u²) on the
painting. With it the painting is nearly equally fine over the wall: 1.2 of its half-sides a radian in the middle and
at the edge, 1.34 in between, where the tangent alone would go from 1 to 2."""

PLASTER = 0.48
PAGE_SHARE = 0.93
"""Reflectance of the bare wall, and the side of a page as a share of the pitch of the pages."""


@dataclass(frozen=True, kw_only=True, slots=True)
class WallConfig:
    """Set the print on the walls; lengths are px of the image where a wall is seen straight on.

    Pages hang ``page_pitch_px`` apart, by turns with contour lines ``line_period_px`` apart and with shapes
    ``shape_pitch_px`` apart. ``paper_reflectance`` and ``ink_reflectance`` are those of a middling page: each page has
    paper and ink of its own. ``blur_px`` is the deviation of the lens's point spread.
    """

    page_pitch_px: float = 140.0
    line_period_px: float = 21.0
    shape_pitch_px: float = 28.0
    paper_reflectance: float = 0.82
    ink_reflectance: float = 0.48
    blur_px: float = 0.8
    pattern_seed: int = 3

    def __post_init__(self) -> None:
        for name in ("page_pitch_px", "line_period_px", "shape_pitch_px"):
            check_number(self, name, 6.0, MAX_SIZE_PX)
        for name in ("paper_reflectance", "ink_reflectance"):
            check_number(self, name, 0.01, 1.0)
        check_number(self, "blur_px", 0.0, 20.0)
        check_whole(self, "pattern_seed", 0, 2**32 - 1)


def paint_wall(config: WallConfig, focal_px: float) -> NDArray[np.float32]:
    """Return the log-intensity of a wall that spans a quarter turn, float32[side, side], its middle in the middle.

    All six walls of the cube show this painting. Its border is bare, so that walls meet without a step.
    """
    half_px = focal_px / WALL_SLOPE
    half = max(round(half_px * SAMPLES_PX), 2)
    axis = np.linspace(-half_px, half_px, 2 * half + 1)
    x, y = axis[None, :], axis[:, None]
    seen = np.full((len(axis), len(axis)), PLASTER)
    rng = np.random.default_rng([config.pattern_seed, 1])
    count = max(1, round(2.0 * half_px / config.page_pitch_px))
    pitch = 2.0 * half_px / count
    side = PAGE_SHARE * pitch
    for row in range(count):
        for column in range(count):
            middle = ((column + 0.5) * pitch - half_px, (row + 0.5) * pitch - half_px)
            lean = rng.normal(0.0, 0.012)
            paper = config.paper_reflectance * rng.uniform(0.85, 1.1)
            ink = config.ink_reflectance / config.paper_reflectance * paper * rng.uniform(0.9, 1.1)
            view, page_x, page_y = patch(x, y, middle, lean, 0.5 * pitch)
            if (row + column) % 2:
                print_px = scattered_shapes(page_x, page_y, side_px=side, pitch_px=config.shape_pitch_px, rng=rng)
            else:
                print_px = contour_lines(page_x, page_y, side_px=side, period_px=config.line_period_px, rng=rng)
            page = np.maximum(np.abs(page_x), np.abs(page_y)) - 0.5 * side
            printed = paper + (ink - paper) * fill(print_px)
            seen[view] += fill(page) * (printed - seen[view])
    bare = max(1, round(0.006 * len(axis)), round(3.0 * config.blur_px * SAMPLES_PX))
    for edge in (seen[:bare], seen[-bare:], seen[:, :bare], seen[:, -bare:]):
        edge[...] = PLASTER
    return develop(seen, config.blur_px * SAMPLES_PX)
