"""Draw the polarity modes (§8.4) and the sizing of the temporal gate (§8.3)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from tiegocancel.report import style
from tiegocancel.report.thesis.series import LOOKS, LOST, label_of, percent_axis
from tiegocancel.study.thesis.experiments import CONTROLS, MODES, base_of
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
    """Draw CR and what the mover and noise lose in each mode, at both horizons, with zero and reversed motion."""
    chosen = result.settings.point
    groups = [("", "all events")]
    for group, words in (("mover_", "mover lost"), ("noise_", "noise lost")):
        if any(
            _losses(result, "gated", horizon_us, group) for horizon_us in (chosen.horizon_us, chosen.long_horizon_us)
        ):
            groups.append((group, words))
    drawn = style.figure(11.0, 0.4 + 2.6 * len(groups))
    axes = drawn.subplots(len(groups), 2, sharey=True, squeeze=False)
    for line, (group, title) in zip(axes, groups, strict=True):
        for panel, horizon_us in zip(line, (chosen.horizon_us, chosen.long_horizon_us), strict=True):
            for place, name in enumerate(MODES):
                values = _losses(result, name, horizon_us, group) or [None] * len(_MODES)
                shift = 0.21 * (place - (len(MODES) - 1) / 2)
                bars = panel.bar(
                    np.arange(3) + shift, [value or 0.0 for value in values], width=0.2, label=label_of(name),
                    **_bar_look(name),
                )  # fmt: skip
                panel.bar_label(
                    bars, ["–" if value is None else f"{100 * value:.0f}" for value in values], padding=2, fontsize=7
                )
            panel.set_xticks(range(3), [words for _, words in _MODES], fontsize=7)
            panel.set_title(f"{title}, Δt = {horizon_us / 1000:g} ms")
            percent_axis(panel, top=1.12)
    drawn.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(MODES), fontsize=7)
    return drawn


def _losses(result: ThesisResult, name: str, horizon_us: int, group: str) -> list[float | None]:
    """Return the share of a group suppressed in each mode; nothing where no mode has one."""
    base = base_of(name, result.settings).at(horizon_us=horizon_us)
    found = [result.results.mean(base.at(polarity=mode), lambda row: share(row, group)) for mode, _ in _MODES]
    return [] if all(value is None for value in found) else found


def _bar_look(name: str) -> dict[str, Any]:
    """Fill a bar; reversed motion, whose colour is that of zero motion, is hatched."""
    colour = LOOKS[name]["color"]
    if name == "reversed":
        return {"facecolor": "white", "edgecolor": colour, "hatch": "////"}
    return {"facecolor": colour, "edgecolor": colour}


def gates(result: ThesisResult) -> Figure | None:
    """Draw CR and its controls against ε_t, the gap in bands of the radius, and the gate that suffices."""
    sizes = gate_sizes(result)
    if not sizes.bands:
        return None
    drawn = style.figure(12.0, 4.2)
    whole, left, right = drawn.subplots(1, 3)
    _whole(result, whole)
    horizon_ms = result.settings.point.long_horizon_us / 1000
    colours = colormaps["viridis"](np.linspace(0.05, 0.85, len(sizes.bands)))
    for colour, band in zip(colours, sizes.bands, strict=True):
        words = f"r = {band.low_px:.0f}–{band.high_px:.0f} px"
        left.plot(sizes.tolerances_us / 1000, band.gap, color=colour, marker="o", markersize=3, label=words)
    left.axhline(0, color=style.MUTED, linewidth=0.8)
    left.set(title="CR − CR of zero motion, by radius", xlabel="ε_t (ms)")
    left.set_ylabel("points above zero motion")
    left.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    left.set_ylim(top=1.25 * max(float(np.nanmax(band.gap)) for band in sizes.bands))
    left.legend(fontsize=7, loc="upper center", ncols=2)
    style.tidy(left)
    middle = np.array([(band.low_px + band.high_px) / 2 for band in sizes.bands])
    for kind, look in (
        ("formula_us", {"color": style.INK, "linestyle": "--", "label": "ε_xy/(r|ω|)"}),
        ("best_us", {"color": style.RESIDUAL, "marker": "o", "label": "largest gap to zero"}),
        ("enough_us", {"color": style.OFF, "marker": "s", "label": "90 % of the largest CR"}),
    ):
        right.plot(middle, [getattr(band, kind) / 1000 for band in sizes.bands], **look)
    right.set(title="the gate in time that suffices", xlabel="distance from the centre (px)", ylabel="ε_t (ms)")
    right.set_ylim(0, 1.1 * float(sizes.tolerances_us.max()) / 1000)
    right.legend(fontsize=7)
    style.tidy(right)
    whole.set_title(f"streaming, Δt = {horizon_ms:g} ms")
    return drawn


def _whole(result: ThesisResult, panel: Axes) -> None:
    """Draw the share suppressed against ε_t: of all events, under each control, of the mover and of noise."""
    tolerances_us = result.settings.gates.tolerances_us
    lines: list[tuple[str, str, dict[str, Any]]] = [
        (name, "", {"label": label_of(name), **LOOKS[name]}) for name in ("stream", *CONTROLS["stream"])
    ]
    if result.results.labelled:
        lines += [
            ("stream", "mover_", LOST | {"label": "mover lost"}),
            ("stream", "noise_", LOST | {"label": "noise lost", "color": style.NOISE}),
        ]
    for name, group, look in lines:
        base = base_of(name, result.settings).at(horizon_us=result.settings.point.long_horizon_us, detail=True)
        curve = result.results.curve(
            tolerances_us,
            lambda gate_us, base=base: base.at(tolerance_us=int(gate_us)),  # type: ignore[misc]
            lambda row, group=group: share(row, group),  # type: ignore[misc]
        )
        if np.isfinite(curve.y).any():
            panel.plot(curve.x / 1000, curve.y, **look)
    panel.set(xlabel="ε_t (ms)", ylabel="events suppressed")
    percent_axis(panel)
    panel.legend(fontsize=7)
