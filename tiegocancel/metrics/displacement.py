"""Describe where, within its gates, an event met its prediction (thesis, §7.5)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.matching.config import CancelConfig
from tiegocancel.metrics.ledger import Matches

__all__ = ["DisplacementHistogram"]

TIME_BINS = 41


class DisplacementHistogram:
    """Count matches by ``(dx, dy)`` in whole pixels and by lateness within ±ε_t.

    ``by_offset`` int64[2R+1, 2R+1], rows dy, columns dx; ``by_lateness`` int64[41] over ``lateness_edges_us``.
    """

    def __init__(self, config: CancelConfig, counted_from_us: int) -> None:
        self.counted_from_us = counted_from_us
        # A bin that is wider than a pixel may hold a prediction as far from the one that was looked at.
        self.reach_px = math.isqrt(config.reach_squared_px) + (1 << config.bin_bits) - 1
        self.side = 2 * self.reach_px + 1
        self.by_offset: NDArray[np.int64] = np.zeros((self.side, self.side), np.int64)
        early, late = (
            max(gate, 1) + (1 << config.tick_bits) - 1 for gate in (config.early_gate_us, config.late_gate_us)
        )
        self.lateness_edges_us: NDArray[np.float64] = np.linspace(-early - 0.5, late + 0.5, TIME_BINS + 1)
        self._late_sum_us = 0
        self.by_lateness: NDArray[np.int64] = np.zeros(TIME_BINS, np.int64)

    def add(self, matches: Matches) -> None:
        """Count the matches of one chunk, warm-up left out."""
        counted = matches.t_us >= self.counted_from_us
        cell = (matches.dy[counted] + self.reach_px) * self.side + matches.dx[counted] + self.reach_px
        self.by_offset += np.bincount(cell, minlength=self.by_offset.size).reshape(self.by_offset.shape)
        self._late_sum_us += int(matches.late_us[counted].sum())
        self.by_lateness += np.histogram(matches.late_us[counted], self.lateness_edges_us)[0]

    def summary(self) -> dict[str, Any]:
        """Return count, mean vector, mean and 95th percentile of the distance (px), mean lateness (µs)."""
        total = int(self.by_offset.sum())
        if not total:
            return {"matches": 0}
        step = np.arange(-self.reach_px, self.reach_px + 1)
        dx, dy = np.meshgrid(step, step)
        distance = np.hypot(dx, dy)
        order = np.argsort(distance, axis=None, kind="stable")
        cumulative = np.cumsum(self.by_offset.ravel()[order])
        return {
            "matches": total,
            "mean_dx_px": float((dx * self.by_offset).sum() / total),
            "mean_dy_px": float((dy * self.by_offset).sum() / total),
            "mean_px": float((distance * self.by_offset).sum() / total),
            "p95_px": float(distance.ravel()[order][int(np.searchsorted(cumulative, 0.95 * total))]),
            "mean_late_us": self._late_sum_us / total,
        }
