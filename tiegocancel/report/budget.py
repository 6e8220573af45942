"""Draw budgets: every part's margins side by side, and one part's cycles, levels and latencies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap

from tiegocancel.report import style
from tiegocancel.study.budget.judge import Judged

__all__ = ["draw_comparison", "draw_part"]

_FAIL, _TIGHT, _PASS = "#f0b9c0", "#f5dfb8", "#c4e3df"
_LEAST_MARGIN = -1.5


def draw_comparison(path: Path, judged: list[Judged]) -> None:
    """Write the figure: a row a part, a column a constraint, its margin in the cell."""
    names = list(dict.fromkeys(_column(row.name) for one in judged for row in one.verdict.constraints))
    with rc_context(style.STYLE):
        drawn = style.figure(1.9 + 0.95 * len(names), 1.5 + 0.34 * len(judged))
        axes = drawn.subplots()
        grades = np.full((len(judged), len(names)), np.nan)
        for i, one in enumerate(judged):
            for row in sorted(one.verdict.constraints, key=lambda row: -row.margin):
                j = names.index(_column(row.name))
                grades[i, j] = {"FAIL": 0, "tight": 1, "pass": 2}[row.verdict]
                margin = "none" if row.margin < _LEAST_MARGIN * 6 else f"{row.margin:+.0%}"
                for text in [t for t in axes.texts if t.get_position() == (j, i)]:
                    text.remove()  # of several memories of a part the one with the least margin stays
                weight = "bold" if row is one.verdict.binding else "normal"
                axes.text(j, i, margin, ha="center", va="center", fontsize=8, fontweight=weight, color=style.INK)
        axes.imshow(
            np.ma.masked_invalid(grades),
            cmap=ListedColormap([_FAIL, _TIGHT, _PASS]),
            norm=BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3),
            aspect="auto",
        )
        axes.set_xticks(range(len(names)), names, rotation=35, ha="right")
        axes.set_yticks(range(len(judged)), [f"{one.verdict.target}  {_mark(one)}" for one in judged])
        axes.set_xticks(np.arange(len(names)) + 0.5, minor=True)
        axes.set_yticks(np.arange(len(judged)) + 0.5, minor=True)
        axes.grid(which="minor", color="white", linewidth=2)
        axes.tick_params(which="both", length=0)
        axes.spines[:].set_visible(False)
        axes.set_title("what is left of each resource (bold: binds; red: not enough; yellow: less than a fifth)")
        drawn.savefig(path, dpi=150)


def draw_part(path: Path, one: Judged) -> None:
    """Write the figure of one part: margins, where cycles go, levels over time, latencies."""
    outcome = one.verdict.outcome
    with rc_context(style.STYLE):
        drawn = style.figure(11.5, 6.4)
        if outcome is None:
            _margins(drawn.subplots(), one)
            drawn.savefig(path, dpi=150)
            return
        (margins, stages), (levels, latency) = drawn.subplots(2, 2)
        _margins(margins, one)
        _stages(stages, one)
        _levels(levels, one)
        _latency(latency, one)
        drawn.suptitle(
            f"{one.verdict.target}: {one.verdict.design}, {one.verdict.clock_hz * 1e-6:.4g} MHz", x=0.01, ha="left"
        )
        drawn.savefig(path, dpi=150)


def _margins(axes: Axes, one: Judged) -> None:
    """Draw need over have for each constraint."""
    rows = one.verdict.constraints
    shares = [min(1.0 - row.margin, 1.0 - _LEAST_MARGIN) for row in rows]
    colours = [{"FAIL": style.ON, "tight": style.MOVER, "pass": style.RESIDUAL}[row.verdict] for row in rows]
    axes.barh(range(len(rows)), shares, color=colours, height=0.62)
    axes.axvline(1.0, color=style.INK, linewidth=1.0)
    for i, (row, share) in enumerate(zip(rows, shares, strict=True)):
        more = "" if 1.0 - row.margin <= 1.0 - _LEAST_MARGIN else f"{min(1.0 - row.margin, 999):.3g}×"
        axes.text(share + 0.02, i, more or f"{share:.0%}", va="center", fontsize=8, color=style.MUTED)
    axes.set_yticks(range(len(rows)), [row.name for row in rows])
    axes.invert_yaxis()
    axes.set(title="need over have", xlim=(0, max([1.2, *shares]) + 0.25))
    style.tidy(axes, grid="x")


def _stages(axes: Axes, one: Judged) -> None:
    """Draw mean and 99th percentile of the cycles in each stage, and what operations waited for."""
    outcome = one.verdict.outcome
    assert outcome is not None
    parts = outcome.gauge.stages()
    kept = max(int(outcome.kept.sum()), 1)
    names = [*parts, *(f"waits: {cause}" for cause, count in outcome.waited.items() if count)]
    means = [part.mean for part in parts.values()] + [count / kept for count in outcome.waited.values() if count]
    axes.barh(
        range(len(names)),
        means,
        color=[style.BEFORE] * len(parts) + [style.NOISE] * (len(names) - len(parts)),
        height=0.62,
    )
    axes.plot(
        [part.p99 for part in parts.values()], range(len(parts)), "|", color=style.INK, markersize=12, label="99 %"
    )
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set(title="cycles an event, mean", xlabel="cycles", xscale="symlog")
    axes.set_xlim(left=0)
    axes.legend(loc="lower right", fontsize=8)
    style.tidy(axes, grid="x")


def _levels(axes: Axes, one: Judged) -> None:
    """Draw the levels of the FIFOs over time."""
    outcome = one.verdict.outcome
    assert outcome is not None
    milliseconds = outcome.cycles / outcome.clock_hz * 1e3
    for name, level, colour in (
        ("input FIFO", outcome.gauge.input_level(), style.OFF),
        ("output FIFO", outcome.gauge.output_level(), style.MOVER),
    ):
        time = np.linspace(0.0, milliseconds, len(level.most_by_time), endpoint=False)
        axes.step(
            time,
            level.most_by_time,
            where="post",
            color=colour,
            linewidth=1.0,
            label=f"{name}, most {level.high_water:,}",
        )
    axes.set(title="events held, most in each stretch", xlabel="time (ms)", ylabel="events in a FIFO")
    axes.set_ylim(bottom=0)
    ring = outcome.gauge.ring_level()
    beside = axes.twinx()
    time = np.linspace(0.0, milliseconds, len(ring.most_by_time), endpoint=False)
    label = f"ring, most {ring.high_water:,}"
    beside.step(time, ring.most_by_time, where="post", color=style.BEFORE, linewidth=1.0, label=label)
    beside.set_ylabel("entries in the ring", color=style.MUTED)
    beside.set_ylim(bottom=0)
    beside.spines[["top", "left"]].set_visible(False)
    lines = [*axes.get_lines(), *beside.get_lines()]
    axes.legend(lines, [str(line.get_label()) for line in lines], fontsize=8)
    style.tidy(axes)


def _latency(axes: Axes, one: Judged) -> None:
    """Draw how many events were decided within a latency."""
    outcome = one.verdict.outcome
    assert outcome is not None
    nanoseconds = np.sort(outcome.gauge.column("decided") - outcome.gauge.column("arrival")) / outcome.clock_hz * 1e9
    if len(nanoseconds):
        at = np.unique(np.linspace(0, len(nanoseconds) - 1, 2000).astype(np.int64))
        axes.plot(nanoseconds[at], (at + 1) / len(nanoseconds), color=style.RESIDUAL)
        axes.set_xscale("log")
        for share in (0.5, 0.99, 1.0):
            value = float(np.quantile(nanoseconds, share))
            axes.axvline(value, color=style.MUTED, linewidth=0.7, linestyle=":")
            axes.text(
                value,
                0.02,
                f" {share:.0%}: {value:,.0f} ns",
                rotation=90,
                fontsize=7,
                color=style.MUTED,
                va="bottom",
                ha="right",
            )
    axes.set(title="latency from arrival to decision", xlabel="ns", ylabel="share of events", ylim=(0, 1.02))
    style.tidy(axes, grid="both")


def _column(name: str) -> str:
    """Put every kind of memory of an FPGA into one column."""
    return "RAM" if name.startswith("RAM") else name


def _mark(one: Judged) -> str:
    return "✓" if one.verdict.passes else "✗"
