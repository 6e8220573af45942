"""Draw what an estimator found over time: centre, ω, how sure it was, how sharp the events became."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from numpy.typing import NDArray

from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.report import style

__all__ = ["draw_motion", "motion_figure"]


def draw_motion(path: Path, estimates: Sequence[MotionEstimate], truth: RotationTrajectory | None = None) -> bool:
    """Write :func:`motion_figure` as a PNG file; return whether there was anything to draw."""
    with rc_context(style.STYLE):
        figure = motion_figure(estimates, truth)
        if figure is not None:
            figure.savefig(path, dpi=150)
    return figure is not None


def motion_figure(estimates: Sequence[MotionEstimate], truth: RotationTrajectory | None = None) -> Figure | None:
    """Return ω, centre, deviations and sharpness against time in s since the first row, ``None`` without a centre.

    Bands are two standard deviations; rows that are doubtful, or know no deviation, are grey. Rows that nothing is said
    against choose the scales. ``truth``, where it is known, is drawn beneath. Estimators that make no sharpness have no
    panel of it.
    """
    rows = [estimate for estimate in estimates if estimate.has_center]
    if not rows:
        return None
    start_us = rows[0].t_us
    t_s = np.array([(row.t_us - start_us) * 1e-6 for row in rows])
    sure = np.array([row.confident for row in rows], np.bool_)
    clear = sure & np.array([not row.doubt for row in rows], np.bool_)
    scale = next((rows_ for rows_ in (clear, sure) if rows_.any()), np.ones(len(rows), np.bool_))
    columns = {
        "omega": (np.array([row.omega_rad_s for row in rows]), np.array([row.omega_sigma_rad_s for row in rows])),
        "x": (np.array([row.center_px[0] for row in rows]), np.array([row.center_sigma_px for row in rows])),
        "y": (np.array([row.center_px[1] for row in rows]), np.array([row.center_sigma_px for row in rows])),
    }
    known = None
    if truth is not None:
        cx, cy, omega = truth.at(np.array([row.t_us for row in rows], np.int64))
        known = {"omega": omega, "x": cx, "y": cy}
    sharpness = np.array([row.sharpness for row in rows])
    panels = 5 if np.isfinite(sharpness).any() else 4
    figure = Figure(figsize=(9.0, 1.7 * panels), layout="constrained")
    axes = figure.subplots(panels, 1, sharex=True)
    names = (("omega", "ω (rad/s)"), ("x", "centre x (px)"), ("y", "centre y (px)"))
    for place, (name, label) in zip(axes, names, strict=False):
        value, sigma = columns[name]
        told = sure & np.isfinite(sigma)
        _band(place, t_s, value, sigma, told if told.any() else sure, scale)
        if known is not None:
            place.plot(t_s, known[name], color=style.MUTED, linewidth=1.0, linestyle="--", label="truth")
            place.legend(loc="best", frameon=False)
        place.set_ylabel(label)
    _deviations(axes[3], t_s, columns, sure)
    if panels == 5:
        axes[4].plot(t_s, sharpness, color=style.RESIDUAL, linewidth=1.2)
        axes[4].axhline(1.0, color=style.MUTED, linewidth=0.7, linestyle=":")
        axes[4].set_ylabel("sharpness\n(1 = at rest)")
    axes[-1].set_xlabel("time since the first estimate (s)")
    doubtful = int((~sure).sum())
    axes[0].set_title(
        f"{len(rows):,} estimates, each from what came before; {doubtful:,} doubtful (grey); bands ±2σ", loc="left"
    )
    return figure


def _band(
    axes: Axes,
    t_s: NDArray[np.float64],
    value: NDArray[np.float64],
    sigma: NDArray[np.float64],
    sure: NDArray[np.bool_],
    scale: NDArray[np.bool_],
) -> None:
    """Plot a value with its two standard deviations; doubtful rows in grey. The rows of ``scale`` choose the axis."""
    width = np.where(np.isfinite(sigma), 2.0 * sigma, 0.0)
    axes.fill_between(t_s, value - width, value + width, color=style.RESIDUAL, alpha=0.18, linewidth=0)
    axes.plot(t_s, value, color=style.MUTED, linewidth=0.8)
    axes.plot(t_s, np.where(sure, value, np.nan), color=style.RESIDUAL, linewidth=1.4)
    scale = scale & np.isfinite(sigma) if (scale & np.isfinite(sigma)).any() else scale
    low, high = np.percentile(value[scale], (1, 99))
    edge = max(0.25 * (high - low), 0.01 * abs(high), 1e-3, 3.0 * float(np.median(width[scale])))
    axes.set_ylim(low - edge, high + edge)


def _deviations(
    axes: Axes,
    t_s: NDArray[np.float64],
    columns: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]],
    sure: NDArray[np.bool_],
) -> None:
    """Plot the standard deviations on a logarithmic scale: of ω as a share of its median, of the centre in px."""
    omega, sigma = columns["omega"]
    usual = max(float(np.median(np.abs(omega))), 1e-3)  # not of each ω: that passes through 0
    curves = (
        (100.0 * sigma / usual, style.RESIDUAL, f"ω (% of {usual:.3g} rad/s)"),
        (columns["x"][1], style.MOVER, "centre (px)"),
    )
    for value, color, label in curves:
        known = np.isfinite(value) & sure & (value > 0.0)
        if known.any():
            axes.plot(t_s, np.where(known, value, np.nan), color=color, linewidth=1.2, label=label)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("standard\ndeviation")
    if axes.lines:
        axes.legend(loc="best", frameon=False, ncols=2)
