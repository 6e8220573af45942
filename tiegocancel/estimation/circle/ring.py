"""Follow the circle on which a marker runs, smoothed over successive fits (thesis §3.6, step 2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.circle.fit import CircleFit

__all__ = ["Ring"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ring:
    """The circle in use: centre and radius smoothed, half the width of its band, the time of its last fit.

    ``sigma_px`` is the deviation of the centre of the last fit, ``mean_sigma_px`` that of the smoothed one if fits
    were independent; it only weighs what follows.
    """

    center_px: tuple[float, float]
    radius_px: float
    reach_px: float
    sigma_px: float
    mean_sigma_px: float
    fitted_us: int

    @classmethod
    def of(cls, fit: CircleFit, t_us: int, *, least_reach_px: float) -> Ring:
        """Return the circle of a fit, with a band of three times its residual."""
        return cls(
            center_px=fit.center_px,
            radius_px=fit.radius_px,
            reach_px=max(3.0 * fit.rms_px, least_reach_px),
            sigma_px=fit.center_sigma_px,
            mean_sigma_px=fit.center_sigma_px,
            fitted_us=t_us,
        )

    def followed_by(self, ring: Ring, share: float) -> Ring:
        """Return the next circle, moved from this one by ``share`` of the way, an exponential low-pass.

        While this one is known worse than that, from a short arc or few fits, it moves further: by the share that the
        variances give it. A step wider than the band is another place, not noise, and is taken whole.
        """
        step_px = math.dist(self.center_px, ring.center_px) + abs(ring.radius_px - self.radius_px)
        if step_px > ring.reach_px:
            return ring
        known = self.mean_sigma_px**2 + ring.sigma_px**2
        if math.isfinite(known) and known > 0.0:
            share = max(share, self.mean_sigma_px**2 / known)
        (x, y), (to_x, to_y) = self.center_px, ring.center_px
        return Ring(
            center_px=(x + share * (to_x - x), y + share * (to_y - y)),
            radius_px=self.radius_px + share * (ring.radius_px - self.radius_px),
            reach_px=ring.reach_px,
            sigma_px=ring.sigma_px,
            mean_sigma_px=math.hypot((1.0 - share) * self.mean_sigma_px, share * ring.sigma_px),
            fitted_us=ring.fitted_us,
        )

    def near(self, points: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """Return which of the points float64[n, 2] lie in the band, bool[n], and the bearings of those in rad."""
        right, down = points[:, 0] - self.center_px[0], points[:, 1] - self.center_px[1]
        near: NDArray[np.bool_] = np.abs(np.hypot(right, down) - self.radius_px) <= self.reach_px
        return near, np.arctan2(down[near], right[near])

    def beside(self, points: NDArray[np.float64]) -> float:
        """Return how many of the points float64[n, 2] lie within a band's width of the band, over those inside it.

        Near 0 for a rim or marker, about 1 for a texture that fills the plane.
        """
        away = np.abs(np.hypot(points[:, 0] - self.center_px[0], points[:, 1] - self.center_px[1]) - self.radius_px)
        inside, around = (int(np.count_nonzero(away <= reach)) for reach in (self.reach_px, 2.0 * self.reach_px))
        return (around - inside) / max(inside, 1)
