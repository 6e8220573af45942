"""Draw the polarity modes (§8.4) and the sizing of the temporal gate (§8.3)."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from tiegocancel.report import style
from tiegocancel.report.thesis.series import LOOKS, label_of, percent_axis
from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.gate_size import gate_sizes
from tiegocancel.study.thesis.results import share
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["gates", "polarity"]

_MODES = (
    ("opposite", "opposite: the anti-event opposes"),
    ("equal", "as (4.5) prints it: p_j = −p_i"),
    ("ignore", "ignored"),
)


def polarity(result: ThesisResult) -> Figure:
    """Draw CR and the mover's loss in each mode, at both horizons, with zero motion."""
    chosen = result.settings.point
    groups = [("", "all events")] + ([("mover_", "mover lost")] if result.results.labelled else [])
    drawn = style.figure(11.0, 3.0 * len(groups))
    axes = drawn.subplots(len(groups), 2, sharey=True, squeeze=False)
    for line, (group, title) in zip(axes, groups, strict=True):
        for panel, horizon_us in zip(line, (chosen.horizon_us, chosen.long_horizon_us), strict=True):
            for shift, name in ((-0.27, "gated"), (0.0, "zero"), (0.27, "stream")):
                values = [
                    result.results.mean(
                        base_of(name, result.settings).at(horizon_us=horizon_us, polarity=mode),
                        lambda row, group=group: share(row, group),  # type: ignore[misc]
                    )
                    for mode, _ in _MODES
                ]
                bars = panel.bar(
                    np.arange(3) + shift, [value or 0.0 for value in values], width=0.25, label=label_of(name),
                    color=LOOKS[name]["color"],
                )  # fmt: skip
                panel.bar_label(bars, [f"{100 * (value or 0):.0f}" for value in values], padding=2, fontsize=7)
            panel.set_xticks(range(3), [words for _, words in _MODES], fontsize=7)
            panel.set_title(f"{title}, Δt = {horizon_us / 1000:g} ms")
            percent_axis(panel, top=1.12)
    axes[0, 0].legend(fontsize=7)
    return drawn


def gates(result: ThesisResult) -> Figure | None:
    """Draw CR against ε_t in bands of the radius, and the gate that suffices beside ``ε_xy/(r|ω|)``."""
    sizes = gate_sizes(result)
    if not sizes.bands:
        return None
    drawn = style.figure(11.0, 3.8)
    left, right = drawn.subplots(1, 2)
    colours = colormaps["viridis"](np.linspace(0.05, 0.85, len(sizes.bands)))
    for colour, band in zip(colours, sizes.bands, strict=True):
        words = f"r = {band.low_px:.0f}–{band.high_px:.0f} px"
        left.plot(sizes.tolerances_us / 1000, band.gap, color=colour, marker="o", markersize=3, label=words)
    horizon_ms = result.settings.point.long_horizon_us / 1000
    left.axhline(0, color=style.MUTED, linewidth=0.8)
    left.set(title=f"streaming, CR − CR of zero motion, Δt = {horizon_ms:g} ms", xlabel="ε_t (ms)")
    left.set_ylabel("points above zero motion")
    left.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    left.legend(fontsize=7)
    style.tidy(left)
    middle = np.array([(band.low_px + band.high_px) / 2 for band in sizes.bands])
    right.plot(
        middle, [band.formula_us / 1000 for band in sizes.bands], color=style.INK, linestyle="--", label="ε_xy/(r|ω|)"
    )
    right.plot(
        middle,
        [band.best_us / 1000 for band in sizes.bands],
        color=style.RESIDUAL,
        marker="o",
        label="largest gap to zero",
    )
    right.plot(
        middle, [band.enough_us / 1000 for band in sizes.bands], color=style.OFF, marker="s",
        label="90 % of the largest CR",
    )  # fmt: skip
    right.set(title="the gate in time that suffices", xlabel="distance from the centre (px)", ylabel="ε_t (ms)")
    right.set_ylim(0, 1.1 * float(sizes.tolerances_us.max()) / 1000)
    right.legend(fontsize=7)
    style.tidy(right)
    return drawn
