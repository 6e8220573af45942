"""Order the combinations of the sweep (Table 7.1): by CR as the thesis does, and by what zero motion leaves of it."""

from __future__ import annotations

import math

from tiegocancel.study.thesis.experiments import SERIES, grid_points
from tiegocancel.study.thesis.results import share
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["Combination", "beside", "rank", "rank_gaps"]

Combination = tuple[int, float, int, float, float | None]
"""Δt (µs), ε_xy (px), ε_t (µs), what it is ordered by, mean distance of the matches (px)."""


def rank(result: ThesisResult, name: str) -> list[Combination]:
    """Return Δt, ε_xy, ε_t, CR and mean distance (px) of a series' combinations, best first (Table 7.1)."""
    found = []
    for point in grid_points(name, result.settings):
        row = result.results.row(point)
        value = float("nan") if row is None else share(row)
        if row is not None and math.isfinite(value):
            found.append((point.horizon_us, point.tolerance_px, point.tolerance_us, value, row["mean_px"]))
    return sorted(found, key=lambda line: (-line[3], line[0], line[1], line[2]))


def beside(result: ThesisResult, line: Combination, name: str, group: str = "") -> float:
    """Return what a series has at a combination, of all events or of a group; NaN where it was not measured."""
    horizon_us, tolerance_px, tolerance_us = line[:3]
    row = result.results.row(
        SERIES[name].point.at(horizon_us=horizon_us, tolerance_px=tolerance_px, tolerance_us=tolerance_us)
    )
    return float("nan") if row is None else share(row, group)


def rank_gaps(result: ThesisResult) -> list[Combination]:
    """Return the combinations by how far the symmetric gate's CR stands above that of zero motion."""
    zero = {line[:3]: line[3] for line in rank(result, "zero")}
    true = rank(result, "gated")
    gaps = [(*line[:3], line[3] - zero[line[:3]], line[4]) for line in true if line[:3] in zero]
    return sorted(gaps, key=lambda line: (-line[3], line[0], line[1], line[2]))
