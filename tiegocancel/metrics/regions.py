"""Divide the sensor into the disc, the background and rings about the centre of rotation."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events

__all__ = ["RING_PX", "DiscRegion", "estimate_radius_px"]

RING_PX = 8.0
"""Width of a ring of the radial profile."""


class DiscRegion:
    """Tell for each pixel whether it lies on the disc and in which ring of ``ring_px`` about the centre.

    ``center_px`` = (cx, cy); ``radius_px`` of the disc, inclusive. Areas count the pixels that the sensor has there.
    """

    def __init__(
        self, width: int, height: int, *, center_px: tuple[float, float], radius_px: float, ring_px: float = RING_PX
    ) -> None:
        if not (math.isfinite(radius_px) and radius_px >= 0):
            raise ValueError(f"radius_px must be a finite number of at least 0 px, not {radius_px!r}")
        self.width, self.height = width, height
        self.center_px, self.radius_px, self.ring_px = center_px, radius_px, ring_px
        right = np.arange(width, dtype=np.float64) - center_px[0]
        down = np.arange(height, dtype=np.float64) - center_px[1]
        nearest = math.floor(math.hypot(np.abs(right).min(), np.abs(down).min()) / ring_px)
        # One code a pixel: 2 · ring + (1 on the disc), so that a single look-up serves profile and regions.
        self._codes = np.empty(width * height, np.int32)
        for row in range(height):  # row by row, for the sake of memory
            radius = np.hypot(right, down[row])
            ring = (radius / ring_px).astype(np.int32) - nearest
            self._codes[row * width : (row + 1) * width] = 2 * ring + (radius <= radius_px)
        self.rings = int(self._codes.max() >> 1) + 1
        self.ring_edges_px: NDArray[np.float64] = (nearest + np.arange(self.rings + 1, dtype=np.float64)) * ring_px
        self.areas_px = np.bincount(self._codes, minlength=2 * self.rings).reshape(self.rings, 2)

    def codes(self, events: Events) -> NDArray[np.int32]:
        """Return ``2 · ring + on_disc`` for each event, int32[n]."""
        codes: NDArray[np.int32] = self._codes[events.y.astype(np.intp) * self.width + events.x]
        return codes


def estimate_radius_px(events: Events, center_px: tuple[float, float], *, ring_px: float = 4.0) -> tuple[float, bool]:
    """Guess the radius of the disc in px from the density of events; say whether an edge was seen.

    The radial density is split in two at the radius that explains most of its variance over the sensor's area: the
    edge of a turning disc is where the world goes quiet. Where the centre lies beyond the sensor, or no split
    explains half of the variance, the circle that holds 99 % of the events is returned instead.
    """
    whole = DiscRegion(events.width, events.height, center_px=center_px, radius_px=0.0, ring_px=ring_px)
    area = whole.areas_px.sum(axis=1).astype(np.float64)
    count = np.bincount(whole.codes(events) >> 1, minlength=whole.rings).astype(np.float64)
    inside = 0 <= center_px[0] < events.width and 0 <= center_px[1] < events.height
    area_in, count_in = np.cumsum(area)[:-1], np.cumsum(count)[:-1]
    area_out, count_out = area.sum() - area_in, count.sum() - count_in
    with np.errstate(divide="ignore", invalid="ignore"):
        drop = count_in / area_in - count_out / area_out
        explained = np.where((area_in > 0) & (area_out > 0) & (drop > 0), area_in * area_out * drop**2, 0.0)
    total = area.sum() * (area * (count / np.maximum(area, 1) - count.sum() / area.sum()) ** 2).sum()
    if inside and explained.size and explained.max() > 0.5 * total:
        return float(whole.ring_edges_px[int(np.argmax(explained)) + 1]), True
    holds = int(np.searchsorted(np.cumsum(count), 0.99 * count.sum(), side="left"))
    return float(whole.ring_edges_px[min(holds, whole.rings - 1) + 1]), False
