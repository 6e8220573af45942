"""Draw where events remain: along the radius (Fig. 7.3), inside and outside the disc (Fig. 7.4), ρ (§8.6)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tiegocancel.report import style
from tiegocancel.report.thesis.series import LOOKS, LOST, THESIS, label_of, percent_axis
from tiegocancel.study.thesis.experiments import CONTROLS, base_of
from tiegocancel.study.thesis.finding_space import excess
from tiegocancel.study.thesis.results import share
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["density", "radial", "roi"]

_ROI = {1000: (0.882, 0.125), 2000: (0.851, 0.118), 4000: (0.723, 0.081), 6000: (0.584, 0.052)}
_FEWEST = 50


def radial(result: ThesisResult) -> Figure | None:
    """Draw density and share suppressed by distance from the centre, at both horizons, with zero motion."""
    chosen = result.settings.point
    drawn = style.figure(11.0, 5.6)
    axes = drawn.subplots(2, 2, sharex=True)
    seen = False
    for column, horizon_us in zip(axes.T, (chosen.horizon_us, chosen.long_horizon_us), strict=True):
        for name in ("gated", "zero", "reversed", "stream"):
            rings = _rings(result, name, horizon_us)
            if rings is None:
                continue
            middle, area, events, suppressed = rings
            if name == "gated":
                column[0].plot(middle, events / area, color=style.BEFORE, linewidth=1.6, label="all events")
                column[0].fill_between(middle, events / area, color=style.BEFORE, alpha=0.15, linewidth=0)
            column[0].plot(middle, (events - suppressed) / area, linewidth=1.3, **LOOKS[name])
            enough = events >= _FEWEST
            part = np.where(enough, suppressed / np.maximum(events, 1), np.nan)
            column[1].plot(middle, part, label=label_of(name), linewidth=1.6, **LOOKS[name])
            seen = True
        lost = _rings(result, "gated", horizon_us, "ring_mover_")
        if lost is not None:
            middle, _, events, suppressed = lost
            part = np.where(events >= _FEWEST, suppressed / np.maximum(events, 1), np.nan)
            if np.isfinite(part).any():
                column[1].plot(middle, part, label="mover lost, eq. (4.4)", **LOST)
        column[0].set(title=f"Δt = {horizon_us / 1000:g} ms", ylim=(0, None))
        style.tidy(column[0])
        percent_axis(column[1])
        column[1].set(xlabel="distance from the centre (px)", xlim=(0, 1.2 * result.bench.radius_px))
        for panel in column:
            panel.axvline(result.bench.radius_px, color=style.MUTED, linestyle="--", linewidth=0.8)
    axes[0, 0].set_ylabel("events a pixel, all and residual")
    axes[1, 0].set_ylabel("suppressed")
    found = dict(zip(*reversed(axes[0, 0].get_legend_handles_labels()), strict=True))
    found |= dict(zip(*reversed(axes[1, 0].get_legend_handles_labels()), strict=True))
    drawn.legend(list(found.values()), list(found), loc="outside lower center", ncols=len(found), fontsize=7)
    return drawn if seen else None


def roi(result: ThesisResult) -> Figure:
    """Draw CR on the disc and in the background against Δt, and the gap between them, with the thesis's Table 7.2."""
    drawn = style.figure(11.0, 3.8)
    axes = drawn.subplots(1, 3)
    horizons = [h for h in result.settings.grid.horizons_us if h <= 8000]
    for name in ("printed", "cut", "gated", "zero", "reversed", "stream"):
        inside, outside = (
            result.results.curve(
                horizons,
                lambda h, name=name: base_of(name, result.settings).at(horizon_us=int(h)),  # type: ignore[misc]
                lambda row, group=group: share(row, group),  # type: ignore[misc]
            )
            for group in ("disc_", "background_")
        )
        for panel, values in zip(axes, (inside.y, outside.y, inside.y - outside.y), strict=True):
            panel.plot(inside.x / 1000, values, linewidth=1.6, label=label_of(name), **LOOKS[name])
    if result.results.labelled:
        for group, look in (("mover_", LOST), ("noise_", LOST | {"color": style.NOISE})):
            lost = result.results.curve(
                horizons,
                lambda h: base_of("gated", result.settings).at(horizon_us=int(h)),
                lambda row, group=group: share(row, group),  # type: ignore[misc]
            )
            words = f"{group[:-1]} lost, eq. (4.4), on the whole sensor"
            places = axes[:1] if group == "mover_" else axes[:2]  # a mover that crosses the disc is no background
            for panel in places if np.isfinite(lost.y).any() else ():
                panel.plot(lost.x / 1000, lost.y, label=words, **look)
    x = [h / 1000 for h in _ROI]
    table = np.array(list(_ROI.values()))
    for panel, column in zip(axes, (table[:, 0], table[:, 1], table[:, 0] - table[:, 1]), strict=True):
        panel.plot(x, column, **THESIS)
    for panel, title in zip(axes, ("on the disc", "in the background", "gap, disc − background"), strict=True):
        panel.set(title=title, xlabel="Δt (ms)")
        percent_axis(panel)
    axes[2].set_ylim(-0.25, 1.0)
    axes[0].set_ylabel("events suppressed")
    drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=7)
    return drawn


