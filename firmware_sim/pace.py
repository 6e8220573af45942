"""State the constraints that depend on the events: rates, FIFOs, rings, links, latency."""

from __future__ import annotations

import numpy as np
from tiegocancel.firmware_sim.constraint import Constraint
from tiegocancel.firmware_sim.offer import Offer
from tiegocancel.firmware_sim.outcome import Outcome

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig

__all__ = ["burst_events", "link_table", "pace_constraints", "peak_rate_hz"]

_PEAK_US = 1000


def peak_rate_hz(events: Events, span_us: int = _PEAK_US) -> float:
    """Return the greatest rate over any ``span_us``, in events a second."""
    if not len(events):
        return 0.0
    ends = np.searchsorted(events.t, events.t + span_us, side="left")
    return float((ends - np.arange(len(events))).max()) / span_us * 1e6


def burst_events(outcome: Outcome, offer: Offer, *, input_depth: int) -> float:
    """Return how many events may come as fast as they can before the input FIFO is full, from an idle device.

    As fast as they can is one a cycle, or at the sensor's readout; ∞ where the device takes them as fast as that.
    """
    apart = 1.0
    if offer.input.readout_events_per_second:
        apart = max(outcome.clock_hz / offer.input.readout_events_per_second, 1.0)
    if offer.input.link_bits_per_second:
        apart = max(outcome.clock_hz * offer.input.bits_per_event / offer.input.link_bits_per_second, apart)
    left = 1.0 - apart / outcome.pace.mean
    return input_depth / left if left > 0 else float("inf")


def pace_constraints(
    outcome: Outcome, events: Events, cancel: CancelConfig, offer: Offer, *, input_depth: int, error_share: float = 0.0
) -> list[Constraint]:
    """Return every constraint of the pace; ``error_share`` of cycles that are modelled and not counted."""
    seconds = max(events.span_us, 1) * 1e-6
    rate = len(events) / seconds
    residuals = int((outcome.kept & ~outcome.suppressed).sum())
    how = {"kind": "pace", "evidence": "estimated" if error_share else "simulated"}
    found = [
        Constraint(
            name="mean rate",
            need=rate,
            have=outcome.max_events_per_second,
            unit="ev/s",
            error_share=error_share,
            note="what it sustains, saturated, on the same events",
            **how,  # type: ignore[arg-type]
        ),
        Constraint(
            name="input FIFO",
            need=outcome.input_need,
            have=input_depth,
            unit="events",
            error_share=error_share,
            note=f"{outcome.drops:,} events dropped; {peak_rate_hz(events) * 1e-6:.2f} Mev/s in the densest ms",
            **how,  # type: ignore[arg-type]
        ),
        Constraint(
            name="ring",
            kind="pace",
            need=_ring_need(outcome, events, cancel),
            have=sum(cancel.ring_capacities),
            unit="entries",
            evidence="exact" if not outcome.counts["overflow"] else "estimated",
            note=f"{outcome.counts['overflow']:,} predictions discarded",
        ),
    ]
    path = offer.input
    if path.link_bits_per_second:
        found.append(
            Constraint(
                name="input link",
                kind="pace",
                need=rate * path.bits_per_event,
                have=path.link_bits_per_second,
                unit="bit/s",
                evidence="exact",
                note=f"{outcome.lost:,} events lost at the sensor, whose buffer holds {path.buffer_events:,}",
            )
        )
    if outcome.lost:
        found.append(
            Constraint(
                name="lost at the sensor", kind="pace", need=outcome.lost, have=0, unit="events", evidence="simulated"
            )
        )
    if offer.output_bits_per_second:
        found.append(
            Constraint(
                name="output link",
                kind="pace",
                need=residuals / seconds * offer.output_bits_per_event,
                have=offer.output_bits_per_second,
                unit="bit/s",
                evidence="exact",
                note=f"without cancellation {rate * offer.output_bits_per_event:,.0f} bit/s",
            )
        )
    if offer.max_latency_us:
        found.append(
            Constraint(
                name="latency",
                need=outcome.latency_ns.most * 1e-3,
                have=offer.max_latency_us,
                unit="µs",
                error_share=error_share,
                note="the longest from arrival to decision",
                **how,  # type: ignore[arg-type]
            )
        )
    return found


def link_table(outcome: Outcome, events: Events, offer: Offer) -> dict[str, float | None]:
    """Return what a link carries before and after cancellation, in bits a second and as a share of the output line."""
    seconds = max(events.span_us, 1) * 1e-6
    before = len(events) / seconds * offer.output_bits_per_event
    after = int((outcome.kept & ~outcome.suppressed).sum()) / seconds * offer.output_bits_per_event
    line = offer.output_bits_per_second
    return {
        "bits_per_event": offer.output_bits_per_event,
        "before_bits_per_second": before,
        "after_bits_per_second": after,
        "before_share": before / line if line else None,
        "after_share": after / line if line else None,
    }


def _ring_need(outcome: Outcome, events: Events, cancel: CancelConfig) -> int:
    """Return the entries that were held, or, where some were refused, the most that could have been."""
    if not outcome.counts["overflow"]:
        return outcome.counts["ring_high_water"]
    kept = events.t[outcome.kept]
    waits_us = cancel.horizons_us[-1] - cancel.early_gate_us
    first = np.searchsorted(kept, kept - max(waits_us, 0), side="left")
    return int((np.arange(len(kept)) - first + 1).max())
