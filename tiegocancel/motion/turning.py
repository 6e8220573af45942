"""Move the directions of a far scene as a turning camera sees them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["rotation_matrix", "turned"]

_FULL_TURN = 2.0 * np.pi


def rotation_matrix(vector_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations float64[n, 3, 3] about the vectors float64[n, 3] by their length (Rodrigues).

    ``1 − cos θ`` is taken as ``2 sin²(θ/2)``, so that small turns keep their digits; no turn gives the identity. Each
    element depends on itself alone.
    """
    x, y, z = vector_rad.T
    length = np.hypot(np.hypot(x, y), z)
    safe = np.where(length > 0.0, length, 1.0)
    x, y, z = x / safe, y / safe, z / safe
    # NumPy's sine may treat a whole vector differently when one lane holds a huge angle.
    theta = np.fmod(length, _FULL_TURN)
    sine, half = np.sin(theta), np.sin(0.5 * theta)
    rest = 2.0 * half * half
    matrix = np.empty((len(length), 3, 3))
    matrix[:, 0, 0], matrix[:, 1, 1], matrix[:, 2, 2] = (1.0 - rest * (1.0 - n * n) for n in (x, y, z))
    for row, column, axis, one, other in ((0, 1, z, x, y), (1, 2, x, y, z), (2, 0, y, z, x)):
        matrix[:, row, column] = rest * one * other - sine * axis
        matrix[:, column, row] = rest * one * other + sine * axis
    # Where the axis is not a unit vector, because there is no turn, sine and rest are zero: the identity.
    return matrix


def turned(
    matrix: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ``X/Z`` and ``Y/Z`` after the rotations float64[..., 3, 3]; NaN for what is no longer in front.

    Sums of three products, written out: a matrix product may round differently with the length of the chunk.
    """
    rows = [matrix[..., row, 0] * x + matrix[..., row, 1] * y + matrix[..., row, 2] for row in range(3)]
    depth = np.where(rows[2] > 0.0, rows[2], np.nan)
    return rows[0] / depth, rows[1] / depth
