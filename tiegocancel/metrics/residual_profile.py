"""Follow by radius on which side of their predictions events are met (thesis, §3.6 (5))."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiegocancel.metrics.ledger import Matches

__all__ = ["ResidualProfile"]

_UNITS_A_PX = float(1 << 20)
_COUNT, _TANGENTIAL, _RADIAL, _TANGENTIAL_SQUARE, _RADIAL_SQUARE, _RIGHT, _DOWN = range(7)


class ResidualProfile:
    """Sum the offsets of matches, event minus prediction, in rings about the centre, in constant memory.

    ``center_px`` = (cx, cy); ``ring_edges_px`` float64[rings + 1], increasing, from 0 px or more; a prediction lies in
    ring k when ``edges[k] ≤ r < edges[k+1]``, and those beyond the edges are left out. Tangential offsets are positive
    as x turns towards y, radial ones outward; a prediction at the very centre has neither. The spatial gate cuts
    offsets off and chance matches pull them to 0, so a bias stands in them too small: they show its shape, and
    :func:`tiegocancel.estimation.diagnosis.diagnose.diagnose_rotation` its size. Raise ``ValueError`` for edges that do
    not increase.
    """

    def __init__(self, center_px: tuple[float, float], ring_edges_px: ArrayLike, counted_from_us: int) -> None:
        edges = np.array(ring_edges_px, np.float64)
        if edges.ndim != 1 or len(edges) < 2 or not (edges[0] >= 0.0 and (np.diff(edges) > 0.0).all()):
            raise ValueError(f"ring_edges_px must increase from 0 px or more, two at least, not {edges.tolist()}")
        self.center_px, self.ring_edges_px, self.counted_from_us = center_px, edges, counted_from_us
        self._whole: NDArray[np.int64] = np.zeros((7, len(edges) - 1), np.int64)

    def add(self, matches: Matches) -> None:
        """Sum the matches of one chunk, warm-up left out."""
        right, down = matches.ahead_x - self.center_px[0], matches.ahead_y - self.center_px[1]
        radius = np.hypot(right, down)
        ring = np.searchsorted(self.ring_edges_px, radius, side="right") - 1
        counted = (matches.t_us >= self.counted_from_us) & (ring >= 0) & (ring < self._whole.shape[1])
        ring, unit = ring[counted], np.maximum(radius[counted], 1e-9)
        right, down = right[counted] / unit, down[counted] / unit
        dx, dy = matches.dx[counted].astype(np.float64), matches.dy[counted].astype(np.float64)
        tangential, radial = right * dy - down * dx, right * dx + down * dy
        columns = (np.ones(len(dx)), tangential, radial, tangential**2, radial**2, dx, dy)
        # Whole multiples of 2^-20 px add up to the same sum in any order, so that chunk borders change nothing.
        for row, column in zip(self._whole, columns, strict=True):
            row += np.bincount(ring, np.rint(column * _UNITS_A_PX), len(row)).astype(np.int64)

    @property
    def _sums(self) -> NDArray[np.float64]:
        """Sums in px and px², float64[7, rings]."""
        return self._whole / _UNITS_A_PX

    @property
    def count(self) -> NDArray[np.int64]:
        """Matches in each ring, int64[rings]."""
        count: NDArray[np.int64] = self._sums[_COUNT].astype(np.int64)
        return count

    @property
    def tangential_px(self) -> NDArray[np.float64]:
        """Mean offset along the ring, float64[rings]; NaN in a ring without matches, here and below."""
        return self._mean(_TANGENTIAL)

    @property
    def radial_px(self) -> NDArray[np.float64]:
        """Mean offset outward, float64[rings]."""
        return self._mean(_RADIAL)

    @property
    def tangential_spread_px(self) -> NDArray[np.float64]:
        """Standard deviation along the ring, float64[rings]."""
        return self._spread(_TANGENTIAL, _TANGENTIAL_SQUARE)

    @property
    def radial_spread_px(self) -> NDArray[np.float64]:
        """Standard deviation outward, float64[rings]."""
        return self._spread(_RADIAL, _RADIAL_SQUARE)

    @property
    def flat_px(self) -> NDArray[np.float64]:
        """Mean offset in the image's x and y, float64[rings, 2]."""
        return np.column_stack([self._mean(_RIGHT), self._mean(_DOWN)])

    def summary(self) -> dict[str, Any]:
        """Return matches, edges and, ring by ring, means and spreads in px, ``None`` where a ring has no matches."""
        columns = {
            "tangential_px": self.tangential_px,
            "tangential_spread_px": self.tangential_spread_px,
            "radial_px": self.radial_px,
            "radial_spread_px": self.radial_spread_px,
            "right_px": self.flat_px[:, 0],
            "down_px": self.flat_px[:, 1],
        }
        rings = {
            name: [None if np.isnan(value) else float(value) for value in column] for name, column in columns.items()
        }
        return {
            "matches": int(self.count.sum()),
            "ring_edges_px": self.ring_edges_px.tolist(),
            "count": self.count.tolist(),
            **rings,
        }

    def _mean(self, row: int) -> NDArray[np.float64]:
        count = self._sums[_COUNT]
        return np.where(count > 0, self._sums[row] / np.maximum(count, 1.0), np.nan)

    def _spread(self, row: int, squares: int) -> NDArray[np.float64]:
        return np.sqrt(np.maximum(self._mean(squares) - self._mean(row) ** 2, 0.0))
