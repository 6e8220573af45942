"""Draw how near matches are (Fig. 7.5), and how the streaming canceller agrees with the reference."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tiegocancel.report import style
from tiegocancel.report.thesis.series import LOOKS, label_of, percent_axis
from tiegocancel.study.sweep import Row
from tiegocancel.study.thesis.experiments import base_of, grid_points
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.probe import DISTANCE_EDGES_PX
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["agreement", "displacement"]


def displacement(result: ThesisResult) -> Figure:
    """Draw mean distances over all combinations, and the distances of one point beside chance."""
    drawn = style.figure(11.0, 3.6)
    left, right = drawn.subplots(1, 2)
    bins = np.linspace(0, 4, 41)
    for name in ("gated", "zero", "reversed"):
        rows = [result.results.row(point) for point in grid_points(name, result.settings)]
        means = [row["mean_px"] for row in rows if row is not None and row["mean_px"] is not None]
        if means:
            words = f"{label_of(name)}: mean {np.mean(means):.2f} px"
            left.hist(means, bins, histtype="step", linewidth=1.6, label=words, **LOOKS[name])
    left.axvline(0.8, color=style.INK, linewidth=1.0, linestyle=":", label="thesis: 0.8 px")
    left.set(title="mean distance of each combination", xlabel="px", ylabel="combinations", xlim=(0, 4))
    left.legend(fontsize=7)
    style.tidy(left)
    gate = result.settings.point.tolerance_px
    for name in ("gated", "zero", "reversed"):
        found = result.results.over_windows(
            base_of(name, result.settings).at(horizon_us=result.settings.point.long_horizon_us, detail=True)
        )
        if found:
            counts = np.sum([row["distances"] for row in found], axis=0).astype(np.float64)
            right.stairs(
                counts / max(counts.sum(), 1), DISTANCE_EDGES_PX, label=label_of(name), linewidth=1.6, **LOOKS[name]
            )
    inside = np.minimum(DISTANCE_EDGES_PX, gate)
    chance = np.diff(inside**2) / gate**2
    right.stairs(chance, DISTANCE_EDGES_PX, color=style.MOVER, linewidth=1.2, label="chance: uniform in the gate")
    horizon_ms = result.settings.point.long_horizon_us / 1000
    right.set(
        title=f"distance of the matches, Δt = {horizon_ms:g} ms", xlabel="px", ylabel="share", xlim=(0, gate + 0.5)
    )
    right.legend(fontsize=7)
    style.tidy(right)
    return drawn


def agreement(result: ThesisResult) -> Figure | None:
    """Draw precision, recall and the three CR by gate and by density."""
    if not result.agreement:
        return None
    chosen = result.settings.point
    drawn = style.figure(11.0, 3.8)
    left, middle, right = drawn.subplots(1, 3)
    by_gate = sorted(
        (
            (p, row)
            for p, row in result.agreement
            if p.kept == 1.0 and p.tolerance_us == chosen.tolerance_us and row["events"]
        ),
        key=lambda pair: pair[0].tolerance_px,
    )
    by_density = sorted(
        (
            (p, row)
            for p, row in result.agreement
            if (p.tolerance_px, p.tolerance_us) == (chosen.tolerance_px, chosen.tolerance_us) and row["events"]
        ),
        key=lambda pair: pair[1]["density_mev_s"],
    )
    _agreeing(left, [p.tolerance_px for p, _ in by_gate], by_gate)
    left.set(title=f"by gate, ε_t = {chosen.tolerance_us / 1000:g} ms", xlabel="ε_xy (px)")
    _agreeing(middle, [row["density_mev_s"] for _, row in by_density], by_density)
    middle.set(title=f"by density, ε_xy = {chosen.tolerance_px:g} px", xlabel="events kept (Mev/s)")
    widths = np.arange(len(by_gate))
    for shift, key, colour, words in (
        (-0.27, "cr_reference", LOOKS["gated"]["color"], "reference"),
        (0.0, "cr_chained", "#8fb4dd", "streaming, every prediction kept"),
        (0.27, "cr_stream", LOOKS["stream"]["color"], "streaming, one cell a pixel"),
    ):
        right.bar(widths + shift, [row[key] for _, row in by_gate], width=0.25, color=colour, label=words)
    for key, dash, words in (("cr_zero", "--", "zero motion"), ("cr_reversed", ":", "reversed motion")):
        values = [row[key] for _, row in by_gate]
        right.hlines(
            values, widths - 0.42, widths + 0.42, color=style.INK, linewidth=1.2, linestyle=dash,
            label=f"streaming, {words}",
        )  # fmt: skip
    right.set_xticks(widths, [f"{p.tolerance_px:g}" for p, _ in by_gate])
    right.set(title="events suppressed", xlabel="ε_xy (px)")
    percent_axis(right, top=1.5)
    right.set_yticks(np.linspace(0, 1, 6))
    right.legend(fontsize=7, loc="upper left")
    drawn.legend(*left.get_legend_handles_labels(), loc="outside lower left", ncols=4, fontsize=7)
    return drawn


def _agreeing(panel: Axes, x: list[float], pairs: list[tuple[Point, Row]]) -> None:
    for key, colour, words in (
        ("precision", style.RESIDUAL, "precision: suppressed by the reference too"),
        ("recall", style.OFF, "recall: of what the reference suppresses"),
    ):
        panel.plot(x, [row[key] for _, row in pairs], color=colour, marker="o", markersize=4, label=words)
        control = [row[f"{key}_zero"] for _, row in pairs]
        panel.plot(x, control, color=colour, linewidth=1.0, linestyle="--", label=f"{key} of streaming, zero motion")
    percent_axis(panel)
