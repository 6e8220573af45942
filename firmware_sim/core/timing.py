"""Time the matching core, operation by operation, to the cycle: event-driven, so that idle cycles cost nothing.

Time is counted in cycles; what happens in cycle ``c`` shows from ``c + 1`` on. An event is a list of operations in
program order: passes of ring entries whose gate has opened, then its match. The rules:

R1 **Input FIFO.** An event that arrives in cycle ``A`` is dropped when ``input_depth`` events are held at the start of
   that cycle, and can be taken from ``A + 1`` on. One event a cycle at most.
R2 **Predict.** Events are taken in order, at ``P ≥ A + 1``, one every ``⌈4·maps / predict_multipliers⌉`` cycles, while
   fewer than ``map_depth + 1`` are between predict and issue at the start of the cycle. An event taken at ``P`` can
   issue from ``S = P + map_depth`` on. Where no motion is asked of events (``motion_at = gate`` without a gate that
   spreads, a line or a choice of horizons), predict is a register: one a cycle, ``S = P + 1``, two places.
R3 **Issue.** One operation a cycle, in program order, not before ``S``. After a pass that needs a place computed the
   next issue waits ``⌈4 / drain_multipliers⌉`` cycles. An entry can be passed from two cycles after the commit of the
   match that stored it. A match issues while fewer than ``output_depth`` matches are undecided or have left a residual
   in the output FIFO, at the start of the cycle (credits).
R4 **Scrub.** Every ``scrub_cycles`` a request to look at one word in every lane is raised; pending requests issue
   before anything else that could issue in the same cycle. It takes one slot; behind a cache, which it goes round, also
   its share ``⌈miss_cycles / line_cells⌉`` of streaming the line.
R5 **Places.** From issue to the table lie ``drain_depth`` stages (``map_depth`` where ring entries hold events, 0 where
   they hold predictions: the plain rule), elastic and in order; ``drain_depth + 1`` operations are under way at most.
R6 **Table.** One operation enters a cycle, in order, when every lane that it touches is free. A pass reads its set in
   ``⌈ways / ways_per_read⌉`` slots; a match reads as many slots for each bin of its window (``serial``), each row of
   bins (``row``), or once (``banked``). Behind a cache, a slot for every bin and ``miss_cycles`` for each line missed.
   A lane is free again after the slots; with ``overlap = none`` in the cycle after the commit. With ``interlock`` an
   operation waits for the commit of every one under way that may write to bins (or sets) that it reads; a scrub waits
   for all and all wait for it.
R7 **Commit.** ``K = entry + slots − 1 + read_latency + select_depth``. Cells written show from ``K + 1`` on.
R8 **Output.** Decisions leave in order, one a cycle, at ``Z ≥ K``. A residual can be taken by the link from ``Z + 1``
   on, one every ``link`` cycles (in 2^-16 of a cycle).

Latency of an event is ``Z − A``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.function import KIND, LEFT, LOW, MATCH, PASS, READY, RIGHT, TOP, WRITE, WRITES
from tiegocancel.firmware_sim.core.plan import (
    GAP,
    LAST_ENTRY,
    LAST_ISSUE,
    LAST_OUT,
    LAST_TAKE,
    LINK_FREE,
    MATCHES,
    NEVER,
    NEXT_SCRUB,
    OPS,
    SCRUB,
    TAKEN,
    WORK_HITS,
    WORK_MAPS,
    WORK_MISSES,
    WORK_PREDICTS,
    WORK_READS,
    WORK_SCRUBS,
    WORK_WRITES,
    Clock,
    Plan,
)
from tiegocancel.firmware_sim.core.rule import Rule
from tiegocancel.firmware_sim.jit import jit

__all__ = ["drops", "issue_event", "take"]

_RING, _CREDIT, _PLACES, _SCRUB_WAIT, _LANE, _HAZARD = range(6)
"""Places in ``Clock.waited``, as ``plan.CAUSES`` names them."""


@jit
def drops(plan: Plan, clock: Clock, arrival: int) -> Any:
    """Tell whether an event that arrives now finds the input FIFO full (R1)."""
    taken = clock.now[TAKEN]
    return taken >= plan.input_depth and clock.takes[taken % plan.input_depth] >= arrival


@jit
def take(plan: Plan, clock: Clock, arrival: int) -> Any:
    """Return the cycle in which predict takes an event (R2)."""
    now = clock.now
    matches = now[MATCHES]
    at = max(arrival + 1, now[LAST_TAKE] + plan.predict_gap)
    if matches >= plan.predict_room:
        at = max(at, clock.issues[matches % plan.predict_room] + 1)
    now[LAST_TAKE] = at
    clock.takes[now[TAKEN] % plan.input_depth] = at
    now[TAKEN] += 1
    clock.work[WORK_PREDICTS] += 1
    return at


@jit
def _credit(plan: Plan, clock: Clock, at: int) -> Any:
    """Return the first cycle from ``at`` on in which a match may issue (R3)."""
    queues, depth = clock.queues, plan.output_depth
    while True:
        while queues[1] > 0 and clock.early_returns[queues[0] % depth] < at:
            queues[0] += 1
            queues[1] -= 1
        while queues[3] > 0 and clock.late_returns[queues[2] % depth] < at:
            queues[2] += 1
            queues[3] -= 1
        if queues[1] + queues[3] < depth:
            return at
        first = NEVER
        if queues[1] > 0:
            first = min(first, clock.early_returns[queues[0] % depth])
        if queues[3] > 0:
            first = min(first, clock.late_returns[queues[2] % depth])
        at = first + 1


@jit
def _apart(low: int, high: int, other_low: int, other_high: int, period: int) -> Any:
    """Tell whether two spans have no number in common, modulo ``period`` where it is not 0."""
    if period == 0:
        return high < other_low or other_high < low
    if high - low + 1 >= period or other_high - other_low + 1 >= period:
        return False
    return (other_low - low) % period > high - low and (low - other_low) % period > other_high - other_low


@jit
def _hazard(rule: Rule, clock: Clock, at: int, left: int, right: int, top: int, low: int) -> Any:
    """Return the first cycle from ``at`` on in which no write under way can touch these bins (R6)."""
    columns = 0 if rule.ways == 0 else 1 << rule.set_columns
    rows = 0 if rule.ways == 0 else 1 << rule.set_rows
    for w in range(len(clock.writers)):
        commit = clock.writers[w, 0]
        if commit < at:
            continue
        apart = left >= 0 and clock.writers[w, 1] >= 0
        if apart:
            apart = _apart(left, right, clock.writers[w, 1], clock.writers[w, 2], columns)
            apart = apart or _apart(top, low, clock.writers[w, 3], clock.writers[w, 4], rows)
        if not apart:
            at = commit + 1
    return at


@jit
def _cached_slots(rule: Rule, plan: Plan, clock: Clock, ops: NDArray[np.int64], op: int) -> Any:
    """Return the slots of an operation behind the cache, and move its lines."""
    slots = 0
    for row in range(ops[op, TOP], ops[op, LOW] + 1):
        for column in range(ops[op, LEFT], ops[op, RIGHT] + 1):
            cell = row * rule.bins_x + column
            if rule.ways:
                cell = (
                    ((row & ((1 << rule.set_rows) - 1)) << rule.set_columns) | (column & ((1 << rule.set_columns) - 1))
                ) * rule.ways
            line = cell // plan.line_cells
            at = line % plan.cache_lines
            slots += 1
            if clock.tags[at] == line:
                clock.work[WORK_HITS] += 1
            else:
                clock.work[WORK_MISSES] += 1
                slots += plan.miss_cycles * (2 if clock.dirty[at] else 1)
                clock.tags[at], clock.dirty[at] = line, 0
            if ops[op, WRITES]:
                clock.dirty[at] = 1
    return slots


@jit
def _lanes_of(rule: Rule, plan: Plan, column: int) -> Any:
    """Return the lane of a column of bins, or of the column of its set."""
    if plan.lanes == 1:
        return 0
    if rule.ways:
        return ((column & ((1 << rule.set_columns) - 1)) * plan.lanes) >> rule.set_columns
    return column * plan.lanes // rule.bins_x


@jit
def _enter(
    rule: Rule, plan: Plan, clock: Clock, issue: int, kind: int, ops: NDArray[np.int64], op: int, slots: int
) -> Any:
    """Let an operation that issued enter the table and return its commit (R5 to R7)."""
    now = clock.now
    at = max(issue + plan.drain_depth, now[LAST_ENTRY] + 1)
    ready = at
    first, last = 0, plan.lanes - 1
    if kind != SCRUB and plan.lanes > 1:
        first, last = plan.lanes, -1
        for column in range(ops[op, LEFT], ops[op, RIGHT] + 1):
            lane = _lanes_of(rule, plan, column)
            first, last = min(first, lane), max(last, lane)
    for lane in range(first, last + 1):
        at = max(at, clock.lane_free[lane])
    clock.waited[_LANE] += at - ready
    if plan.interlocked:
        ready = at
        if kind == SCRUB:
            at = _hazard(rule, clock, at, -1, -1, -1, -1)
        else:
            at = _hazard(rule, clock, at, ops[op, LEFT], ops[op, RIGHT], ops[op, TOP], ops[op, LOW])
        clock.waited[_HAZARD] += at - ready
    commit = at + slots - 1 + plan.tail
    for lane in range(first, last + 1):
        clock.lane_free[lane] = commit + 1 if plan.serialised else at + slots
    now[LAST_ENTRY] = at
    clock.entries[now[OPS] % len(clock.entries)] = at
    if plan.interlocked and (kind == SCRUB or ops[op, WRITES]):
        w = now[OPS] % len(clock.writers)
        clock.writers[w, 0] = commit
        if kind == SCRUB:
            clock.writers[w, 1] = -1
        else:
            clock.writers[w, 1], clock.writers[w, 2] = ops[op, LEFT], ops[op, RIGHT]
            clock.writers[w, 3], clock.writers[w, 4] = ops[op, TOP], ops[op, LOW]
    now[OPS] += 1
    return commit


@jit
def _scrub(rule: Rule, plan: Plan, clock: Clock, until: int, ops: NDArray[np.int64]) -> Any:
    """Issue the scrubs that go before an operation that could issue at ``until``; tell whether there was any (R4).

    While the core is idle one scrub ends long before the next, so all but the last two leave no trace: they are counted
    at once.
    """
    now = clock.now
    if now[NEXT_SCRUB] > until:
        return False
    room = len(clock.entries)
    idle = max(now[LAST_ISSUE] + now[GAP], now[LAST_ENTRY] + 1)
    for lane in range(plan.lanes):
        idle = max(idle, clock.lane_free[lane])
    spare = (until - now[NEXT_SCRUB]) // plan.scrub_cycles - 2
    quick = plan.scrub_cycles > plan.drain_depth + plan.tail + plan.scrub_slots + 1
    if quick and spare > 0 and now[NEXT_SCRUB] > idle + plan.tail + plan.drain_depth:
        now[NEXT_SCRUB] += spare * plan.scrub_cycles
        clock.work[WORK_SCRUBS] += spare
        clock.work[WORK_READS] += spare * plan.scrub_slots
    at = max(now[NEXT_SCRUB], now[LAST_ISSUE] + now[GAP], clock.entries[now[OPS] % room] + 1)
    if at > until:
        return False
    _enter(rule, plan, clock, at, SCRUB, ops, 0, plan.scrub_slots)
    now[LAST_ISSUE], now[GAP] = at, 1
    now[NEXT_SCRUB] += plan.scrub_cycles
    clock.work[WORK_SCRUBS] += 1
    clock.work[WORK_READS] += plan.scrub_slots
    return True


@jit
def issue_event(
    rule: Rule, plan: Plan, clock: Clock, start: int, suppressed: int, ops: NDArray[np.int64], count: int
) -> Any:
    """Issue an event's operations from cycle ``start`` = ``S`` on (R3 to R8).

    Return the cycles of the first issue and of the match's issue, of the commit, of the decision, and of the residual's
    leaving (the decision's own where it was suppressed).
    """
    now, room = clock.now, len(clock.entries)
    first, commit = -1, 0
    for op in range(count):
        kind = ops[op, KIND]
        free = max(start, now[LAST_ISSUE] + now[GAP])
        scrubbed, credit = False, 0
        while True:
            base = max(start, now[LAST_ISSUE] + now[GAP])
            at = base
            if kind != MATCH:
                at = max(at, ops[op, READY])
            ringed = at
            if kind == MATCH:
                # A credit that was found stays found; what returned before it is forgotten.
                at = credit = _credit(plan, clock, max(at, credit))
            credited = at
            at = max(at, clock.entries[now[OPS] % room] + 1)
            if not _scrub(rule, plan, clock, at, ops):
                break
            scrubbed = True
        clock.waited[_RING] += ringed - base
        clock.waited[_CREDIT] += credited - ringed
        clock.waited[_PLACES] += at - credited
        if scrubbed and base > free:
            clock.waited[_SCRUB_WAIT] += base - free
        if first < 0:
            first = at
        now[LAST_ISSUE] = at
        now[GAP] = 1 if kind == MATCH else plan.pass_gap
        slots = plan.match_slots if kind == MATCH else plan.pass_slots
        if kind != PASS:
            if plan.cached:
                slots = _cached_slots(rule, plan, clock, ops, op)
            commit = _enter(rule, plan, clock, at, kind, ops, op, slots)
            clock.work[WORK_READS] += slots
        else:
            _skip(plan, clock, at)
        if kind != MATCH:
            clock.work[WORK_MAPS] += 1
        if kind == WRITE:
            clock.work[WORK_WRITES] += 1
    issued = now[LAST_ISSUE]
    clock.issues[now[MATCHES] % plan.predict_room] = issued
    now[MATCHES] += 1
    decided = max(commit, now[LAST_OUT] + 1)
    now[LAST_OUT] = decided
    left, queues = decided, clock.queues
    if suppressed:
        if rule.uses:
            clock.work[WORK_WRITES] += 1
        clock.early_returns[(queues[0] + queues[1]) % plan.output_depth] = decided
        queues[1] += 1
    else:
        free_q16 = max((decided + 1) << 16, now[LINK_FREE])
        left = (free_q16 + 65535) >> 16
        now[LINK_FREE] = free_q16 + plan.link
        clock.late_returns[(queues[2] + queues[3]) % plan.output_depth] = left
        queues[3] += 1
    return first, issued, commit, decided, left


@jit
def _skip(plan: Plan, clock: Clock, issue: int) -> None:
    """Let a pass without effect go by the table: it takes its place in the order and nothing else."""
    now = clock.now
    at = max(issue + plan.drain_depth, now[LAST_ENTRY] + 1)
    now[LAST_ENTRY] = at
    clock.entries[now[OPS] % len(clock.entries)] = at
    now[OPS] += 1
