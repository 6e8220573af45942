"""Draw every figure of the thesis, each with the sentence that says how to read it."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from tiegocancel.report.figures import Drawing
from tiegocancel.report.style import STYLE
from tiegocancel.report.thesis.bias import bias, model_error
from tiegocancel.report.thesis.heatmaps import gap_maps, heatmaps, ranking
from tiegocancel.report.thesis.horizons import horizons
from tiegocancel.report.thesis.matches import agreement, displacement
from tiegocancel.report.thesis.modes import gates, polarity
from tiegocancel.report.thesis.pictures import compensation, qualitative
from tiegocancel.report.thesis.space import density, radial, roi
from tiegocancel.study.thesis.qualitative import Panels
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["draw_thesis_figures"]

DPI = 130

_FIGURES: tuple[tuple[str, str, Callable[[ThesisResult], Figure | None], str], ...] = (
    (
        "fig_7_1_horizons", "Fig. 7.1 · Cancellation against the horizon", horizons,
        "Crosses are the thesis's values. Left its protocol: the window is cut out of the recording, so that a "
        "prediction made in its last Δt meets nothing and an event of its first Δt was never predicted; the dashed "
        "line is what that alone allows, and the dashed curve the same protocol told that nothing moves. Right the "
        "same gates without that: led in by what comes before the window, or the warm-up not counted; own "
        "predictions allowed and forbidden, beside zero and reversed motion and what the mover loses.",
    ),
    (
        "fig_7_2_heatmaps", "Fig. 7.2 · Cancellation against both gates", heatmaps,
        "Share of events suppressed (per cent) in the first window. Zero and reversed motion in the third and "
        "fourth row are the controls: where their numbers are those of the second row, the gates cancel and not the "
        "prediction.",
    ),
    (
        "fig_7_2_gap", "Fig. 7.2, questioned · What the controls leave of it", gap_maps,
        "CR minus CR of zero and of reversed motion over all combinations, and where events are labelled the share "
        "of ego events suppressed minus that of the mover’s; the best of the gate that is not drawn. Where a map is "
        "pale, predicting the motion gains nothing.",
    ),
    (
        "table_7_1_ranking", "Table 7.1 · The best combinations", ranking,
        "The ten best of all combinations by CR, with the mean distance of their matches; the controls at the same "
        "combination as marks: a diamond at the end of its bar says that zero motion cancels as much. As printed "
        "the best are those at Δt = 0, where every event meets itself under any motion, the mover’s and noise too.",
    ),
    (
        "fig_7_3_radial", "Fig. 7.3 · Along the radius", radial,
        "Density of events by distance from the centre and share suppressed. Near the centre nothing moves by more "
        "than the gate, and zero motion does as well at any horizon. What the mover loses is by the distance of its "
        "events.",
    ),
    (
        "fig_7_4_roi", "Table 7.2, Fig. 7.4 · Disc against background", roi,
        "CR inside and outside the disc and the gap between them. A gap that zero or reversed motion has as well "
        "shows where edges are, not what moves them.",
    ),
    (
        "fig_7_5_displacement", "Fig. 7.5 · How near the matches are", displacement,
        "A gate bounds the distance of whatever passes it. Chance alone gives two thirds of the gate on average; a "
        "true motion stands out where its matches crowd nearer to 0 than chance and zero motion do.",
    ),
    (
        "fig_7_7_bias", "Fig. 7.7, §8.5 · A wrong motion", bias,
        "CR against the error of ω and of the centre. The cross is the thesis's “below 50 % at 0.05 rad/s”. Dashed "
        "lines are zero motion, dotted ones reversed: where a curve reaches its line, the motion tells nothing any "
        "more. Below, where events are labelled, what the mover loses.",
    ),
    (
        "eq_4_7_model_error", "Eq. (4.7) to (4.9) · How far an error moves predictions", model_error,
        "Lines are exact, dots measured on the predictions of the window; squares are the mean offset of the "
        "matches, ± two deviations, which the gate cuts and chance dilutes. An error of ω grows with the radius, "
        "one of the centre is the same everywhere: 2|sin(ωΔt/2)|·‖Δc‖, a small part of the printed bound ‖Δc‖.",
    ),
    (
        "sec_8_4_polarity", "§8.4 · Polarity", polarity,
        "An edge keeps its polarity, so the anti-event must oppose an event of the predicting event's own polarity. "
        "Read as (4.5) prints it, almost nothing true is left to cancel.",
    ),
    (
        "sec_8_6_density", "§8.6 · Disc over background", density,
        "Excess of the disc's event density over the background's, before and after, beside zero and reversed "
        "motion.",
    ),
    (
        "sec_8_3_gates", "§8.3 · How wide the gate in time must be", gates,
        "Left what the gate suppresses under the true motion, the controls, and of mover and noise; in the middle "
        "what it gains over zero motion by distance from the centre; right the gate with the largest gain and the "
        "one that suffices, beside the rule ε_t ≈ ε_xy/(r|ω|).",
    ),
    (
        "agreement", "The streaming canceller against the reference", agreement,
        "Per event, at the long horizon, own predictions forbidden. The middle bars keep every prediction: the "
        "difference to the right bar is what one cell a pixel costs, the rest comes from deciding at once and in "
        "whole pixels. Dashed: the canceller told that nothing moves, against the same reference; so much they "
        "agree by where events are alone.",
    ),
    (
        "compensation", "Research question 3 · Against motion compensation", compensation,
        "Warping sharpens an image of all events and sends every one of them; cancelling sends few and leaves what "
        "is unexplained. Sharpness relative to the image as it is; costs from one run, logarithmic, with the ratio "
        "to the streaming canceller. The wait of a batch is half its window on average. The fourth image is the "
        "control: what is sent on when the canceller is told that nothing moves.",
    ),
)  # fmt: skip

_PICTURES = (
    ("fig_7_6_before_after", "Fig. 7.6 · Before and after, as printed"),
    ("fig_7_8_failure", "Fig. 7.8 · The failure case, as printed"),
    ("fig_7_6_long_horizon", "Fig. 7.6, questioned · A long horizon, warm-up not counted"),
)


def draw_thesis_figures(result: ThesisResult, folder: Path) -> list[Drawing]:
    """Write a PNG for each figure that the results fill; return them in the order of the thesis."""
    drawings = []
    with rc_context(STYLE):
        for name, title, draw, caption in _FIGURES:
            drawings += _saved(draw(result), folder / f"{name}.png", title, caption)
        for (name, title), panels in zip(_PICTURES, result.pictures, strict=False):
            point = panels.point
            own = "own predictions allowed" if point.own else "own predictions forbidden"
            cut = "window cut out" if point.isolated else "warm-up not counted"
            kept = panels.left_over
            caption = (
                f"Δt = {point.horizon_us / 1000:g} ms, ε_xy = {point.tolerance_px:g} px, ε_t = "
                f"{point.tolerance_us / 1000:g} ms, {own}, {cut}: {panels.ratio:.1%} suppressed{_beside(panels)}. "
                "Adding matched events and their anti-events to an image leaves "
                f"{kept['bilinear']:.0%} of it (nearest pixel: {kept['nearest']:.0%}), because they lie up to a gate "
                "apart: dropping pairs is not the same as adding them (§5.6)."
            )
            drawings += _saved(qualitative(result.bench, panels), folder / f"{name}.png", title, caption)
    return drawings


def _beside(panels: Panels) -> str:
    """Say what a wrong motion suppresses, and what is lost of mover and noise."""
    words = [f"{name} {value:.1%}" for name, value in panels.controls.items() if math.isfinite(value)]
    return f" ({', '.join(words)})" if words else ""


def _saved(figure: Figure | None, path: Path, title: str, caption: str) -> list[Drawing]:
    if figure is None:
        return []
    figure.savefig(path, dpi=DPI)
    return [Drawing(path, title, caption)]
