"""Fit one affine displacement to a displacement that is known at places of the sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["fit_displacement", "sensor_grid"]


def sensor_grid(width: int, height: int, points: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ``points`` × ``points`` places from the first to the last pixel, x and y float64[points²] in px."""
    x, y = np.meshgrid(np.linspace(0.0, width - 1.0, points), np.linspace(0.0, height - 1.0, points))
    return x.ravel(), y.ravel()


def fit_displacement(
    x: NDArray[np.float64], y: NDArray[np.float64], move_x: NDArray[np.float64], move_y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``a b c d e f`` float64[n, 6] of the least squares for moves float64[n, m] at places float64[m].

    All places weigh the same; those whose move is NaN are left out. Raise ``ValueError`` when fewer than three places,
    not on one line, remain. In closed form: the normal equations in coordinates centred and scaled to ±1.
    """
    middle_x, middle_y = 0.5 * (x.min() + x.max()), 0.5 * (y.min() + y.max())
    half_x, half_y = max(0.5 * np.ptp(x), 0.5), max(0.5 * np.ptp(y), 0.5)
    basis = np.stack([(x - middle_x) / half_x, (y - middle_y) / half_y, np.ones_like(x)], axis=-1)
    seen = ~(np.isnan(move_x) | np.isnan(move_y))
    used = np.where(seen[..., None], basis, 0.0)
    products = np.swapaxes(used, -1, -2) @ used
    moves = np.where(seen[..., None], np.stack([move_x, move_y], axis=-1), 0.0)
    sums = np.swapaxes(used, -1, -2) @ moves
    if not (np.linalg.eigvalsh(products)[..., 0] > 1e-9 * len(x)).all():
        raise ValueError("too little of the sensor stays in sight over the horizon for an affine fit")
    slope_u, slope_v, shift = np.moveaxis(np.linalg.solve(products, sums), -2, 0)
    slope_x, slope_y = slope_u / half_x, slope_v / half_y
    shift = shift - slope_x * middle_x - slope_y * middle_y
    rows = np.stack([slope_x, slope_y, shift], axis=-1)  # [n, (x, y), 3]
    return rows.reshape(-1, 6)
