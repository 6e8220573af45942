"""Simulate a firmware on real events: decisions, cycles, drops, with the interface of the matching core's simulator."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.function import OP_FIELDS, op_room
from tiegocancel.firmware_sim.core.loop import DROPPED, SUPPRESSED
from tiegocancel.firmware_sim.core.rule import COUNTS, lay_out_rule, lay_out_state
from tiegocancel.firmware_sim.core.simulator import CoreTrace
from tiegocancel.firmware_sim.intake import Intake
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.mcu.costs import loop_table
from tiegocancel.firmware_sim.mcu.layout import WordLayout, fits_32_bits, lay_out_words
from tiegocancel.firmware_sim.mcu.memory import arrays_of, data_cache, fetch_cycles, memory_cost
from tiegocancel.firmware_sim.mcu.primitives import ITEMS, primitives_of_items
from tiegocancel.firmware_sim.mcu.timing import CAUSES, HITS, MISSES, Plan, lay_out_clock, run_chunk
from tiegocancel.firmware_sim.ram_map import RESERVE_BYTES, RamArray, RamMap, place_arrays
from tiegocancel.firmware_sim.target_mcu import McuTarget

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules, schedules_for
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["McuSimulator"]

_USUAL_ENTRY = 12
"""Cycles to enter a handler where a part has no figure: those of the Cortex-M4."""

_TABLE_SHARE = 0.09
"""What counts times a table of cycles may be off by on a core that issues one instruction at a time: the worst of 19
configurations of the same loop on the Ibex as RTL, against its documented cycles. With two stages the mean error was
−0.8 %, the worst 2.5 %; with a write-back stage, whose loads wait only for their use, −6.0 % and 9.0 %. No Arm core was
measured: their RTL is not public."""

_GUESSED_SHARE = 0.5
"""The same where counts are borrowed from RV32IMC and no table of cycles is public: a guess. Between the cores that the
loop was compiled for, counts differ by a tenth."""


class McuSimulator:
    """Run one firmware on one part; chunks may be cut anywhere (with input by ``blocks``, see M1).

    ``link_q16``: cycles of the core that the output link takes for a residual, in 2^-16. With ``saturated`` the next
    event always waits: what the part can sustain. Events arrive in cycles that rise by one at least. ``queue_depth``:
    events that the input holds, other than the ``input_depth`` that is placed in RAM: to see how deep it would have to
    be.

    ``error_share``: how far cycles may be off, as a share. Raise ``ValueError`` where the configuration does not fit
    32-bit arithmetic that was asked for, or the sweep leaves events no time.
    """

    def __init__(
        self,
        target: McuTarget,
        config: McuConfig,
        cancel: CancelConfig,
        motion: MotionSchedule | Schedules,
        *,
        width: int,
        height: int,
        link_q16: int = 0,
        saturated: bool = False,
        queue_depth: int = 0,
        reserve_bytes: int = RESERVE_BYTES,
    ) -> None:
        self.target, self.config, self.cancel, self.width, self.height = target, config, cancel, width, height
        schedules = schedules_for(cancel, motion)
        rows = np.stack([one.coefficients for one in schedules])
        self.rule = lay_out_rule(cancel, schedules[0].t_us, rows, width=width, height=height)
        self.state = lay_out_state(cancel, width=width, height=height)
        self.table = loop_table(target, config.optimisation)
        narrow = fits_32_bits(rows, width=width, height=height)
        if config.coefficient_bits == 32 and not narrow:
            raise ValueError("coefficient_bits must be 64: a prediction of this motion leaves 32 bits, not 32")
        self._sweep_block = math.ceil(self.table.cycles_once("sweep_block", target.cycles))
        self.words: WordLayout = lay_out_words(
            cancel,
            width=width,
            height=height,
            coefficient_bits=config.coefficient_bits or (32 if narrow else 64),
            time_bits=config.time_bits,
            sweep_cycles=self._sweep_block / self.table.sweep_cells,
            clock_mhz=target.clock_mhz,
        )
        self.ram: RamMap = place_arrays(self.arrays(), target, reserve_bytes=reserve_bytes)
        self.plan = self._lay_out_plan(link_q16)
        self.clock = lay_out_clock(self.plan, len(cancel.horizons_us))
        if queue_depth:
            self.plan = self.plan._replace(input_depth=queue_depth)
            self.clock = lay_out_clock(self.plan, len(cancel.horizons_us))
        self._saturated = saturated
        self._ops = np.zeros((op_room(self.state), OP_FIELDS), np.int64)
        self._intake = Intake("firmware", width=width, height=height, saturated=saturated)

    def _lay_out_plan(self, link_q16: int) -> Plan:
        target, config, cancel, words = self.target, self.config, self.cancel, self.words
        per_primitive = self.table.cycles(target.cycles)
        if config.code == "flash":
            per_primitive = per_primitive + fetch_cycles(target, self.table, plain=cancel.is_plain)
        cost = primitives_of_items(cancel, words) @ per_primitive
        memory = memory_cost(target, words, self.ram)
        cache = data_cache(target) if memory.cached else None
        sweep_cycles = 0
        if config.sweep:
            blocks = -(-words.cells // self.table.sweep_cells)
            ticks_us = words.sweep_ticks << cancel.tick_bits
            sweep_cycles = int(ticks_us * target.clock_mhz / blocks)
            if sweep_cycles < self._sweep_block:
                raise ValueError(
                    f"time_bits must be above {words.time}: a sweep of {words.cells} cells every {ticks_us} µs takes "
                    "more than the core has"
                )
        handler = self.table.cycles_once("isr_event" if config.input == "interrupt" else "isr_half", target.cycles)
        handler += 2 * (target.cycles.exception_entry or _USUAL_ENTRY)
        every = 1 if config.input == "interrupt" else config.input_depth // 2
        return Plan(
            input_depth=config.input_depth,
            output_depth=config.output_depth,
            blocks=int(config.input == "blocks"),
            flush_cycles=max(int(config.flush_us * target.clock_mhz), 1),
            sweep_cycles=sweep_cycles,
            sweep_block=self._sweep_block,
            interrupt_every=every if config.cores == 1 else 0,
            interrupt_cycles=math.ceil(handler),
            link=link_q16,
            stops=int(cancel.need == 1 and cancel.carry == 0),
            reach=max((max(abs(dx), abs(dy)) for dx, dy in cancel.offsets), default=0),
            cost=np.round(cost * 65536).astype(np.int64),
            wait=memory.wait,
            cached=memory.cached,
            line_bytes=cache.line_bytes if cache else 8,
            cache_sets=cache.bytes // (cache.line_bytes * cache.ways) if cache else 1,
            cache_ways=cache.ways if cache else 1,
            miss_cycles=memory.miss_cycles,
            table_base=self.ram.of("table").base,
            cell_bytes=words.cell // 8,
            ring_base=self.ram.of("ring").base,
            entry_bytes=words.ring_entry // 8,
        )

    def arrays(self) -> list[RamArray]:
        """Return the arrays of the firmware, for :func:`place_arrays`."""
        return arrays_of(self.cancel, self.config, self.words)

    @property
    def fits(self) -> bool:
        """Whether ring, table, buffers and the reserve find a place in RAM."""
        return self.ram.fits

    @property
    def error_share(self) -> float:
        """How far cycles an event may be above what was simulated: errors of counts and of cycles, added in squares.

        They may be fewer by as much; on a core that issues two instructions at once by up to half, for its table of
        cycles counts them one by one: an upper bound.
        """
        return math.hypot(self.table.fit_share, _GUESSED_SHARE if self.table.borrowed else _TABLE_SHARE)

    @property
    def counts(self) -> dict[str, int]:
        """Counters of the canceller and of its work so far."""
        return dict(zip(COUNTS, self.state.counts.tolist(), strict=True))

    @property
    def work(self) -> dict[str, int]:
        """Cycles of the core so far, by cause."""
        return dict(zip(CAUSES, self.clock.spent.tolist(), strict=True))

    @property
    def items(self) -> dict[str, int]:
        """How often the firmware did each item of its work so far."""
        return dict(zip(ITEMS, self.clock.done.tolist(), strict=True))

    @property
    def item_cycles(self) -> dict[str, float]:
        """Cycles so far by item: instructions, with wait states of code and data, without cache misses."""
        each = self.plan.cost / 65536 + self.plan.wait
        return dict(zip(ITEMS, (self.clock.done * each).tolist(), strict=True))

    @property
    def cache(self) -> dict[str, int]:
        """Lines missed and met in the data cache so far, both 0 where no array lies behind it."""
        return {"misses": int(self.clock.now[MISSES]), "hits": int(self.clock.now[HITS])}

    def process(self, events: Events, arrival: NDArray[np.int64] | None = None) -> CoreTrace:
        """Send a chunk through the firmware; ``arrival`` int64[n] in cycles, rising, is needed unless saturated.

        Of the trace, ``taken``, ``first`` and ``issued`` are the start of the decision. Raise ``ValueError`` where
        arrivals do not rise or the sensor's size differs.
        """
        arrival = self._intake.arrivals(events, arrival)
        count = len(events)
        fate, cycles = np.zeros(count, np.uint8), np.zeros((count, 4), np.int64)
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
        start, decided, left, held = cycles.T
        return CoreTrace(
            suppressed=fate == SUPPRESSED,
            dropped=fate == DROPPED,
            arrival=start - 1 if self._saturated else arrival,
            taken=start,
            first=start,
            issued=start,
            decided=decided,
            left=left,
            held=held,
        )
