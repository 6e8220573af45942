"""Put the thesis's figures beside ours, with a sentence that follows from the numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tiegocancel.study.thesis.claims import HEADLINES, RATIOS, RatioClaim
from tiegocancel.study.thesis.columns import COLUMNS, counted
from tiegocancel.study.thesis.experiments import GRID, base_of
from tiegocancel.study.thesis.finding import MATTERS, Finding, against_control, percent
from tiegocancel.study.thesis.finding_bias import adaptive, center_bias, omega_bias, polarity
from tiegocancel.study.thesis.finding_space import clutter, density, distances, gap
from tiegocancel.study.thesis.fits import cut_law, fit_decay
from tiegocancel.study.thesis.ranking import rank, rank_gaps
from tiegocancel.study.thesis.results import share
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["summarise"]

_CLOSE = 0.10
_HALF_LIFE_MS = 3.5


def summarise(result: ThesisResult) -> list[Finding]:
    """Return the findings in the order of the thesis."""
    lines = [_ratio(result, claim) for claim in RATIOS]
    extra = (
        _headline(result), _half_life(result), _ranking(result), gap(result), distances(result), omega_bias(result),
        center_bias(result), polarity(result), adaptive(result), density(result), clutter(result),
    )  # fmt: skip
    return [line for line in (*lines, *extra) if line is not None]


def _ratio(result: ThesisResult, claim: RatioClaim) -> Finding | None:
    """Compare one ratio across the series."""
    results, settings = result.results, result.settings
    gates = {}
    if claim.tolerance_px is not None:
        gates = {"tolerance_px": claim.tolerance_px, "tolerance_us": claim.tolerance_us}
    ours: dict[str, float | None] = {
        name: results.mean(
            base_of(name, settings).at(horizon_us=claim.horizon_us, **gates),
            lambda row, name=name: share(row, claim.group, counted(name)),  # type: ignore[misc]
        )
        for name in COLUMNS
    }
    if all(value is None for value in ours.values()):
        return None
    length_us = result.bench.windows[0].stop_us - result.bench.windows[0].start_us
    cut = base_of("cut", settings).at(horizon_us=claim.horizon_us, **gates)
    readings = {
        f"the gate of (4.4), windows cut out and {words}": results.mean(
            cut,
            lambda row, count=count: share(row, claim.group, count),  # type: ignore[misc]
        )
        for count, words in (("suppressed", "each event counted once"), ("pairs", "both events of a pair counted"))
    }
    return Finding(
        claim.where,
        claim.what,
        percent(claim.value),
        {name: None if value is None else percent(value) for name, value in ours.items()},
        _ratio_verdict(claim, ours, readings, length_us),
    )


def _ratio_verdict(
    claim: RatioClaim, ours: dict[str, float | None], readings: dict[str, float | None], length_us: int
) -> str:
    """Say whether it is reproduced, and what makes it."""
    words = []
    printed, off, true, zero = (ours[name] for name in ("printed", "printed_off", "gated", "zero"))
    if printed is not None:
        words.append(_reproduced(claim.value, printed, readings))
        if off is not None and printed - off >= MATTERS:
            words.append(f"{100 * (printed - off):.0f} points are events that meet their own predictions")
    allowed = float(cut_law(np.array([float(claim.horizon_us)]), length_us)[0])
    if claim.horizon_us and allowed < 1.0 and true is not None and true - claim.value > _CLOSE:
        words.append(
            f"a window of {length_us / 1000:g} ms that is cut out allows {percent(allowed)} at most; without "
            f"the warm-up the same gates cancel {percent(true)}"
        )
    if true is not None and zero is not None:
        words.append(against_control(true, zero))
    return "; ".join(words) + "." if words else "Nothing to compare: the recording is too short for this horizon."


def _reproduced(value: float, printed: float, readings: dict[str, float | None]) -> str:
    """Say which reading of the thesis gives its number, if one does."""
    gap = printed - value
    if abs(gap) <= _CLOSE:
        return f"Reproduced as printed ({100 * gap:+.0f} points)"
    gaps = {words: found - value for words, found in readings.items() if found is not None}
    nearest = min(gaps, key=lambda words: abs(gaps[words]), default=None)
    if nearest is not None and abs(gaps[nearest]) <= _CLOSE:
        return f"Not by Algorithm 1 as printed ({100 * gap:+.0f} points), but by {nearest} ({100 * gaps[nearest]:+.0f})"
    return f"Reproduced by no reading ({100 * gap:+.0f} points as printed)"


def _headline(result: ThesisResult) -> Finding:
    """Name the three values of one headline."""
    series = ("printed", "gated", "zero", "reversed", "stream")
    best = {name: _best(result, name) for name in series}
    values = ", ".join(f"{percent(value)} ({where})" for where, value in HEADLINES)
    spread = max(value for _, value in HEADLINES) - min(value for _, value in HEADLINES)
    verdict = f"The thesis gives one result three values, {100 * spread:.0f} points apart"
    if best["gated"] is not None and best["zero"] is not None:
        verdict += f"; at 1–2 ms {against_control(best['gated'], best['zero'])}"
    return Finding(
        "abstract, §7, §10",
        "best CR at short horizons",
        values,
        {n: percent(v) for n, v in best.items()},
        verdict + ".",
    )


def _best(result: ThesisResult, name: str) -> float | None:
    """Return the best mean CR of a series from 1 to 2 ms."""
    horizons = [h for h in result.settings.grid.horizons_us if 1000 <= h <= 2000]
    found = [result.results.mean(base_of(name, result.settings).at(horizon_us=h)) for h in horizons]
    return max((value for value in found if value is not None), default=None)


def _half_life(result: ThesisResult) -> Finding:
    """Compare the decay with what cutting the window does by itself."""
    horizons = result.settings.grid.horizons_us
    ours: dict[str, str | None] = {}
    fits = {}
    for name in COLUMNS:
        curve = result.results.curve(
            horizons,
            lambda h, name=name: base_of(name, result.settings).at(horizon_us=int(h)),  # type: ignore[misc]
        )
        fits[name] = fit_decay(curve)
        fit = fits[name]
        ours[name] = None if fit is None else ("none" if math.isinf(fit.half_ms) else f"{fit.half_ms:.1f} ms")
    length_us = result.bench.windows[0].stop_us - result.bench.windows[0].start_us
    verdict = "The exponential is no property of the method"
    true, cut = fits["gated"], fits["printed"]
    if true is None or cut is None:
        verdict = "Too few horizons to fit"
    elif math.isinf(true.half_ms) or true.half_ms > 5 * cut.half_ms:
        slow = "no decay at all" if math.isinf(true.half_ms) else f"a half-life of {true.half_ms:.0f} ms"
        verdict += (
            f": without the warm-up the curve shows {slow}; cut out, a window of {length_us / 1000:g} ms "
            "falls as 1 − Δt/T whatever the motion"
        )
    else:
        verdict = f"Without the warm-up the half-life is {true.half_ms:.1f} ms"
    still = fits["zero"]
    if still is not None and abs(still.half_ms - _HALF_LIFE_MS) <= 0.15 * _HALF_LIFE_MS:
        verdict += f"; a half-life of {still.half_ms:.1f} ms is what zero motion has"
    return Finding("§7.1, §7.9", "half-life τ½ of CR(Δt)", "3.5 ms", ours, verdict + ".")


def _ranking(result: ThesisResult) -> Finding | None:
    """Tell what the best combination is, by CR and by the gap to zero motion."""
    ours: dict[str, str | None] = {}
    for name in GRID:
        if name in COLUMNS:
            best = rank(result, name)
            ours[name] = None if not best else _combination(best[0])
    gaps = rank_gaps(result)
    if not gaps:
        return None
    return Finding(
        "Table 7.1, §7.2",
        "best combination (Δt, ε_xy, ε_t)",
        "text: 1–2 ms, 2–3 px, 1 ms; table: 0 ms",
        ours,
        f"By CR the winner is {ours.get('gated') or '–'}; by the gap to zero motion it is {_combination(gaps[0])}, "
        f"{100 * gaps[0][3]:.0f} points.",
    )


def _combination(line: Sequence[float | None]) -> str:
    horizon_us, tolerance_px, tolerance_us, value = line[:4]
    assert horizon_us is not None
    assert tolerance_us is not None
    return f"{horizon_us / 1000:g} ms, {tolerance_px:g} px, {tolerance_us / 1000:g} ms: {percent(value)}"
