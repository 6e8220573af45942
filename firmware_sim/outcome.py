"""Run a simulated device on real time and saturated, and hold what that showed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.arrival import Arrivals
from tiegocancel.firmware_sim.core.simulator import CoreTrace
from tiegocancel.firmware_sim.measure import Distribution, Gauge
from tiegocancel.firmware_sim.offer import Offer

from tiegocancel.events import Events

__all__ = ["DEEP", "Device", "Mode", "Outcome", "run_device"]

Mode = Literal["real", "deep", "saturated"]
"""As the events arrive; the same with an input FIFO that never fills; as fast as it can."""

DEEP = 1 << 20
"""Depth of a FIFO that tells how deep one would have to be."""

_CHUNK = 1 << 18


class Device(Protocol):
    """What core and microcontroller have in common: events and arrivals in, decisions and cycles out."""

    @property
    def counts(self) -> dict[str, int]:
        """Counters of the canceller and of its work."""
        ...

    @property
    def work(self) -> dict[str, int]:
        """Work done, by kind."""
        ...

    def process(self, events: Events, arrival: NDArray[np.int64] | None = None) -> CoreTrace:
        """Send a chunk through the device."""
        ...


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Outcome:
    """What one device did with one stretch of events at one clock.

    ``suppressed``, ``kept`` bool[n]: decisions, and which events were decided at all; ``lost`` at the sensor and
    ``drops`` at the device's input make up the rest. ``pace``: cycles an event of the saturated device, warm-up left
    out. ``input_need``: depth at which the input FIFO would have dropped nothing. ``cycles``: from the first arrival to
    the last departure.
    """

    clock_hz: float
    gauge: Gauge
    pace: Distribution
    counts: dict[str, int]
    waited: dict[str, int]
    work: dict[str, int]
    suppressed: NDArray[np.bool_]
    kept: NDArray[np.bool_]
    lost: int
    drops: int
    input_need: int
    cycles: int

    @property
    def max_events_per_second(self) -> float:
        """What the device can sustain."""
        return self.clock_hz / self.pace.mean if self.pace.mean > 0 else float("inf")

    @property
    def latency_ns(self) -> Distribution:
        """From arrival to decision."""
        return self.gauge.latency().scaled(1e9 / self.clock_hz)


def run_device(
    make: Callable[[Mode], Device], events: Events, offer: Offer, *, clock_hz: float, warm_up_us: int
) -> Outcome:
    """Run a device on the events as they arrive, saturated, and, where it drops events, with a deep input FIFO.

    Events that the sensor loses never reach the device. The saturated run sees the kept ones, so that its rings and
    its table do as much work.
    """
    device, gauge, arrivals = make("real"), Gauge(), Arrivals(offer.input, clock_hz=clock_hz)
    suppressed, kept = np.zeros(len(events), np.bool_), np.zeros(len(events), np.bool_)
    cycles = 0
    for first in range(0, len(events), _CHUNK):
        chunk = events[first : first + _CHUNK]
        arrival, lost = arrivals.process(chunk.t)
        trace = device.process(chunk.select(~lost), arrival[~lost])
        gauge.take(trace)
        at = first + np.flatnonzero(~lost)
        suppressed[at], kept[at] = trace.suppressed, ~trace.dropped
        if len(at):
            cycles = max(cycles, int(trace.left.max()) + 1, int(arrival.max()) + 1)
    counts, work = device.counts, device.work
    waited: dict[str, int] = getattr(device, "waited", {})  # a core's; a firmware's cycles stand in its work
    pace = _pace(make("saturated"), events.select(kept), warm_up_us)
    need = gauge.input_level().high_water
    if gauge.drops:
        need = _need(make("deep"), events, Arrivals(offer.input, clock_hz=clock_hz))
    return Outcome(
        clock_hz=clock_hz,
        gauge=gauge,
        pace=pace,
        counts=counts,
        waited=waited,
        work=work,
        suppressed=suppressed,
        kept=kept,
        lost=arrivals.lost,
        drops=gauge.drops,
        input_need=need,
        cycles=cycles,
    )


def _need(device: Device, events: Events, arrivals: Arrivals) -> int:
    """Return the high water of an input FIFO that never fills."""
    gauge = Gauge()
    for first in range(0, len(events), _CHUNK):
        chunk = events[first : first + _CHUNK]
        arrival, lost = arrivals.process(chunk.t)
        gauge.take(device.process(chunk.select(~lost), arrival[~lost]))
    return gauge.input_level().high_water + gauge.drops


def _pace(device: Device, events: Events, warm_up_us: int) -> Distribution:
    """Return cycles an event of the saturated device, after the warm-up where the stretch is long enough for one."""
    gauge = Gauge()
    for first in range(0, len(events), _CHUNK):
        gauge.take(device.process(events[first : first + _CHUNK]))
    steps = np.diff(gauge.column("decided"))
    if not len(steps):
        return Distribution.of(np.array([float("nan")]))
    warm = int(np.searchsorted(events.t, events.t[0] + warm_up_us))
    return Distribution.of(steps[warm:] if len(steps) - warm >= 1000 else steps)
