"""Describe the independent mover, a hand on its own path, and draw it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.check import check_number, check_point
from tiegocancel.scene.layout import FIT, FIT_POINT, MAX_SIZE_PX, Layout

__all__ = ["MOVER_SAMPLES_PX", "MoverConfig", "draw_mover"]

MOVER_SAMPLES_PX = 2.0

Image = NDArray[np.float64]

FINGERS = (
    ((0.05, -0.14), (0.50, -0.19), 0.060),  # the pointing finger
    ((0.06, -0.04), (0.24, -0.03), 0.068),
    ((0.05, 0.06), (0.22, 0.07), 0.066),
    ((0.03, 0.15), (0.16, 0.15), 0.056),
    ((-0.12, -0.20), (0.10, -0.31), 0.058),  # the thumb
    ((-0.10, -0.04), (0.02, 0.03), 0.185),  # the palm
    ((-0.36, 0.02), (-0.12, 0.00), 0.120),  # the wrist
)
"""Capsules of a hand that points along x: two ends and a radius, in lengths of the hand, its middle at (0, 0)."""

CUFF_FROM, CUFF_TO = -0.52, -0.27


@dataclass(frozen=True, kw_only=True, slots=True)
class MoverConfig:
    """Set a hand of ``size_px`` length whose middle runs along a circle at constant speed.

    The circle crosses the disc, so that the hand enters, crosses and leaves it again and again; a large radius makes
    the path straight. ``phase_rad`` is where on the circle it starts (0 = right, a quarter turn = below); a
    ``counterclockwise`` path turns y towards x. Lengths and speed that are not given fit the sensor: on 1280×720
    the hand measures 108 px and moves at 700 px/s.
    """

    enabled: bool = True
    size_px: float = FIT
    speed_px_s: float = FIT
    arc_center_px: tuple[float, float] = FIT_POINT
    arc_radius_px: float = FIT
    phase_rad: float = 2.3
    counterclockwise: bool = True
    reflectance: float = 0.50

    def __post_init__(self) -> None:
        check_point(self, "arc_center_px")
        check_number(self, "size_px", 0.0, MAX_SIZE_PX, above=True, fit=True)
        check_number(self, "arc_radius_px", 0.0, 1e6, above=True, fit=True)
        check_number(self, "speed_px_s", 0.0, 1e6, fit=True)
        check_number(self, "phase_rad", -1e6, 1e6)
        check_number(self, "reflectance", 0.01, 1.0)

    def fitted(self, layout: Layout) -> MoverConfig:
        """Return the mover with every length settled."""
        return replace(
            self,
            size_px=layout.length(self.size_px, 108.0),
            speed_px_s=layout.length(self.speed_px_s, 700.0),
            arc_center_px=layout.point(self.arc_center_px, (520.0, 345.0)),
            arc_radius_px=layout.length(self.arc_radius_px, 220.0),
        )

    def center_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the position of the hand's middle float64[n, 2] in px."""
        turn = self.speed_px_s / self.arc_radius_px * time_s
        angle = self.phase_rad + (-turn if self.counterclockwise else turn)
        path = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return np.asarray(self.arc_center_px) + self.arc_radius_px * path

    def angle_at(self, time_s: NDArray[np.float64]) -> None:
        """Tell that the hand stays upright."""


def draw_mover(config: MoverConfig) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return log-intensity and cover of the hand float32[rows, columns], its middle in the middle of both.

    Cover falls to 0 within a pixel of the outline and is 0 along the border.
    """
    half_width = math.ceil((0.62 * config.size_px + 3.0) * MOVER_SAMPLES_PX)
    half_height = math.ceil((0.45 * config.size_px + 3.0) * MOVER_SAMPLES_PX)
    x = np.arange(-half_width, half_width + 1)[None, :] / (MOVER_SAMPLES_PX * config.size_px)
    y = np.arange(-half_height, half_height + 1)[:, None] / (MOVER_SAMPLES_PX * config.size_px)
    hand = np.full((y.size, x.size), np.inf)
    for start, stop, radius in FINGERS:
        hand = _join(hand, _capsule(x, y, start, stop) - radius, 0.02)
    cuff = _box(x - 0.5 * (CUFF_FROM + CUFF_TO), y - 0.01, 0.5 * (CUFF_TO - CUFF_FROM), 0.155)
    outline = np.minimum(hand, cuff) * config.size_px
    edge = 1.0 / MOVER_SAMPLES_PX
    cover = np.clip(0.5 - outline / (2.0 * edge), 0.0, 1.0)
    shade = 1.0 - 0.12 * np.clip(-hand / 0.18, 0.0, 1.0)  # skin is darker away from the light at its outline
    for start, stop, radius in FINGERS[:4]:
        crease = np.abs(_capsule(x, y, start, stop) - radius) * config.size_px
        shade = shade * (1.0 - 0.22 * np.exp(-((crease / 1.6) ** 2)) * (x > -0.02))
    ribs = 0.5 + 0.5 * np.tanh(3.0 * np.sin(math.tau * x / 0.125))
    cloth = 0.75 + 0.35 * ribs + 0.0 * y
    reflectance = config.reflectance * np.where(cuff < 0.0, cloth, shade)
    return np.log(reflectance).astype(np.float32), cover.astype(np.float32)


def _capsule(x: Image, y: Image, start: tuple[float, float], stop: tuple[float, float]) -> Image:
    """Return the distance to a segment."""
    along_x, along_y = stop[0] - start[0], stop[1] - start[1]
    share = ((x - start[0]) * along_x + (y - start[1]) * along_y) / (along_x**2 + along_y**2)
    share = np.clip(share, 0.0, 1.0)
    distance: Image = np.hypot(x - start[0] - share * along_x, y - start[1] - share * along_y)
    return distance


def _box(x: Image, y: Image, half_width: float, half_height: float) -> Image:
    """Return the signed distance to an upright box."""
    away_x, away_y = np.abs(x) - half_width, np.abs(y) - half_height
    outside: Image = np.hypot(np.maximum(away_x, 0.0), np.maximum(away_y, 0.0))
    return outside + np.minimum(np.maximum(away_x, away_y), 0.0)


def _join(one: Image, other: Image, radius: float) -> Image:
    """Return the union of two distances with a fillet of about ``radius``."""
    blend = np.maximum(radius - np.abs(one - other), 0.0) / radius
    joined: Image = np.minimum(one, other) - 0.25 * radius * blend**2
    return joined
