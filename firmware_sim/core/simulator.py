"""Simulate a matching core on real events: decisions, cycles, drops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.function import OP_FIELDS, op_room
from tiegocancel.firmware_sim.core.loop import DROPPED, SUPPRESSED, run_chunk
from tiegocancel.firmware_sim.core.plan import CAUSES, WORK, lay_out_clock, lay_out_plan
from tiegocancel.firmware_sim.core.rule import COUNTS, lay_out_rule, lay_out_state
from tiegocancel.firmware_sim.intake import Intake

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules, schedules_for
from tiegocancel.motion.schedule import FRACTION_BITS, MotionSchedule

__all__ = ["CoreSimulator", "CoreTrace", "narrowed"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CoreTrace:
    """What became of each event of a chunk, and when: arrays of its length, in cycles, −1 where it was dropped.

    ``arrival`` at the input FIFO; ``taken`` by predict; ``first`` issue of its operations; ``issued`` its match;
    ``decided``; ``left`` the output FIFO (``decided`` for a suppressed event). ``held``: entries of the rings after it.
    """

    suppressed: NDArray[np.bool_]
    dropped: NDArray[np.bool_]
    arrival: NDArray[np.int64]
    taken: NDArray[np.int64]
    first: NDArray[np.int64]
    issued: NDArray[np.int64]
    decided: NDArray[np.int64]
    left: NDArray[np.int64]
    held: NDArray[np.int64]

    @property
    def latency(self) -> NDArray[np.int64]:
        """Cycles from arrival to decision of the events that were not dropped."""
        kept = ~self.dropped
        return self.decided[kept] - self.arrival[kept]


class CoreSimulator:
    """Run one core; chunks may be cut anywhere.

    ``scrub_cycles``: cycles between two words of the sweep, 0 for none; ``link_q16``: cycles that the output link takes
    for a residual, in 2^-16. With ``saturated`` the next event always waits at the input: what the core can sustain.
    Events arrive in cycles that rise by one at least.
    """

    def __init__(
        self,
        core: CoreConfig,
        cancel: CancelConfig,
        motion: MotionSchedule | Schedules,
        *,
        width: int,
        height: int,
        scrub_cycles: int = 0,
        link_q16: int = 0,
        saturated: bool = False,
    ) -> None:
        self.core, self.cancel, self.width, self.height = core, cancel, width, height
        schedules = [narrowed(one, core.coefficient_fraction_bits) for one in schedules_for(cancel, motion)]
        self.rule = lay_out_rule(
            cancel,
            schedules[0].t_us,
            np.stack([one.coefficients for one in schedules]),
            width=width,
            height=height,
            stamp_period=1 << core.stamp_bits if core.stamp_bits else 0,
        )
        self.state = lay_out_state(cancel, width=width, height=height)
        self.plan = lay_out_plan(core, cancel, scrub_cycles=scrub_cycles, link_q16=link_q16)
        self.clock = lay_out_clock(self.plan)
        self._saturated = saturated
        self._ops = np.zeros((op_room(self.state), OP_FIELDS), np.int64)
        self._intake = Intake("core", width=width, height=height, saturated=saturated)

    @property
    def counts(self) -> dict[str, int]:
        """Counters of the canceller and of its work so far."""
        return dict(zip(COUNTS, self.state.counts.tolist(), strict=True))

    @property
    def waited(self) -> dict[str, int]:
        """Cycles that operations waited so far, by cause."""
        return dict(zip(CAUSES, self.clock.waited.tolist(), strict=True))

    @property
    def work(self) -> dict[str, int]:
        """Accesses and places computed so far."""
        return dict(zip(WORK, self.clock.work.tolist(), strict=True))

    def process(self, events: Events, arrival: NDArray[np.int64] | None = None) -> CoreTrace:
        """Send a chunk through the core; ``arrival`` int64[n] in cycles, rising, is needed unless saturated.

        Raise ``ValueError`` where arrivals do not rise or the sensor's size differs.
        """
        arrival = self._intake.arrivals(events, arrival)
        count = len(events)
        fate, cycles = np.zeros(count, np.uint8), np.zeros((count, 6), np.int64)
        run_chunk(
            self.rule,
            self.state,
            self.plan,
            self.clock,
            events.t,
            events.x,
            events.y,
            events.p,
            arrival,
            int(self._saturated),
            self._ops,
            fate,
            cycles,
        )
        taken, first, issued, decided, left, held = cycles.T
        if self._saturated:
            arrival = taken - 1
        return CoreTrace(
            suppressed=fate == SUPPRESSED,
            dropped=fate == DROPPED,
            arrival=arrival,
            taken=taken,
            first=first,
            issued=issued,
            decided=decided,
            left=left,
            held=held,
        )


def narrowed(schedule: MotionSchedule, fraction_bits: int) -> MotionSchedule:
    """Return the schedule with its coefficients rounded to ``fraction_bits`` instead of 16."""
    if fraction_bits == FRACTION_BITS:
        return schedule
    shift = FRACTION_BITS - fraction_bits
    rounded = ((schedule.coefficients + (1 << (shift - 1))) >> shift) << shift
    return MotionSchedule(schedule.t_us.copy(), rounded, schedule.horizon_us)
