"""Draw what a wrong motion costs (Fig. 7.7, §8.5) and how far it moves predictions (eq. 4.7 to 4.9)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tiegocancel.report import style
from tiegocancel.report.thesis.series import THESIS, percent_axis
from tiegocancel.study.sweep import Row
from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.model_error import ErrorCurve
from tiegocancel.study.thesis.results import Curve, share
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["bias", "model_error"]

_COLOURS = (style.RESIDUAL, style.OFF, style.NOISE, style.MOVER)


def bias(result: ThesisResult) -> Figure:
    """Draw CR against the error of ω and of the centre, a curve for each horizon, its controls as lines.

    Where events are labelled, a second row draws what the mover loses.
    """
    settings = result.settings
    groups = [("", "events suppressed")] + ([("mover_", "mover lost")] if result.results.labelled else [])
    drawn = style.figure(11.0, 1.2 + 3.1 * len(groups))
    axes = drawn.subplots(len(groups), 2, sharex="col", sharey=True, squeeze=False)
    for (left, right), (group, words) in zip(axes, groups, strict=True):
        for colour, horizon_us in zip(_COLOURS, settings.bias.horizons_us, strict=False):
            _biased(result, left, horizon_us, colour, "omega_bias_rad_s", group)
            _biased(result, right, horizon_us, colour, "center_bias_px", group)
        left.set_ylabel(words)
        percent_axis(left)
        percent_axis(right)
    left, right = axes[0]
    left.plot([0.05], [0.5], **THESIS)
    left.plot([], [], color=style.MUTED, linestyle="-.", label="ω too small instead of too large")
    left.plot([], [], color=style.MUTED, linestyle="--", label="zero motion at that Δt")
    left.plot([], [], color=style.MUTED, linestyle=":", label="reversed motion at that Δt")
    left.set_title("a wrong angular velocity")
    right.set_title("a wrong centre")
    left, right = axes[-1]
    left.set_xscale("symlog", linthresh=0.05)
    right.set_xscale("symlog", linthresh=1.0)
    left.set_xlim(0, 60)
    right.set_xlim(0, 100)
    left.set_xticks([0, 0.05, 0.5, 5, 50], ["0", "0.05", "0.5", "5", "50"])
    right.set_xticks([0, 1, 10, 80], ["0", "1", "10", "80"])
    left.set_xlabel("|Δω| (rad/s); 50 rad/s = 0.05 rad/ms")
    right.set_xlabel("‖Δc‖ (px)")
    drawn.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=7, fontsize=7)
    return drawn


def _biased(result: ThesisResult, panel: Axes, horizon_us: int, colour: str, field: str, group: str) -> None:
    """Draw one horizon: errors of either sign of ω (one of the centre), zero and reversed motion."""
    settings = result.settings

    def value(row: Row) -> float:
        return share(row, group)

    turns = field == "omega_bias_rad_s"
    sizes = settings.bias.omega_rad_s if turns else settings.bias.center_px
    base = base_of("gated", settings).at(horizon_us=horizon_us)
    for sign in (1.0, -1.0) if turns else (1.0,):
        # Zero has one sign only, or it would be another point.
        curve = result.results.curve(sizes, lambda size, sign=sign: base.at(**{field: sign * size or 0.0}), value)  # type: ignore[misc]
        words = f"Δt = {horizon_us / 1000:g} ms" if sign > 0 else None
        _line(panel, curve, colour, "-" if sign > 0 else "-.", words)
    for name, dash in (("zero", "--"), ("reversed", ":")):
        control = result.results.mean(base_of(name, settings).at(horizon_us=horizon_us), value)
        if control is not None:
            panel.axhline(control, color=colour, linewidth=0.9, linestyle=dash)


def model_error(result: ThesisResult) -> Figure | None:
    """Draw px moved by radius: measured on predictions and on matches, exact, and as printed."""
    if result.errors is None:
        return None
    drawn = style.figure(11.0, 3.8)
    left, right = drawn.subplots(1, 2)
    for panel, curves, unit, title in (
        (left, result.errors.omega, "rad/s", "a wrong ω: 2r|sin(ΔωΔt/2)| (4.7)"),
        (right, result.errors.center, "px", "a wrong centre: 2|sin(ωΔt/2)|·‖Δc‖, where (4.8) prints ‖Δc‖"),
    ):
        for colour, curve in zip(_COLOURS, curves, strict=False):
            _error(panel, curve, colour, unit)
        panel.set(title=title, xlabel="distance from the centre (px)", ylim=(0, None))
        panel.legend(fontsize=6.5, loc="upper left")
        style.tidy(panel)
    top = max(float(np.nanmax(curve.exact)) for curve in result.errors.center)
    right.set_ylim(0, 1.9 * top)
    left.set_ylim(0, 1.6 * max(float(np.nanmax(curve.exact)) for curve in result.errors.omega))
    horizon_ms = result.errors.omega[0].horizon_us / 1000
    left.set_ylabel(f"px moved within Δt = {horizon_ms:g} ms")
    return drawn


def _line(panel: Axes, curve: Curve, colour: str, dash: str, words: str | None) -> None:
    if not np.isfinite(curve.y).any():
        return
    panel.plot(curve.x, curve.y, color=colour, linestyle=dash, linewidth=1.5, label=words)
    if dash == "-" and curve.windows > 1:
        panel.fill_between(curve.x, curve.y - curve.sd, curve.y + curve.sd, color=colour, alpha=0.15, linewidth=0)


def _error(panel: Axes, curve: ErrorCurve, colour: str, unit: str) -> None:
    words = f"{curve.size:g} {unit}"
    panel.plot(curve.radius_px, curve.exact, color=colour, linewidth=1.4, label=f"{words}: exact")
    panel.plot(
        curve.radius_px, curve.predictions, color=colour, marker="o", markersize=4, linestyle="none",
        label=f"{words}: predictions, measured",
    )  # fmt: skip
    panel.errorbar(
        curve.radius_px, curve.matched, 2 * curve.sigma, color=colour, marker="s", markersize=3.5, linestyle="none",
        fillstyle="none", capsize=2, label=f"{words}: matches (through the gate)",
    )  # fmt: skip
