"""Draw CR against Δt (Fig. 7.1, §8.1)."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from tiegocancel.report import style
from tiegocancel.report.thesis.series import LOOKS, THESIS, draw_curve, percent_axis
from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.fits import cut_law, fit_decay
from tiegocancel.study.thesis.results import Curve, share
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["horizons"]

_THESIS = ((0.0, 1.0), (1.0, 0.90), (2.0, 0.90), (6.0, 0.35), (10.0, 0.225), (20.0, 0.225))


def horizons(result: ThesisResult) -> Figure:
    """Draw the thesis's protocol on the left, the same gates with what comes before the window on the right."""
    drawn = style.figure(11.0, 5.0)
    left, right = drawn.subplots(1, 2, sharey=True)
    length_us = result.bench.windows[0].stop_us - result.bench.windows[0].start_us
    for name in ("printed", "printed_zero", "printed_off", "cut"):
        draw_curve(left, _curve(result, name), name)
    top = _curve(result, "cut")
    fine = np.linspace(0, float(top.x.max()), 200)
    left.plot(
        fine / 1000, cut_law(fine, length_us), color=style.INK, linewidth=1.0, linestyle="--",
        label=f"most that {length_us / 1000:g} ms cut out allow: 1 − Δt/T",
    )  # fmt: skip
    fit = fit_decay(_curve(result, "printed"))
    if fit is not None and math.isfinite(fit.half_ms):
        left.plot(
            fine / 1000, fit.at(fine / 1000), color=LOOKS["printed"]["color"], linestyle=":", linewidth=1.2,
            label=f"exponential fit, as printed: τ½ = {fit.half_ms:.1f} ms (rms {100 * fit.rms:.0f} pts)",
        )  # fmt: skip
    left.set_title("the thesis's protocol: windows cut out")
    for name in ("own", "gated", "zero", "reversed", "stream"):
        draw_curve(right, _curve(result, name), name)
    if result.results.labelled:
        for name, group, colour, words in (
            ("gated", "mover_", LOOKS["gated"]["color"], "mover lost, eq. (4.4)"),
            ("stream", "mover_", LOOKS["stream"]["color"], "mover lost, streaming"),
            ("stream", "noise_", style.NOISE, "noise lost, streaming"),
        ):
            lost = _curve(result, name, group)
            if np.isfinite(lost.y).any():
                right.plot(lost.x / 1000, lost.y, color=colour, linewidth=1.2, linestyle="-.", label=words)
    right.set_title("the same gates, warm-up led in or not counted")
    for panel in (left, right):
        panel.plot(*zip(*_THESIS, strict=True), **THESIS)
        panel.set_xlabel("prediction horizon Δt (ms)")
        panel.set_xticks(range(0, 21, 5))
        percent_axis(panel)
    left.set_ylabel("events suppressed (mean ± sd over windows)")
    found = dict(zip(*reversed(left.get_legend_handles_labels()), strict=True))
    found |= dict(zip(*reversed(right.get_legend_handles_labels()), strict=True))
    drawn.legend(list(found.values()), list(found), loc="outside lower center", ncols=4, fontsize=7)
    return drawn


def _curve(result: ThesisResult, name: str, group: str = "") -> Curve:
    return result.results.curve(
        result.settings.grid.horizons_us,
        lambda horizon_us: base_of(name, result.settings).at(horizon_us=int(horizon_us)),
        lambda row: share(row, group),
    )
