"""Draw CR over both gates (Fig. 7.2) and the ranking of all combinations (Table 7.1)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter
from numpy.typing import NDArray

from tiegocancel.report import style
from tiegocancel.report.thesis.series import LOOKS, label_of
from tiegocancel.study.thesis.experiments import CONTROLS, GRID, SERIES
from tiegocancel.study.thesis.ranking import Combination, beside, rank
from tiegocancel.study.thesis.results import share
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["gap_maps", "heatmaps", "ranking"]

_ROWS = ("printed", "gated", "zero", "reversed", "stream")
_RANKED = ("printed", "gated", "zero", "stream")
_MARKS: dict[str, dict[str, Any]] = {
    "zero motion": {"marker": "D", "color": style.INK},
    "reversed motion": {"marker": "<", "color": style.INK},
    "mover lost": {"marker": "o", "color": style.MOVER},
    "noise lost": {"marker": "o", "color": style.NOISE},
}


def heatmaps(result: ThesisResult) -> Figure | None:
    """Draw a map of ε_xy against ε_t for each series and drawn horizon."""
    chosen = [h for h in result.settings.grid.heatmaps_us if h in result.settings.grid.horizons_us]
    if not chosen:
        return None
    drawn = style.figure(3.4 * len(chosen) + 0.8, 2.05 * len(_ROWS) + 0.4)
    axes = drawn.subplots(len(_ROWS), len(chosen), sharex=True, sharey=True, squeeze=False)
    for line, name in zip(axes, _ROWS, strict=True):
        for panel, horizon_us in zip(line, chosen, strict=True):
            shown = panel.imshow(_map(result, name, horizon_us), cmap="viridis", vmin=0, vmax=1, aspect="auto")
            _write(panel, _map(result, name, horizon_us))
            _gates(panel, result)
        line[0].set_ylabel(f"{_short(name)}\nε_xy (px)")
    for panel, horizon_us in zip(axes[0], chosen, strict=True):
        panel.set_title(f"Δt = {horizon_us / 1000:g} ms")
    for panel in axes[-1]:
        panel.set_xlabel("ε_t (ms)")
    drawn.colorbar(shown, ax=axes, label="events suppressed", format=PercentFormatter(1.0), shrink=0.5)
    return drawn


def gap_maps(result: ThesisResult) -> Figure | None:
    """Draw what is left of CR when a control is taken off, over Δt and each gate (the best of the other).

    A row for zero motion, one for reversed, and where events are labelled one for what the mover loses.
    """
    cubes = [
        (words, _cube(result, "gated", group) - _cube(result, name, taken))
        for words, group, name, taken in (
            ("zero motion", "", "zero", ""),
            ("reversed motion", "", "reversed", ""),
            ("mover lost", "ego_", "gated", "mover_"),
        )
    ]
    cubes = [(words, cube) for words, cube in cubes if np.isfinite(cube).any()]
    if not cubes:
        return None
    # Of a window without a lead, long horizons leave nothing to be drawn.
    drawable = np.flatnonzero(np.isfinite(cubes[0][1]).any(axis=(1, 2)))
    horizons = result.settings.grid.horizons_us[: int(drawable[-1]) + 1]
    cubes = [(words, cube[: len(horizons)]) for words, cube in cubes]
    drawn = style.figure(10.5, 2.5 * len(cubes) + 0.6)
    axes = drawn.subplots(len(cubes), 2, sharex=True, squeeze=False)
    grid = result.settings.grid
    every = max(len(horizons) // 10, 1)
    for panels, (words, cube) in zip(axes, cubes, strict=True):
        filled = np.where(np.isfinite(cube), cube, -np.inf)
        for panel, axis, ticks, label in (
            (panels[0], 2, [f"{value:g}" for value in grid.tolerances_px], "ε_xy (px), best ε_t"),
            (panels[1], 1, [f"{value / 1000:g}" for value in grid.tolerances_us], "ε_t (ms), best ε_xy"),
        ):
            best = filled.max(axis=axis).T
            best[~np.isfinite(best)] = np.nan
            shown = panel.imshow(best, cmap="PuOr_r", vmin=-0.9, vmax=0.9, aspect="auto", origin="lower")
            panel.set_yticks(range(len(ticks)), ticks)
            panel.set_xticks(range(0, len(horizons), every), [f"{h / 1000:g}" for h in horizons[::every]])
            panel.set_ylabel(label)
            of = "ego suppressed" if words == "mover lost" else "CR"
            panel.set_title(f"{of} − {words if words == 'mover lost' else f'CR of {words}'}")
    for panel in axes[-1]:
        panel.set_xlabel("Δt (ms)")
    drawn.colorbar(shown, ax=axes, label="points above the control", format=PercentFormatter(1.0), shrink=0.8)
    return drawn


def ranking(result: ThesisResult) -> Figure:
    """Draw the ten best combinations of each series by CR, with the controls at the same combination as marks."""
    drawn = style.figure(11.0, 6.6)
    axes = drawn.subplots(2, 2, sharex=True).ravel()
    for panel, name in zip(axes, _RANKED, strict=True):
        best = rank(result, name)[:10]
        places = np.arange(len(best))
        words = [f"{h / 1000:g} ms · {px:g} px · {t / 1000:g} ms" for h, px, t, _, _ in best]
        panel.barh(places, [line[3] for line in best], color=LOOKS[name]["color"], height=0.8, alpha=0.6)
        panel.set_yticks(places, words, fontsize=7)
        panel.invert_yaxis()
        for place, line in enumerate(best):
            panel.text(1.04, place, f"{line[3]:.1%}, {line[4] or 0:.2f} px", va="center", fontsize=7)
        controls = _controls(result, name, best)
        # Marks that have the same share lie above each other, not on each other.
        for number, (label, values) in enumerate(controls.items()):
            shift = 0.17 * (number - (len(controls) - 1) / 2)
            panel.scatter(
                values, places + shift, s=26, edgecolors="white", linewidths=0.5, zorder=3, label=label,
                **_MARKS[label],
            )  # fmt: skip
        panel.set_title(_short(name))
        panel.set_xlim(0, 1.35)  # numbers stand to the right of the bars, where no mark covers them
        panel.set_xticks(np.linspace(0, 1, 6))
        panel.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        style.tidy(panel, grid=None)
    for panel in axes[2:]:
        panel.set_xlabel("events suppressed")
    found: dict[str, Any] = {}
    for panel in axes[::-1]:
        found |= dict(zip(*reversed(panel.get_legend_handles_labels()), strict=True))
    if found:
        drawn.legend(list(found.values()), list(found), loc="outside lower center", ncols=len(found), fontsize=7)
    drawn.supylabel("Δt · ε_xy · ε_t", fontsize=9)
    return drawn


def _controls(result: ThesisResult, name: str, best: list[Combination]) -> dict[str, list[float]]:
    """Return what each control has at each combination; controls without a number are left out."""
    found = {}
    for control in CONTROLS.get(name, ()):
        found[f"{SERIES[control].point.motion} motion"] = [beside(result, line, control) for line in best]
    for group in ("mover", "noise"):
        found[f"{group} lost"] = [beside(result, line, name, f"{group}_") for line in best]
    return {label: values for label, values in found.items() if np.isfinite(values).any()}


def _cube(result: ThesisResult, name: str, group: str) -> NDArray[np.float64]:
    """Return the maps of a series over all horizons, float64[Δt, ε_xy, ε_t]."""
    return np.stack([_map(result, name, horizon_us, group) for horizon_us in result.settings.grid.horizons_us])


def _map(result: ThesisResult, name: str, horizon_us: int, group: str = "") -> NDArray[np.float64]:
    """Return the share of a group (CR of all), rows ε_xy, columns ε_t, NaN where nothing was measured."""
    grid = result.settings.grid
    values = np.full((len(grid.tolerances_px), len(grid.tolerances_us)), np.nan)
    for row, tolerance_px in enumerate(grid.tolerances_px):
        for column, tolerance_us in enumerate(grid.tolerances_us):
            point = SERIES[name].point.at(horizon_us=horizon_us, tolerance_px=tolerance_px, tolerance_us=tolerance_us)
            found = result.results.row(point)
            if found is not None:
                values[row, column] = share(found, group)
    return values


def _write(panel: Axes, values: NDArray[np.float64]) -> None:
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "white" if value < 0.6 else style.INK
            panel.text(column, row, f"{100 * value:.0f}", ha="center", va="center", fontsize=8, color=colour)


def _gates(panel: Axes, result: ThesisResult) -> None:
    grid = result.settings.grid
    panel.set_xticks(range(len(grid.tolerances_us)), [f"{value / 1000:g}" for value in grid.tolerances_us])
    panel.set_yticks(range(len(grid.tolerances_px)), [f"{value:g}" for value in grid.tolerances_px])


def _short(name: str) -> str:
    """Name a series in a word or two."""
    words = {
        "printed": "as printed",
        "gated": "eq. (4.4), own off",
        "zero": "zero motion",
        "reversed": "reversed",
        "stream": "streaming",
    }
    return words.get(name, label_of(name) if name in GRID else name)