def density(result: ThesisResult) -> Figure:
    """Draw ρ = (N_disc − N_bg)/N_bg by density, before and after (§8.6)."""
    chosen = result.settings.point
    drawn = style.figure(10.0, 3.4)
    axes = drawn.subplots(1, 2, sharey=True)
    names = ("gated", *CONTROLS["gated"], "stream", *CONTROLS["stream"])
    for panel, horizon_us in zip(axes, (chosen.horizon_us, chosen.long_horizon_us), strict=True):
        base = base_of("gated", result.settings).at(horizon_us=horizon_us)
        before = result.results.mean(base, lambda row: excess(result, row, residual=False))
        after = [
            result.results.mean(
                base_of(name, result.settings).at(horizon_us=horizon_us),
                lambda row: excess(result, row, residual=True),
            )
            for name in names
        ]
        words = ["all events", *(label_of(name) for name in names)]
        values = [before or 0.0, *(value or 0.0 for value in after)]
        colours = [style.BEFORE, *(LOOKS[name]["color"] for name in names)]
        bars = panel.barh(words, values, color=colours, height=0.65)
        panel.bar_label(bars, fmt="%.1f", padding=3, fontsize=8)
        panel.axvline(5.0, color=style.INK, linewidth=0.9, linestyle=":")
        panel.axvline(1.2, color=style.INK, linewidth=0.9, linestyle="--")
        panel.set(title=f"Δt = {horizon_us / 1000:g} ms", xlabel="ρ (thesis: 5.0 dotted → 1.2 dashed)")
        panel.set_xlim(min(0.0, *values), 1.15 * max(5.0, *values))
        style.tidy(panel, grid="x")
    axes[0].invert_yaxis()
    return drawn


def _rings(
    result: ThesisResult, name: str, horizon_us: int, group: str = "ring_"
) -> tuple[NDArray[np.float64], ...] | None:
    """Return middle, area, events and suppressed of each ring over all windows; ``None`` where none was counted."""
    rows = result.results.over_windows(base_of(name, result.settings).at(horizon_us=horizon_us, detail=True))
    if not rows or f"{group}events" not in rows[0]:
        return None
    edges = np.array(rows[0]["ring_edges_px"])
    area = np.array(rows[0]["ring_areas_px"], np.float64)
    events = np.sum([row[f"{group}events"] for row in rows], axis=0).astype(np.float64)
    suppressed = np.sum([row[f"{group}suppressed"] for row in rows], axis=0).astype(np.float64)
    inside = area > 0
    middle = (edges[1:] + edges[:-1]) / 2
    return middle[inside], area[inside] * len(rows), events[inside], suppressed[inside]
