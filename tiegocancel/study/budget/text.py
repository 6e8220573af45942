"""Print verdicts for a terminal: one part at length, several as a table."""

from __future__ import annotations

import math

from tiegocancel.study.budget.judge import Judged

__all__ = ["comparison", "verdict_text"]


def verdict_text(one: Judged) -> str:
    """Return one part's verdict: constraints, cycles, memory, changes."""
    verdict, outcome = one.verdict, one.verdict.outcome
    lines = [
        f"{verdict.target}: {_sentence(one)}",
        f"  {verdict.design}; {verdict.clock_hz * 1e-6:.4g} MHz",
        "",
        f"  {'constraint':<22}{'need':>14}{'have':>14} {'':<9}{'margin':>8}  verdict",
    ]
    for row in verdict.constraints:
        mark = " <- binds" if row is verdict.binding else ""
        note = f"  ({row.note})" if row.note else ""
        lines.append(
            f"  {row.name:<22}{_number(row.need):>14}{_number(row.have):>14} {row.unit:<9}{_margin(row.margin):>8}  "
            f"{row.verdict}{mark}{note}"
        )
    if outcome is not None:
        lines += ["", *_pace_lines(one)]
    lines += ["", f"  {'memory':<14}{'words':>9}{'bits':>6}{'total bits':>12}  placed"]
    for part in _merged(verdict.memory):
        placed = f"{part['blocks']} {part['kind']} {part['mode']}" if part["blocks"] else str(part["kind"])
        lines.append(
            f"  {part['name']:<14}{part['words']:>9,}{part['width_bits']:>6}{part['bits']:>12,}  {placed}"
            + ("" if part["fits"] else "  does not fit")
        )
    if verdict.logic:
        logic = verdict.logic
        lines.append(
            f"  logic: {logic['luts']:,} LUTs, {logic['ffs']:,} flip-flops, {logic['multipliers']} multipliers, "
            f"± {logic['error_share']:.0%}"
        )
    lines.append(f"  energy: {verdict.energy}; clearing the table after reset takes {verdict.startup_us:,.0f} µs")
    lines += [f"  note: {remark}" for remark in verdict.remarks]
    if one.target.unverified:
        lines.append(f"  note: no document confirms {', '.join(one.target.unverified)}")
    lines += _change_lines(one)
    return "\n".join(lines) + "\n"


def comparison(judged: list[Judged], *, cancelled: bool = True) -> str:
    """Return a line a part, with what it cancels where the stretch is long enough for that to be ``cancelled``."""
    shares = f"{'CR':>7}{'J':>7}" if cancelled else ""
    header = (
        f"{'part':<16}{'fits':<6}{'keeps up':<10}{'binding':<24}{'margin':>8}{'max Mev/s':>11}{'p50 (µs)':>10}"
        f"{'max (µs)':>10}{'drops':>9}{shares}  with"
    )
    lines = [header]
    for one in judged:
        verdict, outcome = one.verdict, one.verdict.outcome
        rate, p50, most, drops = "-", "-", "-", "-"
        if outcome is not None:
            rate, drops = f"{outcome.max_events_per_second * 1e-6:.2f}", f"{outcome.drops:,}"
            p50, most = (f"{value * 1e-3:.2f}" for value in (outcome.latency_ns.p50, outcome.latency_ns.most))
        ratio = "-" if one.cancelled is None else f"{one.cancelled.ratio:.3f}"
        j = None if one.cancelled is None else one.cancelled.selectivity
        worth = f"{ratio:>7}{'-' if j is None else f'{j:.3f}':>7}" if cancelled else ""
        best = f"passes with {one.changes[0].name}" if one.changes else ""
        lines.append(
            f"{verdict.target:<16}{_word(verdict.fits):<6}{_word(verdict.keeps_up):<10}{verdict.binding.name:<24}"
            f"{_margin(verdict.binding.margin):>8}{rate:>11}{p50:>10}{most:>10}{drops:>9}{worth}"
            f"  {verdict.design if verdict.passes else best}"
        )
    return "\n".join(lines) + "\n"


def _sentence(one: Judged) -> str:
    """Say the verdict in one sentence."""
    verdict = one.verdict
    if verdict.passes:
        tight = "" if verdict.binding.verdict == "pass" else ", tightly"
        return f"fits and keeps up{tight}; {verdict.binding.name} binds with {_margin(verdict.binding.margin)} left"
    words = []
    if not verdict.fits:
        words.append("does not fit")
    if not verdict.keeps_up:
        words.append("does not keep up")
    failing = ", ".join(row.name for row in verdict.constraints if not row.ok) or verdict.binding.name
    return f"{' and '.join(words)}: {failing}"


