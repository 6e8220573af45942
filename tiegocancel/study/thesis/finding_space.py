"""Tell what the residual looks like in space: regions, distances, densities (§7.4 to §7.6, §8.6)."""

from __future__ import annotations

import math
from collections.abc import Callable

from tiegocancel.study.sweep import Row
from tiegocancel.study.thesis.columns import COLUMNS
from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.finding import Finding
from tiegocancel.study.thesis.results import share
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["clutter", "density", "distances", "excess", "gap"]


def gap(result: ThesisResult) -> Finding | None:
    """Compare the gap between disc and background, and who else has it."""
    ours: dict[str, float | None] = {}
    for name in COLUMNS:
        point = base_of(name, result.settings).at(horizon_us=2000)
        inside = result.results.mean(point, lambda row: share(row, "disc_"))
        outside = result.results.mean(point, lambda row: share(row, "background_"))
        ours[name] = None if inside is None or outside is None else inside - outside
    true, zero = ours["gated"], ours["zero"]
    if true is None or zero is None:
        return None
    verdict = (
        f"Zero motion has a gap of {100 * zero:.0f} points too, so the gap shows where edges are dense and not that "
        "ego-motion is told from the rest"
        if zero > 0.5 * true
        else f"Zero motion has {100 * zero:.0f} points only"
    )
    return Finding(
        "Table 7.2, Fig. 7.4", "disc − background, 2 ms", "73.3 points",
        {name: None if gap is None else f"{100 * gap:.0f} points" for name, gap in ours.items()}, verdict + ".",
    )  # fmt: skip


def distances(result: ThesisResult) -> Finding | None:
    """Compare how near matches are with what chance inside the gate gives."""
    settings = result.settings
    ours: dict[str, str | None] = {}
    means = {}
    for name in COLUMNS:
        point = base_of(name, settings).at(horizon_us=2000)
        mean = result.results.mean(point, _number("mean_px"))
        p95 = result.results.mean(point, _number("p95_px"))
        means[name] = mean
        ours[name] = None if mean is None or p95 is None else f"{mean:.2f} / {p95:.2f} px"
    true, zero = means["gated"], means["zero"]
    if true is None or zero is None:
        return None
    gate = settings.point.tolerance_px
    return Finding(
        "§7.5, Fig. 7.5", "match distance, mean / 95 %, 2 ms", "0.8 / 1.5 px", ours,
        f"A gate of {gate:g} px bounds it: chance alone gives {2 * gate / 3:.2f} / {math.sqrt(0.95) * gate:.2f} px, "
        f"zero motion {zero:.2f} px, the true motion {true:.2f} px. “< 5 % beyond 3 px” holds for any gate up to 3 px.",
    )  # fmt: skip


def density(result: ThesisResult) -> Finding | None:
    """Compare the excess of the disc over the background, before and after (§8.6)."""
    settings = result.settings
    ours: dict[str, str | None] = {}
    after = {}
    before = None
    for name in COLUMNS:
        point = base_of(name, settings).at(horizon_us=settings.point.horizon_us)
        before = result.results.mean(point, lambda row: excess(result, row, residual=False))
        after[name] = result.results.mean(point, lambda row: excess(result, row, residual=True))
        value = after[name]
        ours[name] = None if before is None or value is None else f"{before:.1f} → {value:.1f}"
    true, zero = after["gated"], after["zero"]
    if true is None or zero is None:
        return None
    return Finding(
        "§8.6", f"ρ = (N_disc − N_bg)/N_bg, {settings.point.horizon_us / 1000:g} ms", "5.0 → 1.2", ours,
        f"Zero motion brings it to {zero:.1f}, the true motion to {true:.1f}"
        + (": the fall is no evidence of prediction." if abs(zero - true) < 0.25 * abs(true) + 0.1 else "."),
    )  # fmt: skip


def excess(result: ThesisResult, row: Row, *, residual: bool) -> float:
    """Return ρ by density, events a pixel of the disc over that of the background, less one; NaN if that is empty."""
    size = result.bench.windows[0].events
    disc = math.pi * result.bench.radius_px**2
    background = max(size.width * size.height - disc, 1.0)
    counts = [
        float(row[f"{group}events"] - (row[f"{group}suppressed"] if residual else 0))
        for group in ("disc_", "background_")
    ]
    if not counts[1]:
        return float("nan")
    return (counts[0] / disc) / (counts[1] / background) - 1.0


def clutter(result: ThesisResult) -> Finding | None:
    """Compare the median count of a pixel before and after (§7.6)."""
    if not result.pictures:
        return None
    first = result.pictures[0]
    before, after = first.median_count(first.real), first.median_count(first.residual)
    pixels = len(first.real) / (math.pi * result.bench.radius_px**2)
    return Finding(
        "§7.6, Fig. 7.6", "median events of a lit pixel, before → after", "12 → 2",
        {"printed": f"{before:g} → {after:g}"},
        f"The window holds {len(first.real):,} events, {pixels:.2f} for each pixel of the disc: a median of 12 would "
        f"need them all on {len(first.real) / 12:,.0f} pixels.",
    )  # fmt: skip


def _number(name: str) -> Callable[[Row], float]:
    def value(row: Row) -> float:
        found = row[name]
        return float("nan") if found is None else float(found)

    return value
