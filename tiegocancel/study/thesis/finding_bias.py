"""Tell what errors of the motion can do, and what they do (§7.7, §7.8, §8.4)."""

from __future__ import annotations

import math

from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.finding import Finding, percent
from tiegocancel.study.thesis.study import ThesisResult

__all__ = ["adaptive", "center_bias", "omega_bias", "polarity"]


def omega_bias(result: ThesisResult) -> Finding | None:
    """Say what 0.05 rad/s can do at all."""
    bench, settings = result.bench, result.settings
    horizon_us = settings.point.horizon_us
    ours: dict[str, str | None] = {}
    values = {}
    for name in ("gated", "stream"):
        point = base_of(name, settings).at(horizon_us=horizon_us)
        values[name] = [result.results.mean(point.at(omega_bias_rad_s=bias)) for bias in (0.0, 0.05)]
        ours[name] = " → ".join(percent(value) for value in values[name])
    moved = bench.radius_px * 0.05 * horizon_us * 1e-6
    halves = _bias_that_halves(result, horizon_us)
    verdict = (
        f"0.05 rad/s move a prediction at the rim by {moved:.3f} px within {horizon_us / 1000:g} ms, "
        f"1/{settings.point.tolerance_px / max(moved, 1e-12):,.0f} of the gate: it cannot show, and it does not"
    )
    verdict += f"; CR halves at {halves:g} rad/s" if halves else "; no error that was tried halves CR"
    return Finding("§7.7, Fig. 7.7", f"CR at Δω = 0.05 rad/s, {horizon_us / 1000:g} ms", "< 50 %", ours, verdict + ".")


def _bias_that_halves(result: ThesisResult, horizon_us: int) -> float | None:
    """Return the smallest Δω that was tried under which CR is half of what it is without."""
    point = base_of("gated", result.settings).at(horizon_us=horizon_us)
    best = result.results.mean(point)
    for bias in sorted(result.settings.bias.omega_rad_s):
        value = result.results.mean(point.at(omega_bias_rad_s=bias))
        if best is not None and value is not None and value < 0.5 * best:
            return bias
    return None


def center_bias(result: ThesisResult) -> Finding | None:
    """Say what 5 px of the centre can do at all."""
    bench, settings = result.bench, result.settings
    horizon_us = settings.point.horizon_us
    omega = abs(float(bench.motion.mean(start_us=bench.windows[0].start_us, stop_us=bench.windows[0].stop_us)[1]))
    moved = 2 * math.sin(0.5 * omega * horizon_us * 1e-6) * 5.0
    ours: dict[str, str | None] = {}
    for name in ("gated", "stream"):
        point = base_of(name, settings).at(horizon_us=horizon_us)
        found = [result.results.mean(point.at(center_bias_px=bias)) for bias in (0.0, 5.0)]
        if found[1] is None:
            return None
        ours[name] = " → ".join(percent(value) for value in found)
    return Finding(
        "§7.8, §7.9", f"centre error beyond 5 px breaks it, {horizon_us / 1000:g} ms", "< 5 px", ours,
        f"5 px move every prediction by 2|sin(ωΔt/2)|·5 = {moved:.3f} px, at every radius alike: the printed bound "
        f"(4.8) is {5.0 / max(moved, 1e-9):,.0f} times that.",
    )  # fmt: skip


def polarity(result: ThesisResult) -> Finding | None:
    """Compare the modes."""
    settings = result.settings
    ours: dict[str, str | None] = {}
    values = {}
    for name in ("gated", "zero", "reversed", "stream"):
        point = base_of(name, settings).at(horizon_us=settings.point.long_horizon_us)
        three = [result.results.mean(point.at(polarity=mode)) for mode in ("opposite", "equal", "ignore")]
        values[name] = three
        ours[name] = " / ".join(percent(value) for value in three)
    own, other, any_ = values["gated"]
    if own is None or other is None or any_ is None:
        return None
    return Finding(
        "§8.4", f"opposite / as (4.5) prints it / ignored, {settings.point.long_horizon_us / 1000:g} ms",
        "enforcing costs 5–10 %", ours,
        f"Enforcing costs {100 * (any_ - own):.1f} points; read as (4.5) prints it, p_j = −p_i, it leaves "
        f"{percent(other)}: an edge keeps its polarity.",
    )  # fmt: skip


def adaptive(result: ThesisResult) -> Finding | None:
    """Compare the gate that grows with the radius (5.5) with the fixed one, by what zero motion leaves."""
    settings = result.settings
    horizon_us = settings.point.long_horizon_us
    ours: dict[str, str | None] = {}
    values = {}
    for name in ("gated", "zero"):
        point = base_of(name, settings).at(horizon_us=horizon_us)
        values[name] = [result.results.mean(point.at(adaptive=grows)) for grows in (False, True)]
        ours[name] = " → ".join(percent(value) for value in values[name])
    (fixed, grown), (still, still_grown) = values["gated"], values["zero"]
    if fixed is None or grown is None or still is None or still_grown is None:
        return None
    before, after = fixed - still, grown - still_grown
    word = "gains" if after > before + 0.01 else ("loses" if after < before - 0.01 else "changes nothing in")
    return Finding(
        "§5.5, (5.5)", f"fixed → adaptive spatial gate, {horizon_us / 1000:g} ms", "“optional”, no figure", ours,
        f"The adaptive gate {word} distance to zero motion: {100 * before:.0f} points with the fixed gate, "
        f"{100 * after:.0f} with it.",
    )  # fmt: skip
