"""Give every figure and page one look."""

from __future__ import annotations

from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

__all__ = [
    "BEFORE",
    "EGO",
    "INK",
    "MOVER",
    "MUTED",
    "NOISE",
    "OFF",
    "ON",
    "RESIDUAL",
    "SIGNED",
    "STYLE",
    "figure",
    "tidy",
]

INK, MUTED, GRID = "#1d232b", "#6b7480", "#e4e7eb"
ON, OFF = "#c8374a", "#2563ab"
BEFORE, RESIDUAL = "#9aa5b1", "#0f766e"
EGO, MOVER, NOISE = "#7b8794", "#d97706", "#8b5cf6"

SIGNED = LinearSegmentedColormap.from_list("signed", [OFF, "#8fb4dd", "#ffffff", "#eba0a9", ON])
"""Colours of signed counts: OFF blue, ON red, nothing white."""

STYLE: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "legend.frameon": False,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
}


def figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure in the house style; no global state of pyplot is touched."""
    with rc_context(STYLE):
        return Figure(figsize=(width_in, height_in), layout="constrained")


def tidy(axes: Axes, *, grid: str | None = "y") -> None:
    """Remove the frame that carries nothing; ``grid`` names the axis with grid lines."""
    axes.spines[["top", "right"]].set_visible(False)
    if grid is not None:
        axes.grid(axis=grid, color=GRID, linewidth=0.8)  # type: ignore[arg-type]
        axes.set_axisbelow(True)
