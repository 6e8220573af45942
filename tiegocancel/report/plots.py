"""Draw the numbers of a run: controls, radial profile, match residuals, rate."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from tiegocancel.estimation.diagnosis.diagnose import Diagnosis
from tiegocancel.metrics.residual_profile import ResidualProfile
from tiegocancel.report import style
from tiegocancel.study.controls import CONTROLS
from tiegocancel.study.result import RunResult

__all__ = ["controls", "displacement", "radial_profile", "rate", "residual_profile"]


def controls(result: RunResult) -> Figure | None:
    """Draw the share suppressed under the motion and under each control; ego beside mover where labelled."""
    if not result.controls:
        return None
    tallies = {"motion given": result.tally} | {CONTROLS[name].label: tally for name, tally in result.controls.items()}
    names = list(tallies)
    labelled = result.tally.labelled
    drawn = style.figure(10.5, 2.9)
    panels = drawn.subplots(1, 2 if labelled else 1, squeeze=False)[0]
    bars = panels[0].bar(
        names,
        [tally.share(on_disc=result.lead_region).ratio for tally in tallies.values()],
        width=0.6,
        color=[style.RESIDUAL] + [style.BEFORE] * (len(names) - 1),
    )
    panels[0].bar_label(bars, fmt=lambda value: f"{value:.1%}", padding=2, fontsize=8)
    panels[0].set_title("suppressed on the disc" if result.lead_region else "suppressed everywhere")
    if labelled:
        place = np.arange(len(names))
        for shift, label, colour in ((-0.2, "ego", style.EGO), (0.2, "mover", style.MOVER)):
            shares = [(tally.selectivity() or {})[label] or 0.0 for tally in tallies.values()]
            bars = panels[1].bar(place + shift, shares, width=0.38, color=colour, label=label)
            panels[1].bar_label(bars, fmt=lambda value: f"{value:.0%}", padding=2, fontsize=7)
        panels[1].set_xticks(place, names)
        panels[1].set_title("suppressed by cause")
        panels[1].legend(loc="upper right", ncols=2)
    for panel in panels:
        panel.set_ylim(0, 1.08)
        panel.yaxis.set_major_formatter(PercentFormatter(1.0))
        style.tidy(panel)
    return drawn


def radial_profile(result: RunResult) -> Figure | None:
    """Draw density before and after and the share suppressed, by distance from the centre (thesis, Fig. 7.3)."""
    area, events, residual = result.tally.radial()
    seen = area > 0
    if not events.any():
        return None
    edges = result.region.ring_edges_px
    middle = ((edges[1:] + edges[:-1]) / 2)[seen]
    drawn = style.figure(10.5, 3.2)
    left, right = drawn.subplots(1, 2)
    for counts, colour, name in ((events, style.BEFORE, "all events"), (residual, style.RESIDUAL, "residual")):
        density = counts[seen] / area[seen]
        left.plot(middle, density, color=colour, label=name, linewidth=1.6)
        left.fill_between(middle, density, color=colour, alpha=0.15, linewidth=0)
    left.set(title="density", xlabel="distance from the centre (px)", ylabel="events a pixel", ylim=(0, None))
    left.legend()
    enough = events[seen] >= 50
    share = np.full(len(middle), np.nan)  # gaps where rings are too empty to tell
    share[enough] = 1 - residual[seen][enough] / events[seen][enough]
    right.plot(middle, share, color=style.RESIDUAL, linewidth=1.6)
    right.set(
        title="share suppressed (rings of 50 events or more)", xlabel="distance from the centre (px)", ylim=(0, 1.02)
    )
    right.yaxis.set_major_formatter(PercentFormatter(1.0))
    for panel in (left, right):
        panel.set_xlim(max(0.0, middle[0] - 4), min(middle[-1], max(1.6 * result.region.radius_px, middle[0] + 16)))
        panel.axvline(result.region.radius_px, color=style.MUTED, linestyle="--", linewidth=0.8)
        style.tidy(panel)
    return drawn


def displacement(result: RunResult) -> Figure | None:
    """Draw the matches by offset and by lateness (thesis, §7.5)."""
    found = result.displacement
    total = int(found.by_offset.sum())
    if not total:
        return None
    drawn = style.figure(10.5, 3.2)
    left, right = drawn.subplots(1, 2, width_ratios=(1, 2))
    reach = found.reach_px + 0.5
    share = found.by_offset / total
    shown = left.imshow(share, cmap="Greens", extent=(-reach, reach, reach, -reach), vmin=0)
    if found.side <= 7:
        for (row, column), value in np.ndenumerate(share):
            if value:
                dark = value > 0.6 * share.max()
                left.text(
                    column - found.reach_px, row - found.reach_px, f"{value:.0%}", ha="center", va="center",
                    fontsize=7, color="white" if dark else style.INK,
                )  # fmt: skip
    else:
        drawn.colorbar(shown, ax=left, format=PercentFormatter(1.0))
    left.set(title="event − prediction (px)", xlabel="dx", ylabel="dy")
    edges = found.lateness_edges_us
    right.bar(
        edges[:-1], found.by_lateness / total, width=np.diff(edges), align="edge", color=style.RESIDUAL, alpha=0.85
    )
    right.axvline(0, color=style.MUTED, linewidth=0.8)
    right.set(title="event − prediction (µs)", xlabel="lateness (µs)", xlim=(edges[0], edges[-1]))
    right.yaxis.set_major_formatter(PercentFormatter(1.0))
    style.tidy(right)
    return drawn


def rate(result: RunResult) -> Figure | None:
    """Draw the event rate before and after, over the whole stream."""
    seconds, before, after = result.rate.series()
    drawn = style.figure(10.5, 2.8)
    axes = drawn.subplots()
    edges_ms = np.append(seconds, seconds[-1] + result.rate.bin_us * 1e-6) * 1000
    factor, unit = (1e6, "Mev/s") if before.max() >= 1e6 else (1e3, "kev/s")
    for rates, colour, name in ((before, style.BEFORE, "all events"), (after, style.RESIDUAL, "residual")):
        axes.stairs(rates / factor, edges_ms, color=colour, label=name, linewidth=1.2)
        axes.stairs(rates / factor, edges_ms, color=colour, alpha=0.2, fill=True)
    warm_up_ms = result.settings.cancel.warm_up_us / 1000
    axes.axvspan(0, min(warm_up_ms, edges_ms[-1]), color=style.GRID, alpha=0.7, linewidth=0)
    axes.set(xlabel="time since the first event (ms)", ylabel=unit, ylim=(0, None), xlim=(0, edges_ms[-1]))
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1)
    style.tidy(axes)
    return drawn


def residual_profile(profile: ResidualProfile, diagnosis: Diagnosis | None = None) -> Figure | None:
    """Draw where events met their predictions by distance from the centre, along the ring and outward (§3.6 (5)).

    With a diagnosis, its rings and its model beside them: the turn that a wrong ω makes, the move that a wrong centre
    makes. Its words are the title.
    """
    seen = profile.count >= 50
    if not seen.any():
        return None
    middle = ((profile.ring_edges_px[1:] + profile.ring_edges_px[:-1]) / 2)[seen]
    drawn = style.figure(10.5, 3.4)
    left, right = drawn.subplots(1, 2, sharey=True)
    for panel, mean, spread, name in (
        (left, profile.tangential_px, profile.tangential_spread_px, "along the ring"),
        (right, profile.radial_px, profile.radial_spread_px, "outward"),
    ):
        panel.plot(middle, mean[seen], color=style.RESIDUAL, linewidth=1.6, label=f"matches, {name}: mean ± spread")
        low, high = (mean + sign * spread for sign in (-1, 1))
        panel.fill_between(middle, low[seen], high[seen], color=style.RESIDUAL, alpha=0.15, linewidth=0)
    if diagnosis is not None and diagnosis.kind != "unknown":
        turn = (diagnosis.omega_rad_s - diagnosis.omega_bias_rad_s) * diagnosis.horizon_us * 1e-6
        shrink, sine = 1.0 - math.cos(turn), math.sin(turn)
        x, y = diagnosis.center_bias_px
        turned = -diagnosis.omega_bias_rad_s * diagnosis.horizon_us * 1e-6 * middle
        left.plot(middle, turned, color=style.INK, linestyle="--", linewidth=1.0, label="model: wrong ω")
        radius = [ring.radius_px for ring in diagnosis.rings]
        marks = {"fmt": "o", "markersize": 3.5, "capsize": 2}
        left.errorbar(
            radius, [ring.turning_px for ring in diagnosis.rings], [ring.turning_sigma_px for ring in diagnosis.rings],
            color=style.INK, label="all pairs, turning", **marks,
        )  # fmt: skip
        flats = ((-shrink * x - sine * y, style.ON, "right", "x"), (sine * x - shrink * y, style.OFF, "down", "y"))
        for value, colour, way, axis in flats:
            right.axhline(value, color=colour, linestyle="--", linewidth=1.0, label=f"model: wrong centre, {axis}")
            right.errorbar(
                radius, [getattr(ring, f"{way}_px") for ring in diagnosis.rings],
                [ring.flat_sigma_px for ring in diagnosis.rings], color=colour, label=f"all pairs, {axis}", **marks,
            )  # fmt: skip
    if diagnosis is not None:
        drawn.suptitle(diagnosis.text, fontsize=9, x=0.01, ha="left")
    left.set(title="along the ring: a wrong ω grows with the radius", ylabel="event − prediction (px)")
    right.set(title="the same all round: a wrong centre")
    for panel in (left, right):
        panel.set(xlabel="distance from the centre (px)", xlim=(max(0.0, middle[0] - 4), middle[-1] + 4))
        panel.axhline(0, color=style.MUTED, linewidth=0.8)
        panel.legend(fontsize=7, ncols=2)
        style.tidy(panel)
    return drawn
