"""Let a core decide golden vectors at one clock: when each event arrives and when its decision stands."""

from __future__ import annotations

import numpy as np
from tiegocancel.firmware_sim.arrival import Arrivals, InputPath
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.design import CoreDesign
from tiegocancel.firmware_sim.core.simulator import CoreSimulator
from tiegocancel.firmware_sim.export.vectors import CoreCycles, Vectors

from tiegocancel.motion.schedule import FRACTION_BITS

__all__ = ["core_cycles"]

_MOST_CYCLES = 1 << 45
"""Arrivals are computed in 2^-16 cycles, in 64 bits."""


def core_cycles(vectors: Vectors, core: CoreConfig, *, clock_hz: float) -> CoreCycles:
    """Return what ``core`` does with the events of ``vectors`` at ``clock_hz``, see ``core/timing.py``.

    An event arrives at its own time, one a cycle at most; the link behind the core takes residuals as they come. The
    stamps are the narrowest whose sweep leaves the core its time, or those that ``core.stamp_bits`` asks for, without a
    sweep. Raise ``ValueError`` for a stretch too long to count in cycles, and for a core that, built to be exact and
    never short of time, does not decide as the vectors say: no cycles are told of another rule.
    """
    events = vectors.events
    if events.span_us * clock_hz * 1e-6 + len(events) > _MOST_CYCLES:
        raise ValueError(f"{events.span_us * 1e-6:g} s at {clock_hz * 1e-6:g} MHz are more cycles than can be counted")
    arrival, _ = Arrivals(InputPath(buffer_events=len(events)), clock_hz=clock_hz).process(events.t)
    design = CoreDesign(core, vectors.config, events.width, events.height, clock_hz, core.stamp_bits)
    scrub_cycles = 0 if core.stamp_bits else design.scrub_cycles
    if core.stamp_bits == 0 and core.coefficient_fraction_bits == FRACTION_BITS:
        exact = _simulator(vectors, core, 0, saturated=True)
        told = exact.process(events).suppressed
        if not np.array_equal(told, vectors.suppressed):
            row = int(np.argmax(told != vectors.suppressed))
            raise ValueError(f"the simulated core does not serve this configuration: it decides event {row} otherwise")
        for name, count in dict(vectors.counters).items():
            if exact.counts[name] != count:
                raise ValueError(
                    f"the simulated core does not serve this configuration: it counts {exact.counts[name]} {name}, "
                    f"not {count}"
                )
    trace = _simulator(vectors, core, scrub_cycles).process(events, arrival)
    return CoreCycles(
        core=core,
        clock_hz=clock_hz,
        stamp_bits=design.stamp_bits,
        scrub_cycles=scrub_cycles,
        dropped=trace.dropped,
        suppressed=trace.suppressed,
        arrival=trace.arrival,
        decided=trace.decided,
    )


def _simulator(vectors: Vectors, core: CoreConfig, scrub_cycles: int, *, saturated: bool = False) -> CoreSimulator:
    """Return a core at rest."""
    return CoreSimulator(
        core,
        vectors.config,
        vectors.schedules,
        width=vectors.events.width,
        height=vectors.events.height,
        scrub_cycles=scrub_cycles,
        saturated=saturated,
    )
