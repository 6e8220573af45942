"""Step a firmware clock by clock: the readable model that the event-driven one is held to.

One call of ``step`` is one cycle. Everything looks at the buffers as they were at the start of the cycle:

1. The core ends what it was at: a decision's residual goes out when there is room, else it waits.
2. A core that is free begins a sweep that is pending, else the next event that is ready.
3. The link takes a residual that was put before this cycle.
4. An event that arrives is held or dropped; a half buffer that is full, or whose time is up, is handed over.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from tiegocancel.firmware_sim.core.function import KIND, LEFT, LOW, OP_FIELDS, PASS, RIGHT, TOP, decide, op_room
from tiegocancel.firmware_sim.core.rule import COUNTS, lay_out_rule, lay_out_state
from tiegocancel.firmware_sim.mcu.primitives import ITEMS


@dataclass(slots=True)
class Event:
    """One event on its way; −1 for not yet."""

    number: int
    arrival: int
    dropped: bool = False
    suppressed: bool = False
    ready: int = -1
    start: int = -1
    end: int = -1
    left: int = -1


@dataclass(slots=True)
class Half:
    """Half of a double buffer: what came into it, and when its time is up."""

    events: list[Event] = field(default_factory=list)
    close: int = -1
    closed: bool = False


class ClockedFirmware:
    """Run one firmware on events that arrive in given cycles."""

    def __init__(self, case: Any, plan: Any) -> None:
        self.plan, self.events, self.cancel = plan, case.events, case.cancel
        rows = np.stack([one.coefficients for one in case.schedules])
        size = {"width": case.events.width, "height": case.events.height}
        self.rule = lay_out_rule(case.cancel, case.schedules[0].t_us, rows, **size)
        self.state = lay_out_state(case.cancel, **size)
        self.handled = [Event(number, int(at)) for number, at in enumerate(case.arrival)]
        self._coming = deque(self.handled)
        self._waiting: deque[Event] = deque()
        self._halves: deque[Half] = deque(maxlen=2)
        self._core: Event | None = None
        self._busy_until = 0
        self._sweeps = 0
        self._output: deque[tuple[Event, int]] = deque()
        self._link_free_q16 = 0
        self._taken = self._residuals = 0
        self._passed = [0] * len(case.cancel.horizons_us)
        self._sets: dict[int, OrderedDict[int, None]] = {}
        self._ops = np.zeros((op_room(self.state), OP_FIELDS), np.int64)
        self.cycle = 0

    def run(self) -> None:
        """Step until every event has left."""
        while self._coming or self._waiting or self._core is not None or self._output:
            self.step()

    def step(self) -> None:
        """Advance one clock."""
        held, sent = len(self._waiting), len(self._output)
        busy_halves = sum(any(event.start < 0 for event in half.events) for half in self._halves)
        self._finish(sent)
        self._begin()
        self._link()
        self._arrive(held, busy_halves)
        self.cycle += 1

    def _finish(self, sent: int) -> None:
        event = self._core
        if event is None or self.cycle < self._busy_until:
            return
        if event.end < 0:
            event.end = self.cycle
        if event.suppressed:
            event.left = self.cycle
        elif sent < self.plan.output_depth:
            self._output.append((event, self.cycle))
        else:
            return
        self._core = None

    def _begin(self) -> None:
        plan = self.plan
        while self._core is None and self.cycle >= self._busy_until:
            if plan.sweep_cycles and (self._sweeps + 1) * plan.sweep_cycles <= self.cycle:
                self._sweeps += 1
                self._busy_until = self.cycle + plan.sweep_block
                continue
            if not self._waiting or not 0 <= self._waiting[0].ready <= self.cycle:
                return
            event = self._core = self._waiting.popleft()
            event.start = self.cycle
            self._busy_until = self.cycle + self._decide(event)
            return

    def _link(self) -> None:
        if not self._output:
            return
        event, put = self._output[0]
        free_q16 = max((put + 1) << 16, self._link_free_q16)
        if free_q16 <= self.cycle << 16:
            self._output.popleft()
            event.left = self.cycle
            self._link_free_q16 = free_q16 + self.plan.link

    def _arrive(self, held: int, busy_halves: int) -> None:
        plan = self.plan
        if self._coming and self._coming[0].arrival == self.cycle:
            event = self._coming.popleft()
            if not plan.blocks:
                event.dropped = held >= plan.input_depth
                event.ready = self.cycle + 1
            elif self._halves and not self._halves[-1].closed:
                self._halves[-1].events.append(event)
            elif busy_halves >= 2:
                event.dropped = True
            else:
                self._halves.append(Half([event], close=self.cycle + plan.flush_cycles))
            if not event.dropped:
                self._waiting.append(event)
        if self._halves and not self._halves[-1].closed:
            half = self._halves[-1]
            if len(half.events) == plan.input_depth // 2 or self.cycle == half.close:
                half.closed = True
                for event in half.events:
                    event.ready = self.cycle + 1

    def _decide(self, event: Event) -> int:
        """Return the cycles that an event's decision takes (M4, M5)."""
        e, i, plan, rule = self.events, event.number, self.plan, self.rule
        before = dict(zip(COUNTS, self.state.counts.tolist(), strict=True))
        x, y = int(e.x[i]), int(e.y[i])
        suppressed, count, slot = decide(rule, self.state, int(e.t[i]), x, y, int(e.p[i]), self._ops)
        event.suppressed = bool(suppressed)
        new = {name: value - before[name] for name, value in zip(COUNTS, self.state.counts.tolist(), strict=True)}
        stops = self.cancel.need == 1 and self.cancel.carry == 0
        horizons = len(self.cancel.horizons_us)
        if self.cancel.chooses:
            rings = [range(base, base + room) for base, room in zip(*self._rings(), strict=True)]
            maps = next((ring + 1 for ring, slots in enumerate(rings) if slot in slots), horizons)
        elif self.cancel.motion_at == "gate":
            maps = 0
        else:
            maps = horizons if new["outside"] or new["still"] else 1
        corners = [(x + dx, y + dy) for dx in (-plan.reach, plan.reach) for dy in (-plan.reach, plan.reach)]
        border = any(not (0 <= cx < rule.width and 0 <= cy < rule.height) for cx, cy in corners)
        work = {
            "event": 1,
            "pass": new["passes"],
            "write": new["writes"],
            "way_written": new["ways_written"],
            "look": new["cells_to_hit"] if stops else new["cells_read"],
            "way_looked": new["ways_to_hit"] if stops else new["ways_matched"],
            "candidate": suppressed if stops else new["candidates"],
            "take": new["uses_taken"],
            "output": 1 - suppressed,
            "map": maps,
            "store": new["predicted"],
            "border": int(border),
            "border_offset": len(self.cancel.offsets) if border else 0,
        }
        amounts = [work[item] for item in ITEMS]
        compute_q16 = sum(amount * int(cost) for amount, cost in zip(amounts, plan.cost, strict=True))
        cycles = max(-(-compute_q16 // 65536), 1)
        cycles += sum(amount * int(wait) for amount, wait in zip(amounts, plan.wait, strict=True))
        cycles += self._misses(count, slot, event)
        if plan.interrupt_every and self._taken % plan.interrupt_every == 0:
            cycles += plan.interrupt_cycles
        self._taken += 1
        self._residuals += not suppressed
        return cycles

    def _rings(self) -> tuple[list[int], list[int]]:
        return self.state.ring_base.tolist(), self.state.ring_room.tolist()

    def _misses(self, count: int, slot: int, event: Event) -> int:
        """Return the cycles of the lines that the event misses."""
        plan, rule, missed = self.plan, self.rule, 0
        per_table, per_ring, per_input, per_output = plan.miss_cycles.tolist()
        if plan.cached & 1:
            for op in self._ops[:count].tolist():
                if op[KIND] == PASS:
                    continue
                for row in range(op[TOP], op[LOW] + 1):
                    columns = range(op[LEFT], op[RIGHT] + 1)
                    if not rule.ways:
                        cells = [row * rule.bins_x + columns[0], row * rule.bins_x + columns[-1]]
                        missed += per_table * self._touch(plan.table_base, plan.cell_bytes, cells[0], cells[1])
                        continue
                    for column in columns:
                        low = (row % (1 << rule.set_rows)) * (1 << rule.set_columns)
                        first = (low + column % (1 << rule.set_columns)) * rule.ways
                        missed += per_table * self._touch(
                            plan.table_base, plan.cell_bytes, first, first + rule.ways - 1
                        )
        if plan.cached & 2:
            bases, rooms = self._rings()
            for h in range(len(self._passed)):
                ring = h if rule.chooses else 0
                for number in range(self._passed[h], int(self.state.passed[h])):
                    at = bases[ring] + number % rooms[ring]
                    missed += per_ring * self._touch(plan.ring_base, plan.entry_bytes, at, at)
                self._passed[h] = int(self.state.passed[h])
            if slot >= 0:
                missed += per_ring * self._touch(plan.ring_base, plan.entry_bytes, slot, slot)
        fresh = max(plan.line_bytes // 8, 1)
        missed += per_input * (bool(plan.cached & 4) and self._taken % fresh == 0)
        missed += per_output * (bool(plan.cached & 8) and not event.suppressed and self._residuals % fresh == 0)
        return missed

    def _touch(self, base: int, size: int, first: int, last: int) -> int:
        """Bring the lines of an array's elements into the cache; return how many were not there."""
        plan, missed = self.plan, 0
        for line in range(
            (base + first * size) // plan.line_bytes, (base + (last + 1) * size - 1) // plan.line_bytes + 1
        ):
            held = self._sets.setdefault(line % plan.cache_sets, OrderedDict())
            if line not in held:
                missed += 1
                if len(held) == plan.cache_ways:
                    held.popitem(last=False)
                held[line] = None
            held.move_to_end(line)
        return missed
