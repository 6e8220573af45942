"""Describe a matching core on a sensor as what a part must hold: memories, logic, the sweep of the table."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

from tiegocancel.firmware_sim.core.config import CoreConfig, window_shape
from tiegocancel.firmware_sim.core.plan import fastest_scrub
from tiegocancel.firmware_sim.logic import LogicShape
from tiegocancel.firmware_sim.memory_map import LogicalMemory
from tiegocancel.firmware_sim.state import StateBits, state_bits
from tiegocancel.firmware_sim.target_memory import ExternalMemory

from tiegocancel.matching.config import CancelConfig

__all__ = ["EVENT_TIME_BITS", "CoreDesign"]

EVENT_TIME_BITS = 32
"""Time of an event in the FIFOs: 71 minutes of µs, as EVT2 and eDVS E4 carry it."""

_SWEEP_SHARE, _MOST_SWEEP_SHARE = 0.05, 0.25
_MOST_TIME_BITS = 40


@dataclass(frozen=True)
class CoreDesign:
    """One core for one configuration on one sensor at one clock.

    ``time_bits``: width of a cell's stamp, 0 for the narrowest whose sweep takes at most 5 % of the cycles.
    ``external``: the memory that holds the table where the core says ``external``; a line missed takes as long as the
    chip takes for a closed row, in cycles of the core, instead of ``core.miss_cycles``.
    """

    core: CoreConfig
    cancel: CancelConfig
    width: int
    height: int
    clock_hz: float
    time_bits: int = 0
    external: ExternalMemory | None = None

    def __post_init__(self) -> None:
        if self.external is not None and self.core.table_memory == "external":
            cell_bytes = -(-state_bits(self.cancel, width=self.width, height=self.height).cell // 8)
            nanoseconds = self.external.access_ns(self.core.line_cells * cell_bytes)
            cycles = max(math.ceil(nanoseconds * self.clock_hz * 1e-9 / (1.0 - self.external.refresh_share)), 1)
            object.__setattr__(self, "core", replace(self.core, miss_cycles=cycles))

    @cached_property
    def state(self) -> StateBits:
        """Widths and totals of ring and table, at the stamp's width."""
        return state_bits(self.cancel, width=self.width, height=self.height, time_bits=self.stamp_bits)

    @cached_property
    def stamp_bits(self) -> int:
        """Width of a cell's stamp.

        The plain rule's ring holds predictions with their stamps, which sets the least; the sweep must come round
        before a stamp comes back, see ``state.state_bits``.
        """
        return self.time_bits or self._bits_for(_SWEEP_SHARE)

    @property
    def narrowest_stamp_bits(self) -> int:
        """Width at which the sweep takes up to a quarter of the cycles."""
        return self._bits_for(_MOST_SWEEP_SHARE)

    def _bits_for(self, share: float) -> int:
        """Return the least width at which the sweep takes at most this share of the cycles."""
        for bits in range(self._least_bits, _MOST_TIME_BITS):
            if self._scrub_cycles(bits) >= fastest_scrub(self.core) / share / 2:
                return bits
        return _MOST_TIME_BITS

    @property
    def _gate_ticks(self) -> int:
        return ((self.cancel.early_gate_us + self.cancel.late_gate_us) >> self.cancel.tick_bits) + 1

    @property
    def _least_bits(self) -> int:
        if self.cancel.is_plain:
            return max((2 * self.cancel.warm_up_us).bit_length(), self._gate_ticks.bit_length())
        return self._gate_ticks.bit_length()

    def _scrub_cycles(self, bits: int) -> int:
        ticks = (1 << bits) - self._gate_ticks
        return int(ticks * (1 << self.cancel.tick_bits) * 1e-6 * self.clock_hz) // max(self.table_words, 1)

    @property
    def scrub_cycles(self) -> int:
        """Cycles between two words of the sweep that hides aliases of the stamps."""
        return self._scrub_cycles(self.stamp_bits)

    @property
    def sweep_ticks(self) -> int:
        """Ticks within which every cell must be looked at once."""
        return (1 << self.stamp_bits) - self._gate_ticks

    @property
    def reads_ways(self) -> int:
        """Ways of a set that are read together."""
        if self.cancel.set_bits is None:
            return 1
        return self.core.ways_per_read or self.cancel.ways

    @property
    def table_words(self) -> int:
        """Words that the sweep goes through, in each lane at the same time."""
        cells = state_bits(self.cancel, width=self.width, height=self.height).cells
        return -(-cells // (self.reads_ways * self.core.lanes * self.banks))

    @property
    def banks(self) -> int:
        """Banks that a lane's table is split into, so that a window is read at once."""
        _, columns, rows = window_shape(self.cancel)
        return {"serial": 1, "row": columns, "banked": columns * rows}[self.core.lookup]

    @property
    def startup_cycles(self) -> int:
        """Cycles to clear the table after reset, where the blocks come up with something in them."""
        return self.table_words

    @property
    def event_bits(self) -> int:
        """Bits of an event in the FIFOs."""
        return EVENT_TIME_BITS + (self.width - 1).bit_length() + (self.height - 1).bit_length() + 1

    def memories(self) -> list[LogicalMemory]:
        """Return every memory of the core; a banked table is as many memories as it has banks and lanes."""
        state, core = self.state, self.core
        memories = [
            LogicalMemory(name="input_fifo", words=core.input_depth, width_bits=self.event_bits),
            LogicalMemory(name="output_fifo", words=core.output_depth, width_bits=self.event_bits),
        ]
        for ring, capacity in enumerate(self.cancel.ring_capacities):
            name = f"ring{ring}" if len(self.cancel.ring_capacities) > 1 else "ring"
            memories.append(LogicalMemory(name=name, words=capacity, width_bits=state.ring_entry))
        if state.index:
            ticks = state.index // max(self.cancel.ring_capacity.bit_length(), 1)
            memories.append(
                LogicalMemory(name="ring_index", words=ticks, width_bits=self.cancel.ring_capacity.bit_length())
            )
        if core.table_memory == "external":
            line = core.line_cells * state.cell
            memories.append(LogicalMemory(name="table_cache", words=core.cache_lines, width_bits=line + 16))
            return memories
        shared = core.table_memory == "single_port"
        for part in range(core.lanes * self.banks):
            memories.append(
                LogicalMemory(
                    name=f"table{part}" if core.lanes * self.banks > 1 else "table",
                    words=self.table_words,
                    width_bits=state.cell * self.reads_ways,
                    read_ports=0 if shared else 1,
                    write_ports=0 if shared else 1,
                    shared_ports=1 if shared else 0,
                )
            )
        return memories

    def logic(self) -> LogicShape:
        """Return what the logic grows with."""
        bins, _, rows = window_shape(self.cancel)
        a_read = {"serial": 1, "row": -(-bins // max(rows, 1)), "banked": bins}[self.core.lookup]
        plain = self.cancel.is_plain
        return LogicShape(
            place_bits=max(self.state.address, 1),
            time_bits=self.stamp_bits,
            cell_bits=self.state.cell,
            comparators=a_read * self.reads_ways,
            banks=self.banks,
            lanes=self.core.lanes,
            horizons=len(self.cancel.horizons_us),
            ring_bits=max(self.cancel.ring_capacity.bit_length(), 1),
            products=(self.core.predict_multipliers if plain or self.cancel.motion_at == "event" else 0)
            + (0 if plain else self.core.drain_multipliers)
            + (2 if self.cancel.lines else 0),
            coefficient_bits=self.core.coefficient_fraction_bits + 2,
            coordinate_bits=max((max(self.width, self.height) - 1).bit_length(), 1),
            row_product=self.cancel.set_bits is None,
        )
