"""Give every series one colour and one dash, in all figures alike."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter

from tiegocancel.report import style
from tiegocancel.study.thesis.experiments import SERIES
from tiegocancel.study.thesis.results import Curve

__all__ = ["LOOKS", "LOST", "THESIS", "draw_curve", "label_of", "percent_axis"]

THESIS: dict[str, Any] = {"color": style.INK, "marker": "x", "markersize": 7, "linestyle": "none", "label": "thesis"}
"""How the thesis's own values are marked."""

LOST: dict[str, Any] = {"color": style.MOVER, "linestyle": "-.", "linewidth": 1.3}
"""How what an independent mover loses is drawn, where a figure shows one series of it."""

LOOKS: dict[str, dict[str, Any]] = {
    "printed": {"color": style.ON, "linestyle": "-"},
    "printed_zero": {"color": style.ON, "linestyle": "--"},
    "printed_off": {"color": "#e59aa3", "linestyle": "-"},
    "cut": {"color": "#a07850", "linestyle": "-"},
    "own": {"color": "#6fb9b0", "linestyle": "-"},
    "gated": {"color": style.RESIDUAL, "linestyle": "-"},
    "zero": {"color": style.MUTED, "linestyle": "--"},
    "reversed": {"color": style.MUTED, "linestyle": ":"},
    "stream": {"color": style.OFF, "linestyle": "-"},
    "stream_zero": {"color": "#8fb4dd", "linestyle": "--"},
    "stream_reversed": {"color": "#8fb4dd", "linestyle": ":"},
}


def label_of(name: str) -> str:
    """Return a series in words."""
    return SERIES[name].label


def draw_curve(axes: Axes, curve: Curve, name: str, *, label: str | None = None, scale: float = 1e-3) -> None:
    """Draw mean and, of several windows, one standard deviation; ``scale`` turns x into the axis's unit."""
    look = LOOKS[name]
    x = curve.x * scale
    axes.plot(x, curve.y, linewidth=1.6, label=label_of(name) if label is None else label, **look)
    if curve.windows > 1:
        low, high = curve.y - curve.sd, curve.y + curve.sd
        axes.fill_between(x, low, high, color=look["color"], alpha=0.15, linewidth=0)


def percent_axis(axes: Axes, *, top: float = 1.03, grid: str | None = "y") -> None:
    """Show shares as per cent from 0."""
    axes.set_ylim(0, top)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    style.tidy(axes, grid=grid)
