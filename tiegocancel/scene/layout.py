"""Fit the thesis's picture, 1280×720, to a sensor of any size."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["FIT", "FIT_POINT", "MAX_SIZE_PX", "Layout"]

FIT = math.nan
"""Value of a length that is to be fitted to the sensor."""

FIT_POINT = (FIT, FIT)

MAX_SIZE_PX = 4096.0
"""Largest radius or length that is painted: beyond it the painting would not fit in memory."""

REFERENCE_WIDTH_PX, REFERENCE_HEIGHT_PX = 1280, 720

SMALLEST_DETAIL = 0.6
"""Print is scaled down no further than this: finer lines would vanish in the lens's blur."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Layout:
    """Map lengths and points of the reference picture to a sensor, its middle on the sensor's middle."""

    width: int
    height: int

    @property
    def scale(self) -> float:
        """Ratio of lengths: the largest at which the reference picture still fits."""
        return min(self.width / REFERENCE_WIDTH_PX, self.height / REFERENCE_HEIGHT_PX)

    def length(self, given: float, reference: float) -> float:
        """Return the given length, or the scaled reference where there is none."""
        return reference * self.scale if math.isnan(given) else given

    def detail(self, given: float, reference: float) -> float:
        """Return the given length of print, or the reference scaled down in bounds."""
        return reference * max(self.scale, SMALLEST_DETAIL) if math.isnan(given) else given

    def point(self, given: tuple[float, float], reference: tuple[float, float]) -> tuple[float, float]:
        """Return the given point, or the reference where it is seen relative to the middle of the image."""
        if not math.isnan(given[0]):
            return given
        x = (reference[0] - REFERENCE_WIDTH_PX / 2) * self.scale + self.width / 2
        return x, (reference[1] - REFERENCE_HEIGHT_PX / 2) * self.scale + self.height / 2