def _pace_lines(one: Judged) -> list[str]:
    """Say cycles, latency, stalls and what is cancelled."""
    outcome = one.verdict.outcome
    assert outcome is not None
    pace, latency, cycles = outcome.pace, outcome.latency_ns, outcome.gauge.latency()
    lines = [
        f"  cycles an event, saturated: {pace.least:.0f} least, {pace.mean:.2f} mean, {pace.p99:.0f} p99, "
        f"{pace.most:.0f} most; sustains {outcome.max_events_per_second * 1e-6:.3g} Mev/s and {_burst(one)}",
        f"  latency: {latency.p50:,.0f} ns p50, {latency.p99:,.0f} p99, {latency.most:,.0f} most "
        f"({cycles.p50:.0f}, {cycles.p99:.0f}, {cycles.most:.0f} cycles)",
        "  mean cycles by stage: "
        + ", ".join(f"{name} {part.mean:.2f}" for name, part in outcome.gauge.stages().items()),
    ]
    stalls = {cause: count for cause, count in outcome.waited.items() if count}
    if stalls:
        total = max(int(outcome.kept.sum()), 1)
        lines.append(
            "  cycles an event waited for: "
            + ", ".join(f"{name} {count / total:.2f}" for name, count in stalls.items())
        )
    busy = {name: share for name, share in one.verdict.utilisation.items() if share > 0.0005}
    if busy:
        lines.append("  busy: " + ", ".join(f"{name} {share:.1%}" for name, share in busy.items()))
    counts = outcome.counts
    lines.append(
        f"  drops: {outcome.drops:,} at the input, {outcome.lost:,} at the sensor, {counts['overflow']:,} predictions; "
        f"{counts['late_passes']:,} entries came too late to be written"
    )
    link = one.verdict.link
    if link:
        shares = ""
        if link["before_share"] is not None:
            shares = f" ({link['before_share']:.1%} and {link['after_share']:.1%} of the output line)"
        lines.append(
            f"  link: {link['before_bits_per_second'] * 1e-6:.3g} Mbit/s before, "
            f"{link['after_bits_per_second'] * 1e-6:.3g} after{shares}"
        )
    if one.cancelled is not None:
        lines.append(f"  cancelled: {_cancelled(one.cancelled)}; without limits {_cancelled(one.ideal)}")
    equal = {True: "equal", False: "DIFFER from", None: "not compared with"}[one.equal]
    lines.append(f"  decisions {equal} the golden model's on the events that were not dropped")
    return lines


def _burst(one: Judged) -> str:
    """Say how many events may come at once."""
    burst = one.verdict.burst_events
    return f"bursts of {burst:,.0f} events" if math.isfinite(burst) else "bursts of any length"


def _cancelled(shares: object) -> str:
    ratio, j = shares.ratio, shares.selectivity  # type: ignore[attr-defined]
    return f"CR {ratio:.3f}" + ("" if j is None else f", J {j:.3f}")


def _change_lines(one: Judged) -> list[str]:
    """Say what would let the part pass."""
    if one.verdict.passes or one.changes_simulated < 0:
        return []
    if not one.changes:
        return [f"  no change tried, nor up to four together, lets it pass ({one.changes_simulated} simulated)"]
    unit = "CR" if one.ideal.selectivity is None else "J"
    lines = [f"  it passes with ({one.changes_simulated} simulated):"]
    for change in one.changes:
        lines.append(
            f"    {change.name}: {_cancelled(change.cancelled)}, {unit} {-change.loss:+.3f}; "
            f"{change.verdict.binding.name} binds with {_margin(change.verdict.binding.margin)} left"
        )
    return lines


def _merged(rows: list[dict[str, object]]) -> list[dict[str, object]]:
    """Join the equal banks of one table into one row."""
    merged: dict[tuple[object, ...], dict[str, object]] = {}
    for row in rows:
        stem = str(row["name"]).rstrip("0123456789")
        key = (stem, row["words"], row["width_bits"], row["kind"], row["mode"], row["fits"])
        if key not in merged:
            merged[key] = {**row, "count": 1}
            continue
        held = merged[key]
        held["count"] = int(held["count"]) + 1  # type: ignore[call-overload]
        for name in ("bits", "blocks"):
            held[name] = int(held[name]) + int(row[name])  # type: ignore[call-overload]
        held["name"] = f"{stem} ×{held['count']}"
    return list(merged.values())


def _word(value: bool) -> str:
    return "yes" if value else "NO"


def _number(value: float) -> str:
    """Return a number as short as it can be read."""
    if not math.isfinite(value):
        return "-"
    if value and abs(value) < 100 and value != int(value):
        return f"{value:.3g}"
    return f"{value:,.0f}"


def _margin(value: float) -> str:
    return "none" if value < -9.99 else f"{value:+.0%}"
