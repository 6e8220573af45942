"""Fit one circle to points algebraically (thesis §3.3.2, eq. 3.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Circle",
    "CircleFit",
    "CircleMethod",
    "NoCircle",
    "algebraic_circle",
    "arc_rad",
    "checked_points",
    "described",
    "fit_circle",
]

CircleMethod = Literal["pratt", "taubin"]
"""Which norm of the algebraic parameters is held at 1; both are all but unbiased on short arcs, unlike Kåsa's."""

Circle = tuple[float, float, float]
"""Centre ``cx, cy`` and radius in px."""

_LARGEST_RADIUS = 1000.0
"""Radius, in units of the points' spread, beyond which they are a line: the sagitta is then below 1/1000 of them."""
_ROUNDING = 1e-9
_ARC_BINS = 64
_ARC_FLOOR = 0.25


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CircleFit:
    """A circle and how well the points tell it.

    ``rms_px`` is the geometric residual of the inliers (eq. 3.3: root mean square of ``‖x − c‖ − r``), ``worst_px`` the
    largest; ``inliers`` bool[n] over the points given; ``covariance_px2`` float64[2, 2] of the centre to first order,
    taking the residuals of points as independent (events of one edge are not, so it is a lower bound), ∞ where three
    points leave nothing over; ``arc_rad`` is the part of the circle that the inliers span, 0 to 2π.
    """

    center_px: tuple[float, float]
    radius_px: float
    rms_px: float
    worst_px: float
    inliers: NDArray[np.bool_]
    covariance_px2: NDArray[np.float64]
    arc_rad: float

    @property
    def inlier_share(self) -> float:
        """Return the share of the points that are inliers."""
        return float(self.inliers.mean())

    @property
    def center_sigma_px(self) -> float:
        """Return the standard deviation of the centre in its worst direction."""
        if not np.isfinite(self.covariance_px2).all():
            return math.inf
        return math.sqrt(max(float(np.linalg.eigvalsh(self.covariance_px2)[-1]), 0.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class NoCircle:
    """The points determine no circle; ``reason`` says why in a few words."""

    reason: str


def fit_circle(points_px: NDArray[np.float64], *, method: CircleMethod = "taubin") -> CircleFit | NoCircle:
    """Fit one circle to all points float64[n, 2], finite.

    Minimise the residual of ``a(x² + y²) + bx + cy + d = 0`` under ``b² + c² − 4ad = 1`` (Pratt 1987) or with the
    mean squared gradient held at 1 (Taubin 1991), by singular values of the centred and scaled points (Chernov,
    *Circular and Linear Regression*, 2010, §5). Points that coincide or lie on a line give :class:`NoCircle`.
    """
    points = checked_points(points_px, method)
    return described(points, np.ones(len(points), np.bool_), algebraic_circle(points, method))


def arc_rad(bearings_rad: NDArray[np.float64]) -> float:
    """Return how much of the circle the bearings float64[n] in [−π, π] span: 2π less the widest gap, in steps of 2π/64.

    Parts with less than a quarter of an even share of the bearings count as empty: strays do not lengthen an arc.
    """
    bins = np.floor((bearings_rad + np.pi) * (_ARC_BINS / (2.0 * np.pi))).astype(np.int64) % _ARC_BINS
    counts = np.bincount(bins, minlength=_ARC_BINS)
    held = np.flatnonzero(counts > _ARC_FLOOR * len(bearings_rad) / _ARC_BINS)
    if not len(held):
        return 0.0
    widest_gap = int(np.diff(held, append=held[0] + _ARC_BINS).max()) - 1
    return (_ARC_BINS - widest_gap) * (2.0 * math.pi / _ARC_BINS)


def checked_points(points_px: NDArray[np.float64], method: CircleMethod) -> NDArray[np.float64]:
    """Return the points as float64[n, 2]; raise ``ValueError`` for another shape, NaN or an unknown method."""
    if method not in get_args(CircleMethod):
        raise ValueError(f"method must be pratt or taubin, not {method!r}")
    points = np.asarray(points_px, np.float64)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points_px must be float64[n, 2], not of shape {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError("points_px must be finite")
    return points


def algebraic_circle(points: NDArray[np.float64], method: CircleMethod) -> Circle | NoCircle:
    """Return ``(cx, cy, r)``; the centred points are scaled to a mean square of 1, so that no column dominates."""
    if len(points) < 3:
        return NoCircle(reason=f"{len(points)} points determine no circle")
    middle = points.mean(axis=0)
    scale = float(np.sqrt(np.mean(np.sum((points - middle) ** 2, axis=1))))
    if scale <= _ROUNDING * (1.0 + float(np.abs(middle).max())):
        return NoCircle(reason="all points coincide")
    x, y = ((points - middle) / scale).T
    square = x * x + y * y
    solve = _taubin if method == "taubin" else _pratt
    parameters = solve(x, y, square)
    if parameters is None:
        return NoCircle(reason="fewer than three distinct points")
    a, b, c, d = parameters
    gradient = math.sqrt(max(b * b + c * c - 4.0 * a * d, 0.0))
    if 2.0 * abs(a) * _LARGEST_RADIUS <= gradient:
        return NoCircle(reason="the points lie on a line")
    shift_x, shift_y = (-half / (2.0 * a) * scale for half in (b, c))
    return float(middle[0] + shift_x), float(middle[1] + shift_y), gradient / (2.0 * abs(a)) * scale


def _taubin(
    x: NDArray[np.float64], y: NDArray[np.float64], square: NDArray[np.float64]
) -> tuple[float, float, float, float] | None:
    # With d eliminated and a scaled by half the mean square (1 here), the constraint is a² + b² + c² = 1: the answer
    # is the last singular vector. R of a QR decomposition has the same one and is 3 × 3.
    columns = np.column_stack([0.5 * (square - 1.0), x, y])
    _, values, vectors = np.linalg.svd(np.linalg.qr(columns, mode="r"))
    if len(values) < 3 or values[1] <= _ROUNDING * values[0]:
        return None
    a, b, c = vectors[2].tolist()
    return 0.5 * a, b, c, -0.5 * a


def _pratt(
    x: NDArray[np.float64], y: NDArray[np.float64], square: NDArray[np.float64]
) -> tuple[float, float, float, float] | None:
    # The constraint b² + c² − 4ad is indefinite: in the basis of singular vectors it is a symmetric problem whose
    # smallest positive eigenvalue belongs to the answer.
    triangle = np.linalg.qr(np.column_stack([square, x, y, np.ones_like(x)]), mode="r")
    _, values, vectors = np.linalg.svd(triangle)
    if len(values) < 3 or values[2] <= _ROUNDING * values[0]:
        return None
    if len(values) < 4 or values[3] <= _ROUNDING * values[0]:
        a, b, c, d = vectors[3].tolist()  # every point lies on it
        return a, b, c, d
    root = (vectors.T * values) @ vectors
    inverse_norm = np.array([[0.0, 0, 0, -0.5], [0, 1, 0, 0], [0, 0, 1, 0], [-0.5, 0, 0, 0]])
    eigenvalues, eigenvectors = np.linalg.eigh(root @ inverse_norm @ root)
    smallest = int(np.flatnonzero(eigenvalues > 0.0)[0])
    a, b, c, d = np.linalg.solve(root, eigenvectors[:, smallest]).tolist()
    return a, b, c, d


def described(
    points: NDArray[np.float64], inliers: NDArray[np.bool_], circle: Circle | NoCircle
) -> CircleFit | NoCircle:
    """Add residual, covariance and arc of the inliers to a circle."""
    if isinstance(circle, NoCircle):
        return circle
    cx, cy, radius = circle
    right, down = (points[inliers] - (cx, cy)).T
    distance = np.hypot(right, down)
    residual = distance - radius
    squares = float(residual @ residual)
    count, safe = len(distance), np.maximum(distance, 1e-12)
    slopes = np.column_stack([-right / safe, -down / safe, -np.ones(count)])
    covariance = np.full((2, 2), math.inf)
    normal = slopes.T @ slopes
    if count > 3 and np.linalg.cond(normal) < 1e12:
        covariance = np.linalg.inv(normal)[:2, :2] * (squares / (count - 3))
    return CircleFit(
        center_px=(cx, cy),
        radius_px=radius,
        rms_px=math.sqrt(squares / count),
        worst_px=float(np.abs(residual).max()),
        inliers=inliers,
        covariance_px2=covariance,
        arc_rad=arc_rad(np.arctan2(down, right)),
    )
