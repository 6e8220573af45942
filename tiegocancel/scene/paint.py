"""Paint what the camera sees: the disc with its six pages, and the board behind it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.brush import SAMPLES_PX, develop, fill, patch
from tiegocancel.scene.patterns import contour_lines, scattered_shapes
from tiegocancel.scene.rig import RigConfig

__all__ = ["DISC_SAMPLES_PX", "disc_cover", "paint_board", "paint_disc"]

DISC_SAMPLES_PX = SAMPLES_PX

WOOD, TAPE, MARKER, HUB, BOARD, AXES = 0.70, 0.50, 0.46, 0.46, 0.36, 0.20
"""Reflectances of the parts that no setting changes."""

WOBBLE_SAMPLES = 64

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
    if rig.pages:
        _stick_pages(seen, x, y, rig, rng)
    for angle in MARKER_ANGLES_RAD:
        place = (0.80 * radius * math.cos(angle), 0.80 * radius * math.sin(angle))
        _dot(seen, x, y, place, 0.032 * radius, MARKER)
    _dot(seen, x, y, (0.0, 0.0), 0.022 * radius, HUB)
    return develop(seen, rig.blur_px * DISC_SAMPLES_PX)


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
    return develop(seen, rig.blur_px).reshape(-1)


def disc_cover(rig: RigConfig, width: int, height: int) -> NDArray[np.float32]:
    """Return the largest share of each pixel that the disc ever covers, float32[height · width].

    The rim is a pixel wide. Of a disc that wobbles it is a bound: the middle's ellipse is sampled, and the disc about
    each sample is larger by half the way to the next one.
    """
    x, y = np.arange(width)[None, :], np.arange(height)[:, None]
    if rig.wobbles:
        phase = math.tau * np.arange(WOBBLE_SAMPLES) / WOBBLE_SAMPLES
        middles = np.asarray(rig.center_px) + np.asarray(rig.wobble_px) * np.stack([np.cos(phase), np.sin(phase)], -1)
        spare = 0.5 * math.tau * max(rig.wobble_px) / WOBBLE_SAMPLES
    else:
        middles, spare = np.asarray([rig.center_px]), 0.0
    distance = np.full((height, width), np.inf)
    for middle_x, middle_y in middles:
        np.minimum(distance, np.hypot(x - middle_x, y - middle_y), out=distance)
    reach = rig.radius_px + 0.5 + spare
    cover: NDArray[np.float32] = np.clip(reach - distance, 0.0, 1.0).astype(np.float32).reshape(-1)
    return cover


def _stick_pages(seen: Image, x: Image, y: Image, rig: RigConfig, rng: np.random.Generator) -> None:
    """Stick the six pages on the disc and tape their corners."""
    radius = rig.radius_px
    side, pitch = PAGE_SIDE * radius, (PAGE_SIDE + PAGE_GAP) * radius
    places = [(column * pitch, row * pitch) for row in (-1, 0, 1) for column in (-0.5, 0.5)]
    for middle_x, middle_y in places:
        view, page_x, page_y = patch(x, y, (middle_x, middle_y), rng.normal(0.0, 0.012), 0.75 * side)
        if middle_y < 0.0:
            ink = scattered_shapes(page_x, page_y, side_px=side, pitch_px=rig.shape_pitch_px, rng=rng)
        else:
            ink = contour_lines(page_x, page_y, side_px=side, period_px=rig.line_period_px, rng=rng)
        printed = rig.paper_reflectance + (rig.ink_reflectance - rig.paper_reflectance) * fill(ink)
        page = np.maximum(np.abs(page_x), np.abs(page_y)) - 0.5 * side
        seen[view] += fill(page) * (printed - seen[view])
    corners = ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))
    for middle_x, middle_y in places:
        for end_x, end_y in corners:
            place = (middle_x + end_x * side, middle_y + end_y * side)
            view, tape_x, tape_y = patch(x, y, place, rng.uniform(0.0, 0.5), 0.06 * radius)
            tape = np.maximum(np.abs(tape_x) - 0.030 * radius, np.abs(tape_y) - 0.020 * radius)
            seen[view] += fill(tape) * (TAPE - seen[view])


def _dot(seen: Image, x: Image, y: Image, middle: tuple[float, float], radius_px: float, reflectance: float) -> None:
    """Stick a round dot on the disc."""
    view, away_x, away_y = patch(x, y, middle, 0.0, radius_px)
    seen[view] += fill(np.hypot(away_x, away_y) - radius_px) * (reflectance - seen[view])


def _grain(x: Image, y: Image, radius: float) -> Image:
    """Return the faint grain of the wood around 1."""
    bent = y + 0.06 * radius * np.sin(2.2 * x / radius)
    fine = np.sin(41.0 * bent / radius + 1.3 * np.sin(5.0 * x / radius))
    return 1.0 + 0.03 * fine + 0.02 * np.sin(97.0 * bent / radius + 2.0 * np.sin(3.0 * x / radius))
