"""Say the main numbers of a run in a few lines of text."""

from __future__ import annotations

from typing import Any

from tiegocancel.metrics import Share
from tiegocancel.study import RunResult, Verdict
from tiegocancel.study.controls import CONTROLS
from tiegocancel.study.prefilter import filter_text
from tiegocancel.units import rate_text

__all__ = ["link_text", "summary_text"]


def summary_text(result: RunResult, verdict: Verdict) -> str:
    """Return the headline, the ratios beside their controls and what they rest on."""
    share = result.tally.share()
    lines = [
        verdict.headline,
        f"  events       {result.counters.events:,} in {result.duration_s:.3f} s, "
        f"{result.counters.suppressed:,} suppressed",
        f"  counted      {share.events:,}; {result.tally.warm_up_events:,} left out, warm-up "
        f"{result.settings.cancel.warm_up_us / 1000:g} ms",
        f"  motion       {result.trajectory.described(start_us=result.first_us, stop_us=result.last_us)} "
        f"({result.trajectory.source})",
        f"  {'':22}all" + ("      disc" if result.lead_region else ""),
    ]
    tallies = {"cancellation ratio": result.tally}
    tallies |= {CONTROLS[name].label: tally for name, tally in result.controls.items()}
    for name, tally in tallies.items():
        line = f"  {name:20}{_percent(tally.share())}"
        lines.append(line + (f"    {_percent(tally.share(on_disc=True))}" if result.lead_region else ""))
    selectivity = result.tally.selectivity()
    if selectivity is not None:
        causes = ", ".join(f"{cause} {_text(selectivity[cause])}" for cause in ("ego", "mover", "noise"))
        j = selectivity["j"]
        lines.append(f"  by label     {causes}" + ("" if j is None else f": J = {j:.3f}"))
    if result.filtered is not None and result.filter_state is not None:
        lines.append(f"  filters      {filter_text(result.filtered, result.filter_state)}")
    if result.guard is not None:
        lines.append(
            f"  guard        closed {result.guard['closures']:,} ×, opened {result.guard['openings']:,} ×; "
            f"{result.guard['passed']:,} hits let through"
        )
    if result.estimates:
        confident = sum(estimate.confident for estimate in result.estimates)
        lines.append(f"  estimates    {len(result.estimates):,}, {confident:,} of them confident")
    if result.diagnosis is not None:
        lines.append(f"  diagnosis    {result.diagnosis.text}")
    speed = rate_text(result.counters.events / result.seconds) if result.seconds else "–"
    lines.append(f"  speed        {speed}")
    state, entries = result.state, sum(result.settings.cancel.ring_capacities)
    lines.append(
        f"  state        {state.total_kib:,.0f} KiB: {entries:,} entries of {state.ring_entry} bits in the ring, "
        f"{state.cells:,} cells of {state.cell} bits in the table"
    )
    return "\n".join(lines) + "\n"


def link_text(link: dict[str, Any]) -> str:
    """Say what came over a link, how long it waited, and what was lost."""
    latency, queue, wire = link["latency"], link["queue"], link["decoder"]
    lost = wire["lost_events"] + queue["dropped"] + queue["thinned"]
    return (
        f"  link         {link['events']:,} events, {wire['bytes']:,} bytes; {lost:,} events lost, "
        f"{wire['bad_bytes']:,} bad bytes, {wire['lost_frames']:,} frames lost, {link['reconnects']} reconnections\n"
        f"  latency      byte to decision: p50 {latency['p50_ms']:.2f} ms, p99 {latency['p99_ms']:.2f} ms, "
        f"max {latency['max_ms']:.2f} ms; at most {queue['high_water']:,} events waited\n"
    )


def _percent(share: Share) -> str:
    return f"{share.ratio:6.1%}" if share.events else f"{'–':>6}"


def _text(value: float | None) -> str:
    return "–" if value is None else f"{value:.1%}"
