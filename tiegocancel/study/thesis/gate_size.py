"""Measure how wide the temporal gate must be by radius, beside the thesis's rule ``ε_t ≈ ε_xy/(r|ω|)`` (§8.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["Band", "GateSizes", "gate_sizes"]

_BANDS = 4
_FEWEST = 200
_ENOUGH = 0.9


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """Radii from ``low_px`` to ``high_px``: ``ratio`` and ``gap`` to zero motion at each ε_t.

    ``formula_us`` is the thesis's rule at the middle radius; ``best_us`` has the largest gap, ``enough_us`` is the
    smallest gate with 90 % of the largest ratio.
    """

    low_px: float
    high_px: float
    ratio: NDArray[np.float64]
    gap: NDArray[np.float64]
    formula_us: float
    best_us: float
    enough_us: float


@dataclass(frozen=True, slots=True, eq=False)
class GateSizes:
    """Bands from the centre to the rim, over ``tolerances_us``."""

    tolerances_us: NDArray[np.float64]
    bands: tuple[Band, ...]


def gate_sizes(result: ThesisResult) -> GateSizes:
    """Return what the streaming canceller shows at the long horizon; bands with too few events are left out."""
    settings, bench = result.settings, result.bench
    tolerances_us = np.array(settings.gates.tolerances_us, np.float64)
    edges = np.linspace(0.0, bench.radius_px, _BANDS + 1)
    true, zero = (_ratios(result, name, edges) for name in ("stream", "stream_zero"))
    start_us, stop_us = bench.windows[0].start_us, bench.windows[0].stop_us
    omega = abs(float(bench.motion.mean(start_us=start_us, stop_us=stop_us)[1]))
    bands = []
    for place in range(_BANDS):
        ratio, gap = true[:, place], true[:, place] - zero[:, place]
        if not np.isfinite(gap).any():
            continue
        enough = np.flatnonzero(ratio >= _ENOUGH * np.nanmax(ratio))[0]
        middle = (edges[place] + edges[place + 1]) / 2
        bands.append(
            Band(
                float(edges[place]),
                float(edges[place + 1]),
                ratio,
                gap,
                settings.point.tolerance_px / max(middle * omega, 1e-9) * 1e6,
                float(tolerances_us[int(np.nanargmax(gap))]),
                float(tolerances_us[int(enough)]),
            )
        )
    return GateSizes(tolerances_us, tuple(bands))


def _ratios(result: ThesisResult, name: str, edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share suppressed float64[gates, bands] over all windows, NaN of too few events."""
    ratios = np.full((len(result.settings.gates.tolerances_us), len(edges) - 1), np.nan)
    for place, tolerance_us in enumerate(result.settings.gates.tolerances_us):
        point = base_of(name, result.settings).at(
            horizon_us=result.settings.point.long_horizon_us, tolerance_us=tolerance_us, detail=True
        )
        rows = result.results.over_windows(point)
        if not rows:
            continue
        rings = np.array(rows[0]["ring_edges_px"])
        band = np.searchsorted(edges, (rings[1:] + rings[:-1]) / 2, side="right") - 1
        inside = (band >= 0) & (band < len(edges) - 1)
        counts = [
            np.bincount(band[inside], np.sum([row[key] for row in rows], axis=0)[inside], minlength=len(edges) - 1)
            for key in ("ring_suppressed", "ring_events")
        ]
        ratios[place] = np.where(counts[1] >= _FEWEST, counts[0] / np.maximum(counts[1], 1), np.nan)
    return ratios
