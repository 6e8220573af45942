"""Step the matching core clock by clock, block by block: the readable model that the event-driven one is held to.

One call of :meth:`CycleModel.step` is one cycle. Within it, everything looks at the state as it was at the start of the
cycle, in this order:

1. **Credits**: count the matches that are issued and not yet returned; a decision or departure returns its credit in
   the cycle after.
2. **Issue**: a pending scrub, else the next pass or the match of the event that predict offers, goes to the stages
   before the table (R3, R4); with no stages it can enter the table in the same cycle.
3. **Table**: the oldest operation that has been through the stages enters, when its lanes are free and no write under
   way can touch its bins (R5, R6).
4. **Output**: the next decision in order leaves, when its match has committed (R7, R8); the link takes a residual.
5. **Predict**: the next event is taken from the input FIFO (R2).
6. **Input**: an event that arrives is held or dropped (R1).

The rules are numbered as in :mod:`timing`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from tiegocancel.firmware_sim.core.function import (
    KIND,
    LEFT,
    LOW,
    MATCH,
    OP_FIELDS,
    OWNER,
    PASS,
    RIGHT,
    TOP,
    WRITE,
    WRITES,
    decide,
    op_room,
)
from tiegocancel.firmware_sim.core.plan import SCRUB, Plan
from tiegocancel.firmware_sim.core.rule import Rule, State

from tiegocancel.events import Events

__all__ = ["CycleModel", "Handled"]

_NAMES = {PASS: "pass", WRITE: "write", MATCH: "match", SCRUB: "scrub"}


@dataclass(slots=True)
class Handled:
    """One event on its way: when it arrived and what has happened since, −1 for not yet."""

    number: int
    arrival: int
    dropped: bool = False
    suppressed: bool = False
    taken: int = -1
    first: int = -1
    issued: int = -1
    commit: int = -1
    decided: int = -1
    left: int = -1
    ops: deque[_Op] = field(default_factory=deque)


@dataclass(slots=True)
class _Op:
    """One operation: the bins that it touches, whether it may write there, and whose entry it passes."""

    kind: int
    left: int = 0
    right: int = 0
    top: int = 0
    low: int = 0
    writes: bool = False
    owner: int = -1
    event: Handled | None = None
    issued: int = -1
    commit: int = -1


class CycleModel:
    """Run one core on events that arrive in given cycles; slow, plain, with a line of text for every cycle."""

    def __init__(self, rule: Rule, state: State, plan: Plan, events: Events, arrival: list[int]) -> None:
        self.rule, self.state, self.plan, self.events = rule, state, plan, events
        self.cycle = 0
        self.handled = [Handled(number, at) for number, at in enumerate(arrival)]
        self._coming = deque(self.handled)
        self._fifo: deque[Handled] = deque()
        self._predicted: deque[Handled] = deque()
        self._order: deque[Handled] = deque()  # matches issued and not yet decided
        self._output: deque[Handled] = deque()
        self._stages: deque[_Op] = deque()
        self._under_way: list[_Op] = []
        self._lane_free = [0] * plan.lanes
        self._accepted: list[Handled] = []
        self._issue_from = 0
        self._last_take = -(10**9)
        self._link_free_q16 = 0
        self._scrubs = 0
        self._lines: dict[int, int] = {}
        self._dirty: set[int] = set()
        self._ops = np.zeros((op_room(state), OP_FIELDS), np.int64)
        self._trace: list[str] = []

    @property
    def done(self) -> bool:
        """Tell whether every event has left."""
        return not (self._coming or self._fifo or self._predicted or self._order or self._output)

    def run(self) -> None:
        """Step until every event has left."""
        while not self.done:
            self.step()

    def line_trace(self) -> str:
        """Return what the last cycle showed: a column a block, from the input to the output."""
        return " | ".join(self._trace)

    def step(self) -> None:
        """Advance one clock, in the order that the module's docstring numbers."""
        credits = self.plan.output_depth - len(self._order) - len(self._output)
        held, waiting, staged = len(self._fifo), len(self._predicted), len(self._stages)
        issued = self._issue(credits, staged)
        entered = self._enter_table()
        decided, left = self._decide()
        taken = self._take(waiting)
        arrived = self._arrive(held)
        self._under_way = [op for op in self._under_way if op.commit > self.cycle]
        self._trace = [
            f"{self.cycle:7d}",
            f"in {arrived:>5} {held:3d}",
            f"predict {taken:>4} {waiting:2d}",
            f"issue {issued:5}",
            f"table {entered:5} {len(self._under_way):2d}",
            f"decide {decided:>5}",
            f"out {left:>4} {len(self._output):3d}",
        ]
        self.cycle += 1

    def _issue(self, credits: int, staged: int) -> str:
        """Issue one operation, if any can go (R3, R4)."""
        plan = self.plan
        if self.cycle < self._issue_from or staged > plan.drain_depth:
            return "-"
        if plan.scrub_cycles and (self._scrubs + 1) * plan.scrub_cycles <= self.cycle:
            self._scrubs += 1
            self._stages.append(_Op(SCRUB, issued=self.cycle))
            self._issue_from = self.cycle + 1
            return _NAMES[SCRUB]
        if not self._predicted or self._predicted[0].taken + plan.predict_depth > self.cycle:
            return "-"
        event = self._predicted[0]
        if not event.ops:
            self._decide_work(event)
        op = event.ops[0]
        if op.kind == MATCH and credits < 1:
            return "full"
        if op.kind != MATCH:
            commit = self._accepted[op.owner].commit
            if commit < 0 or self.cycle < commit + 2:
                return "wait"
        event.ops.popleft()
        op.issued = self.cycle
        self._stages.append(op)
        if event.first < 0:
            event.first = self.cycle
        self._issue_from = self.cycle + (1 if op.kind == MATCH else plan.pass_gap)
        if op.kind == MATCH:
            event.issued = self.cycle
            self._predicted.popleft()
            self._order.append(event)
        return _NAMES[op.kind]

    def _decide_work(self, event: Handled) -> None:
        """Ask the function what the event's operations are; the last one is its match."""
        e, i = self.events, event.number
        suppressed, count, _ = decide(
            self.rule, self.state, int(e.t[i]), int(e.x[i]), int(e.y[i]), int(e.p[i]), self._ops
        )
        event.suppressed = bool(suppressed)
        self._accepted.append(event)
        for row in self._ops[:count].tolist():
            event.ops.append(
                _Op(row[KIND], row[LEFT], row[RIGHT], row[TOP], row[LOW], bool(row[WRITES]), row[OWNER], event)
            )

    def _enter_table(self) -> str:
        """Let the oldest operation enter the table, if it may (R5, R6)."""
        if not self._stages or self._stages[0].issued + self.plan.drain_depth > self.cycle:
            return "-"
        op = self._stages[0]
        if op.kind == PASS:
            self._stages.popleft()
            return "by"
        lanes = self._lanes(op)
        if any(self._lane_free[lane] > self.cycle for lane in lanes):
            return "busy"
        if self.plan.interlocked and any(self._clash(op, other) for other in self._under_way):
            return "clash"
        self._stages.popleft()
        slots = {MATCH: self.plan.match_slots, WRITE: self.plan.pass_slots, SCRUB: self.plan.scrub_slots}[op.kind]
        if self.plan.cached and op.kind != SCRUB:
            slots = self._cache(op)
        op.commit = self.cycle + slots - 1 + self.plan.tail
        for lane in lanes:
            self._lane_free[lane] = op.commit + 1 if self.plan.serialised else self.cycle + slots
        self._under_way.append(op)
        if op.kind == MATCH and op.event is not None:
            op.event.commit = op.commit
        return _NAMES[op.kind]

    def _lanes(self, op: _Op) -> range:
        """Return the lanes that an operation touches: a span."""
        if op.kind == SCRUB:
            return range(self.plan.lanes)
        touched = []
        for column in range(op.left, op.right + 1):
            if self.rule.ways:
                sets = 1 << self.rule.set_columns
                touched.append(column % sets * self.plan.lanes // sets)
            else:
                touched.append(column * self.plan.lanes // self.rule.bins_x)
        return range(min(touched), max(touched) + 1)

    def _clash(self, op: _Op, other: _Op) -> bool:
        """Tell whether an operation under way may write what another one reads: the same bin, or the same set."""
        if not (other.writes or other.kind == SCRUB):
            return False
        if SCRUB in (op.kind, other.kind):
            return True
        columns = 1 << self.rule.set_columns if self.rule.ways else 1 << 40
        rows = 1 << self.rule.set_rows if self.rule.ways else 1 << 40

        def meet(one: range, two: range, period: int) -> bool:
            return bool({value % period for value in one} & {value % period for value in two})

        return meet(range(op.left, op.right + 1), range(other.left, other.right + 1), columns) and meet(
            range(op.top, op.low + 1), range(other.top, other.low + 1), rows
        )

    def _cache(self, op: _Op) -> int:
        """Return the slots of an operation behind the cache (R6)."""
        slots, rule, plan = 0, self.rule, self.plan
        for row in range(op.top, op.low + 1):
            for column in range(op.left, op.right + 1):
                cell = row * rule.bins_x + column
                if rule.ways:
                    cell = (row % (1 << rule.set_rows)) * (1 << rule.set_columns) + column % (1 << rule.set_columns)
                    cell *= rule.ways
                line = cell // plan.line_cells
                at = line % plan.cache_lines
                slots += 1
                if self._lines.get(at, -1) != line:
                    slots += plan.miss_cycles * (2 if at in self._dirty else 1)
                    self._lines[at] = line
                    self._dirty.discard(at)
                if op.writes:
                    self._dirty.add(at)
        return slots

    def _decide(self) -> tuple[str, str]:
        """Let the next decision leave in order, and the link take a residual (R7, R8)."""
        left = "-"
        if self._output and self._link_free_q16 <= self.cycle << 16:
            event = self._output.popleft()
            event.left = self.cycle
            self._link_free_q16 = max((event.decided + 1) << 16, self._link_free_q16) + self.plan.link
            left = str(event.number)
        if not self._order or not 0 <= self._order[0].commit <= self.cycle:
            return "-", left
        event = self._order.popleft()
        event.decided = self.cycle
        if event.suppressed:
            event.left = self.cycle
            return f"({event.number})", left
        self._output.append(event)
        return str(event.number), left

    def _take(self, waiting: int) -> str:
        """Take the next event from the input FIFO (R2)."""
        plan = self.plan
        if not self._fifo or waiting >= plan.predict_room or self.cycle < self._last_take + plan.predict_gap:
            return "-"
        event = self._fifo.popleft()
        event.taken = self._last_take = self.cycle
        self._predicted.append(event)
        return str(event.number)

    def _arrive(self, held: int) -> str:
        """Hold or drop the event that arrives in this cycle (R1)."""
        if not self._coming or self._coming[0].arrival != self.cycle:
            return "-"
        event = self._coming.popleft()
        if held >= self.plan.input_depth:
            event.dropped = True
            return f"x{event.number}"
        self._fifo.append(event)
        return str(event.number)
