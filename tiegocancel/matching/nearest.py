"""Find for each point the nearest of others that may be its partner: by a k-d tree, or by a uniform grid."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["Admissible", "SpatialIndex", "nearest_admissible", "within"]

SpatialIndex = Literal["tree", "grid"]

Admissible = Callable[[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]], NDArray[np.bool_]]
"""Tells which pairs (row of the asking points, row of the others, distance in px) may be partners, bool[m]."""

_SLACK = 1e-9
"""The gate is inclusive: a distance of 2 px lies within 2 px whatever the last bit of a square root says."""


def within(far: Any, reach_px: Any) -> Any:
    """Tell which distances, one or an array of them, lie within the gate, inclusive."""
    return far <= reach_px * (1.0 + _SLACK) + _SLACK


def nearest_admissible(
    asking: NDArray[np.float64],
    others: NDArray[np.float64],
    reach_px: float,
    admissible: Admissible,
    *,
    index: SpatialIndex = "tree",
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return for each of ``asking`` float64[n, 2] the row of its nearest partner in ``others`` float64[m, 2].

    int64[n], −1 where there is none within ``reach_px``, and its distance float64[n] in px, inf where there is none.
    Partners that ``admissible`` refuses are passed over, however near. Among equal distances the tree takes the one
    that its traversal meets first, the grid the first row.
    """
    if not len(asking) or not len(others):
        return np.full(len(asking), -1, np.int64), np.full(len(asking), np.inf)
    search = _by_tree if index == "tree" else _by_grid
    return search(asking, others, reach_px, admissible)


def _by_tree(
    asking: NDArray[np.float64], others: NDArray[np.float64], reach_px: float, admissible: Admissible
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Ask the tree for one neighbour, and for more of those alone whose neighbours were all refused."""
    from scipy.spatial import cKDTree

    # Sliding midpoints, not medians: the tree is asked once, so building it counts as much as balance.
    tree = cKDTree(others, balanced_tree=False, compact_nodes=False)
    found = np.full(len(asking), -1, np.int64)
    distance = np.full(len(asking), np.inf)
    pending = np.arange(len(asking))
    bound = reach_px * (1.0 + _SLACK) + _SLACK
    neighbours = 1
    while len(pending):
        wanted = min(neighbours, len(others))
        far, rows = tree.query(asking[pending], k=wanted, distance_upper_bound=bound)
        far, rows = far.reshape(len(pending), wanted), rows.reshape(len(pending), wanted).astype(np.int64)
        inside = rows < len(others)
        passed = np.zeros(rows.shape, np.bool_)
        at, column = np.nonzero(inside)
        passed[at, column] = admissible(pending[at], rows[at, column], far[at, column])
        first = passed.argmax(axis=1)
        some = passed.any(axis=1)
        chosen = np.flatnonzero(some)
        found[pending[chosen]] = rows[chosen, first[chosen]]
        distance[pending[chosen]] = far[chosen, first[chosen]]
        if wanted == len(others):
            break
        pending = pending[~some & inside[:, -1]]
        neighbours *= 4
    return found, distance


def _by_grid(
    asking: NDArray[np.float64], others: NDArray[np.float64], reach_px: float, admissible: Admissible
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """List every pair of neighbouring cells whose side is the reach, then take the nearest of each."""
    side = max(reach_px * (1.0 + _SLACK), 0.5)
    corner = np.minimum(asking.min(axis=0), others.min(axis=0))
    cell_of_other = np.floor((others - corner) / side).astype(np.int64) + 1
    cell_of_asking = np.floor((asking - corner) / side).astype(np.int64) + 1
    stride = int(max(cell_of_other[:, 0].max(), cell_of_asking[:, 0].max())) + 2
    key = cell_of_other[:, 1] * stride + cell_of_other[:, 0]
    order = np.argsort(key, kind="stable")
    key = key[order]
    pairs = [
        _expanded(key, cell_of_asking[:, 1] * stride + cell_of_asking[:, 0] + dy * stride - 1, 3) for dy in (-1, 0, 1)
    ]
    one = np.concatenate([pair[0] for pair in pairs])
    other = order[np.concatenate([pair[1] for pair in pairs])]
    far = np.hypot(asking[one, 0] - others[other, 0], asking[one, 1] - others[other, 1])
    near = within(far, reach_px)
    one, other, far = one[near], other[near], far[near]
    allowed = admissible(one, other, far)
    one, other, far = one[allowed], other[allowed], far[allowed]
    found = np.full(len(asking), -1, np.int64)
    distance = np.full(len(asking), np.inf)
    best = np.lexsort((other, far, one))
    rows, first = np.unique(one[best], return_index=True)
    found[rows], distance[rows] = other[best][first], far[best][first]
    return found, distance


def _expanded(key: NDArray[Any], low: NDArray[Any], width: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the pairs (row of ``low``, place in the sorted ``key``) with ``low ≤ key < low + width``."""
    first = np.searchsorted(key, low, side="left")
    count = np.searchsorted(key, low + width, side="left") - first
    rows = np.repeat(np.arange(len(low)), count)
    begins = np.cumsum(count) - count
    places = np.arange(len(rows)) - np.repeat(begins - first, count)
    return rows, places
