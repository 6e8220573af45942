"""Paint what the camera sees: the disc with its six pages, and the board behind it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.patterns import contour_lines, scattered_shapes
from tiegocancel.scene.rig import RigConfig

__all__ = ["DISC_SAMPLES_PX", "disc_cover", "paint_board", "paint_disc"]

DISC_SAMPLES_PX = 2.0

WOOD, TAPE, MARKER, HUB, BOARD, AXES = 0.70, 0.50, 0.46, 0.46, 0.36, 0.20
"""Reflectances of the parts that no setting changes."""

PAGE_SIDE = 0.49
PAGE_GAP = 0.018
"""Side of a page and the gap between two, in radii of the disc: two columns and three rows just fit."""

MARKER_ANGLES_RAD = (-0.62, 0.05, 0.58, 2.50, 3.22, 3.80)
"""Where the six dots sit, off any symmetry."""

Image = NDArray[np.float64]


def paint_disc(rig: RigConfig) -> NDArray[np.float32]:
    """Return the log-intensity on the disc at angle 0, float32[side, side], the disc's centre in the middle.

    The pages follow Fig. 6.2: shapes on the two at the top, contour lines on the other four, blue tape at the corners;
    the dots near the rim are the markers that the thesis's tracker followed.
    """
    half = math.ceil((rig.radius_px + 4.0) * DISC_SAMPLES_PX)
    x = np.arange(-half, half + 1)[None, :] / DISC_SAMPLES_PX
    y = np.arange(-half, half + 1)[:, None] / DISC_SAMPLES_PX
    radius = rig.radius_px
    rng = np.random.default_rng([rig.pattern_seed, 0])
    seen = WOOD * _grain(x, y, radius)
    side, pitch = PAGE_SIDE * radius, (PAGE_SIDE + PAGE_GAP) * radius
    places = [(column * pitch, row * pitch) for row in (-1, 0, 1) for column in (-0.5, 0.5)]
    for middle_x, middle_y in places:
        view, page_x, page_y = _patch(x, y, (middle_x, middle_y), rng.normal(0.0, 0.012), 0.75 * side)
        if middle_y < 0.0:
            ink = scattered_shapes(page_x, page_y, side_px=side, pitch_px=rig.shape_pitch_px, rng=rng)
        else:
            ink = contour_lines(page_x, page_y, side_px=side, period_px=rig.line_period_px, rng=rng)
        printed = rig.paper_reflectance + (rig.ink_reflectance - rig.paper_reflectance) * _fill(ink)
        page = np.maximum(np.abs(page_x), np.abs(page_y)) - 0.5 * side
        seen[view] += _fill(page) * (printed - seen[view])
    corners = ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))
    for middle_x, middle_y in places:
        for end_x, end_y in corners:
            place = (middle_x + end_x * side, middle_y + end_y * side)
            view, tape_x, tape_y = _patch(x, y, place, rng.uniform(0.0, 0.5), 0.06 * radius)
            tape = np.maximum(np.abs(tape_x) - 0.030 * radius, np.abs(tape_y) - 0.020 * radius)
            seen[view] += _fill(tape) * (TAPE - seen[view])
    for angle in MARKER_ANGLES_RAD:
        place = (0.80 * radius * math.cos(angle), 0.80 * radius * math.sin(angle))
        _dot(seen, x, y, place, 0.032 * radius, MARKER)
    _dot(seen, x, y, (0.0, 0.0), 0.022 * radius, HUB)
    return _develop(seen, rig.blur_px * DISC_SAMPLES_PX)


def paint_board(rig: RigConfig, width: int, height: int) -> NDArray[np.float32]:
    """Return the log-intensity of the board float32[height · width]: grey, unevenly lit, axes at the lower left."""
    x, y = np.arange(width)[None, :].astype(np.float64), np.arange(height)[:, None].astype(np.float64)
    radius = rig.radius_px
    away_x, away_y = x - rig.center_px[0], y - rig.center_px[1]
    seen = BOARD * (1.08 - 0.05 * np.hypot(away_x, away_y + radius) / radius)
    seen = np.maximum(seen, 0.2 * BOARD)
    origin_x, origin_y, length = away_x + 1.75 * radius, away_y - 0.62 * radius, 0.42 * radius
    thick = 0.011 * radius
    for along, across in ((origin_x, origin_y), (origin_y, origin_x)):
        line = np.maximum(np.abs(along - 0.5 * length) - 0.5 * length, np.abs(across) - thick)
        head = np.maximum(0.8 * (np.abs(across) + 0.55 * (along - 1.12 * length)), length - along)
        seen = seen + np.clip(0.5 - np.minimum(line, head), 0.0, 1.0) * (AXES - seen)
    return _develop(seen, rig.blur_px).reshape(-1)


def disc_cover(rig: RigConfig, width: int, height: int) -> NDArray[np.float32]:
    """Return the share of each pixel that the disc covers, float32[height · width]; the rim is a pixel wide."""
    x, y = np.arange(width)[None, :], np.arange(height)[:, None]
    distance = np.hypot(x - rig.center_px[0], y - rig.center_px[1])
    cover: NDArray[np.float32] = np.clip(rig.radius_px + 0.5 - distance, 0.0, 1.0).astype(np.float32).reshape(-1)
    return cover


def _patch(
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


def _dot(seen: Image, x: Image, y: Image, middle: tuple[float, float], radius_px: float, reflectance: float) -> None:
    """Stick a round dot on the disc."""
    view, away_x, away_y = _patch(x, y, middle, 0.0, radius_px)
    seen[view] += _fill(np.hypot(away_x, away_y) - radius_px) * (reflectance - seen[view])


def _fill(distance_px: Image) -> Image:
    """Turn signed distances in px into cover, one sample of the texture wide."""
    return np.clip(0.5 - distance_px * DISC_SAMPLES_PX, 0.0, 1.0)


def _grain(x: Image, y: Image, radius: float) -> Image:
    """Return the faint grain of the wood around 1."""
    bent = y + 0.06 * radius * np.sin(2.2 * x / radius)
    fine = np.sin(41.0 * bent / radius + 1.3 * np.sin(5.0 * x / radius))
    return 1.0 + 0.03 * fine + 0.02 * np.sin(97.0 * bent / radius + 2.0 * np.sin(3.0 * x / radius))


def _develop(seen: Image, blur: float) -> NDArray[np.float32]:
    """Blur with the lens's point spread of ``blur`` samples and take the logarithm."""
    from scipy.ndimage import gaussian_filter

    soft = gaussian_filter(seen, blur, mode="nearest") if blur > 0.0 else seen
    level: NDArray[np.float32] = np.log(soft).astype(np.float32)
    return level
