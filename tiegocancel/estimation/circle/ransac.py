"""Fit one circle among points of which many lie on none: random draws, then refits (thesis §3.3.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.circle.fit import (
    Circle,
    CircleFit,
    CircleMethod,
    NoCircle,
    algebraic_circle,
    checked_points,
    described,
)

__all__ = ["RansacConfig", "fit_circle_among"]

_BATCH = 32
_SCORED_POINTS = 600
_REFITS = 12
_LARGEST_DRAWN = 10.0
"""Largest radius drawn, in units of the points' spread: the arc would be a tenth of a radian."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RansacConfig:
    """Look for the circle that most points lie on (RANSAC, Fischler and Bolles 1981).

    Points within ``tolerance_px`` of a circle through three of them support it. Circles are drawn until, at the share
    of support found, one drawn on supporters alone was among them with probability ``confidence``, at most
    ``max_draws``. A band wider than the tolerance (a broad marker) is taken whole: the tolerance of the last fits grows
    to three times the residual of the inliers, at most to ``widest_share`` of the radius.
    """

    tolerance_px: float = 4.0
    confidence: float = 0.999
    max_draws: int = 512
    widest_share: float = 0.3

    def __post_init__(self) -> None:
        for name, low, high in (("tolerance_px", 0.0, 1000.0), ("confidence", 0.0, 1.0), ("widest_share", 0.0, 1.0)):
            value = getattr(self, name)
            if not low < value < high:
                raise ValueError(f"{name} must lie in ({low:g}, {high:g}), not {value!r}")
        if not 1 <= self.max_draws <= 100_000:
            raise ValueError(f"max_draws must be from 1 to 100000, not {self.max_draws!r}")


def fit_circle_among(
    points_px: NDArray[np.float64],
    *,
    rng: np.random.Generator,
    method: CircleMethod = "taubin",
    config: RansacConfig | None = None,
) -> CircleFit | NoCircle:
    """Fit one circle to those of the points float64[n, 2] that lie near it; the rest are outliers.

    The circle with most support (see :class:`RansacConfig`) is refitted to its inliers until they no longer change.
    Works while the outliers lie on no common circle and are fewer than about half; the same points and generator give
    the same bits.
    """
    config = config or RansacConfig()
    points = checked_points(points_px, method)
    if len(points) < 3:
        return NoCircle(reason=f"{len(points)} points determine no circle")
    found = _drawn(points, config, rng)
    if isinstance(found, NoCircle):
        return found
    tolerance = config.tolerance_px
    inliers = np.zeros(len(points), np.bool_)
    for _ in range(_REFITS):
        residual = np.hypot(points[:, 0] - found[0], points[:, 1] - found[1]) - found[2]
        near = np.abs(residual) <= tolerance
        wider = 3.0 * float(np.sqrt(np.mean(residual[near] ** 2))) if near.any() else tolerance
        tolerance = max(min(wider, config.widest_share * found[2]), config.tolerance_px)
        near = np.abs(residual) <= tolerance
        if np.array_equal(near, inliers):
            break
        inliers = near
        refit = algebraic_circle(points[inliers], method)
        if isinstance(refit, NoCircle):
            return refit
        found = refit
    return described(points, inliers, found)


def _drawn(points: NDArray[np.float64], config: RansacConfig, rng: np.random.Generator) -> Circle | NoCircle:
    """Return the circle through three points that costs least, outliers at the square of the tolerance each."""
    spread = float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))
    scored = points[rng.choice(len(points), min(len(points), _SCORED_POINTS), replace=False)]
    best: Circle | None = None
    least, draws, needed = math.inf, 0, config.max_draws
    while draws < needed:
        first, second, third = (points[rng.integers(0, len(points), _BATCH)] for _ in range(3))
        draws += _BATCH
        ux, uy = (second - first).T
        vx, vy = (third - first).T
        across = 2.0 * (ux * vy - uy * vx)
        uu, vv = ux * ux + uy * uy, vx * vx + vy * vy
        with np.errstate(divide="ignore", invalid="ignore"):
            right, down = (vy * uu - uy * vv) / across, (ux * vv - vx * uu) / across
        radius = np.hypot(right, down)
        sound = np.flatnonzero(radius <= _LARGEST_DRAWN * spread)  # also leaves out NaN, from points on a line
        if not len(sound):
            continue
        cx, cy, radius = first[sound, 0] + right[sound], first[sound, 1] + down[sound], radius[sound]
        distance = np.hypot(scored[:, 0] - cx[:, None], scored[:, 1] - cy[:, None]) - radius[:, None]
        cost = np.minimum(distance**2, config.tolerance_px**2).sum(axis=1)
        row = int(np.argmin(cost))
        if cost[row] < least:
            least = float(cost[row])
            best = float(cx[row]), float(cy[row]), float(radius[row])
            share = float(np.mean(np.abs(distance[row]) <= config.tolerance_px))
            miss = math.log1p(-(min(share, 0.99) ** 3))
            needed = min(config.max_draws, math.ceil(math.log1p(-config.confidence) / miss))
    return best or NoCircle(reason="no three points lie on a circle")
