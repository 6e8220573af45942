"""Draw what a search of operating points found: score against memory and against reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from tiegocancel.report import style
from tiegocancel.study.plan_result import PlanResult

__all__ = ["draw_pareto"]

_MARKS = ("s", "D", "^", "v")


def draw_pareto(path: Path, result: PlanResult) -> None:
    """Write the figure: the trials, the front, its knee, the choice, and the references beside them."""
    with rc_context(style.STYLE):
        drawn = style.figure(10.5, 4.2)
        left, right = drawn.subplots(1, 2, sharey=True, width_ratios=(2, 1))
        _memory(left, result)
        _reads(right, result)
        drawn.legend(
            *left.get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8, markerscale=0.5
        )
        drawn.savefig(path, dpi=150)


def _memory(axes: Axes, result: PlanResult) -> None:
    """Draw score against memory, coloured by reads."""
    trials, front = result.trials, result.front
    reads = np.array([trial.reads for trial in trials], float)
    if trials:
        points = axes.scatter(
            [trial.kib for trial in trials],
            [trial.score for trial in trials],
            c=reads,
            cmap="viridis_r",
            vmin=1,
            vmax=max(float(reads.max()), 2.0),
            s=22,
            zorder=3,
        )
        axes.figure.colorbar(points, ax=axes, label="table reads an event, at most", pad=0.01)
        axes.plot(
            [trial.kib for trial in front],
            [trial.score for trial in front],
            color=style.RESIDUAL,
            drawstyle="steps-post",
            linewidth=1.4,
            label="front",
        )
    for name, trial, size in (("knee", result.knee, 130), ("chosen", result.chosen, 260)):
        if trial is not None:
            colour = style.MOVER if name == "knee" else style.ON
            axes.scatter(
                trial.kib, trial.score, s=size, facecolors="none", edgecolors=colour, linewidths=1.5, zorder=4,
                label=f"{name}: {trial.score:.3f}, {trial.kib:,.0f} KiB",
            )  # fmt: skip
    for mark, trial in zip(_MARKS, result.references, strict=False):
        axes.scatter(
            trial.kib, trial.score, marker=mark, color=style.INK, s=32, zorder=4,
            label=f"{trial.name}: {trial.score:.3f}, {trial.kib:,.0f} KiB",
        )  # fmt: skip
    axes.set_xscale("log", base=2)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda kib, _: f"{kib:g}"))
    if result.limits.most_kib is not None:
        axes.axvline(result.limits.most_kib, color=style.MUTED, linestyle="--", linewidth=0.8)
    first = "real events" if result.injected else "ego events"
    axes.set(
        title="selectivity against memory",
        xlabel="ring and table (KiB)",
        ylabel=f"{first} suppressed − max(mover, zero, reversed)",
    )
    style.tidy(axes, grid="both")


def _reads(axes: Axes, result: PlanResult) -> None:
    """Draw score against reads: every trial, and the best of each number."""
    for trial in result.trials:
        axes.scatter(trial.reads, trial.score, color=style.BEFORE, s=14)
    best: dict[int, float] = {}
    for trial in result.trials:
        best[trial.reads] = max(trial.score, best.get(trial.reads, -1.0))
    steps = sorted(best)
    axes.plot(
        steps,
        np.maximum.accumulate([best[reads] for reads in steps]) if steps else [],
        color=style.RESIDUAL,
        drawstyle="steps-post",
        marker="o",
        linewidth=1.4,
    )
    for mark, trial in zip(_MARKS, result.references, strict=False):
        axes.scatter(trial.reads, trial.score, marker=mark, color=style.INK, s=32)
    if result.limits.max_reads is not None:
        axes.axvline(result.limits.max_reads, color=style.MUTED, linestyle="--", linewidth=0.8)
    axes.set(title="against work", xlabel="table reads an event, at most")
    style.tidy(axes, grid="both")
