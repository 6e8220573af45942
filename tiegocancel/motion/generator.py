"""Turn an affine velocity field into the displacement over a horizon: the matrix exponential, in closed algebra."""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import NDArray

__all__ = ["MAX_GROWTH", "displacement", "fixed_point_of", "inverse", "rates_of_displacement"]

MAX_GROWTH = 32.0
"""An image may grow by e^32 within a horizon; beyond that a rate has the wrong unit."""

# φ(z) = Σ z^k / (k+1)! is cut where the next term is below 2^-53 for |z| ≤ 1/2.
_TERMS = [1.0 / factorial(k + 1) for k in range(15)]
_SINGULAR = 1e-12


def displacement(rates: NDArray[np.float64], horizon_s: float) -> NDArray[np.float64]:
    """Return ``a b c d e f`` float64[..., 6] (1 and px) of the map over ``horizon_s`` seconds, less the identity.

    ``rates`` float64[..., 6] are those of the field ``v_x = a·x + b·y + c``, ``v_y = d·x + e·y + f`` in 1/s and px/s.
    With ``G = [[a, b], [d, e]]·Δt``, ``u = (c, f)·Δt`` and ``φ(G) = Σ G^k / (k+1)!`` (the mean of ``exp(τG)`` over τ
    from 0 to 1), a point moves by ``G·φ(G)·p + φ(G)·u``. Written so, nothing is divided by G: pan alone, a rotation by
    no angle and a shear with one direction at rest are ordinary cases. Each element depends on itself alone, and only
    sums and products are used, so any chunking gives the same bits. Raise ``ValueError`` when the image would grow by
    more than ``e^MAX_GROWTH``.
    """
    a, b, c, d, e, f = np.moveaxis(rates * horizon_s, -1, 0)
    # G = mean·I + N with N = [[skew, b], [d, −skew]] and N² = square·I. Every power of G is then α·I + β·N: a pair of
    # numbers that multiply like complex (square < 0), dual (= 0) or split-complex ones (> 0), all in one formula.
    mean, skew = 0.5 * (a + e), 0.5 * (a - e)
    square = skew * skew + b * d
    growth = mean + np.sqrt(np.maximum(square, 0.0))
    if growth.size and not float(growth.max()) <= MAX_GROWTH:
        raise ValueError(f"the image grows by e^{float(growth.max()):.3g} within {horizon_s:g} s: rates too large")
    alpha, beta = _phi(mean, square)
    turn_i, turn_n = mean * alpha + square * beta, mean * beta + alpha  # G·φ(G)
    return np.stack(
        [
            turn_i + turn_n * skew,
            turn_n * b,
            (alpha + beta * skew) * c + beta * b * f,
            turn_n * d,
            turn_i - turn_n * skew,
            beta * d * c + (alpha - beta * skew) * f,
        ],
        axis=-1,
    )


def _phi(mean: NDArray[np.float64], square: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return α and β of ``φ(mean + N) = α + β·N`` with ``N² = square``, by Taylor and doubling."""
    size = np.abs(mean) + np.sqrt(np.abs(square))
    doublings = np.maximum(np.frexp(size)[1] + 1, 0)
    mean, square = np.ldexp(mean, -doublings), np.ldexp(square, -2 * doublings)
    alpha, beta = np.full(mean.shape, _TERMS[-1]), np.zeros(mean.shape)
    for term in _TERMS[-2::-1]:
        alpha, beta = term + (mean * alpha + square * beta), mean * beta + alpha
    for done in range(int(doublings.max(initial=0))):
        # φ(2z) = φ(z)·(1 + z·φ(z)/2); with 2N in place of N, β halves.
        half_i, half_n = 1.0 + 0.5 * (mean * alpha + square * beta), 0.5 * (mean * beta + alpha)
        more = doublings > done
        alpha, beta = (
            np.where(more, alpha * half_i + square * (beta * half_n), alpha),
            np.where(more, 0.5 * (alpha * half_n + beta * half_i), beta),
        )
        mean, square = np.where(more, 2.0 * mean, mean), np.where(more, 4.0 * square, square)
    return alpha, beta


def fixed_point_of(rates: NDArray[np.float64], bound_px: float) -> tuple[float, float] | None:
    """Return the point ``(x, y)`` in px that rests in the field ``rates`` float64[6], ``None`` without one near.

    Near is within ``±bound_px``; a field that is singular but for rounding has none either.
    """
    a, b, c, d, e, f = (float(rate) for rate in rates)
    determinant = a * e - b * d
    if not abs(determinant) > _SINGULAR * (a * a + b * b + d * d + e * e):
        return None
    x, y = (b * f - e * c) / determinant, (d * c - a * f) / determinant
    return (x, y) if abs(x) <= bound_px and abs(y) <= bound_px else None


def inverse(displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``a b c d e f`` float64[..., 6] of the inverse of a map, both less the identity.

    Raise ``ValueError`` where the map folds the image flat.
    """
    a, b, c, d, e, f = np.moveaxis(displacement, -1, 0)
    a, e = a + 1.0, e + 1.0
    area = a * e - b * d
    if not (np.abs(area) > _SINGULAR).all():
        raise ValueError("a displacement that folds the image flat has no inverse")
    return np.stack(
        [e / area - 1.0, -b / area, (b * f - e * c) / area, -d / area, a / area - 1.0, (d * c - a * f) / area], axis=-1
    )


def rates_of_displacement(displacement: NDArray[np.float64], horizon_s: float) -> NDArray[np.float64]:
    """Return the rates float64[..., 6] whose map over ``horizon_s`` is the given one: the matrix logarithm.

    The inverse of :func:`displacement` for maps that turn by less than half a turn and scale by less than tenfold,
    to about 1e-9 of the rates.
    """
    map_ = np.zeros((*displacement.shape[:-1], 3, 3))
    map_[..., :2, :] = displacement.reshape(*displacement.shape[:-1], 2, 3)
    map_ += np.eye(3)
    halvings = 0
    # Square roots by Denman and Beavers bring the map near the identity, where log M = 2·artanh((M − I)(M + I)⁻¹).
    while halvings < 8 and float(np.abs(map_[..., :2, :2] - np.eye(2)).max(initial=0.0)) > 0.2:
        map_ = _root(map_)
        halvings += 1
    near = (map_ - np.eye(3)) @ np.linalg.inv(map_ + np.eye(3))
    square, power, total = near @ near, near, np.zeros_like(near)
    for odd in range(1, 20, 2):
        total += 2.0 * power / odd
        power = power @ square
    rates: NDArray[np.float64] = total[..., :2, :].reshape(displacement.shape) * (2.0**halvings / horizon_s)
    return rates


def _root(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the principal square root of matrices [..., 3, 3]."""
    root, other = matrix, np.broadcast_to(np.eye(3), matrix.shape)
    for _ in range(20):
        root, other = 0.5 * (root + np.linalg.inv(other)), 0.5 * (other + np.linalg.inv(root))
    return root
