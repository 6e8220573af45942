"""Time a firmware event by event: one core that decides, buffers before and behind it, memory that makes it wait.

Time is counted in cycles of the core; what happens in cycle ``c`` shows from ``c + 1`` on. The rules:

M1 **Input.** An event that arrives in cycle ``A`` is dropped when ``input_depth`` events are held at the start of that
   cycle; one whose decision started in a cycle before ``A`` is held no more. It can be taken from ``A + 1`` on.
   Behind ``blocks``, an event belongs to the half that is being filled; a half closes when it is full, or
   ``flush_cycles`` after its first event, whichever is first, and its events can be taken from the cycle after. Where
   both halves are closed and neither's events are all taken, the event is dropped. (Where a chunk of events ends, what
   comes later is not known: the half that is being filled closes by its timer.)
M2 **Order.** The core takes events in order, at ``S``, when it is free; a decision runs to its end.
M3 **Sweep.** Every ``sweep_cycles`` a block of cells wants to be looked at, in ``sweep_block`` cycles; what is pending
   goes first.
M4 **Decision.** From ``S`` it takes the cycles of its work: for each item of :data:`~.primitives.ITEMS` those of its
   instructions (with wait states of code in flash) and of the wait states of uncached arrays, then for each line that
   misses the data cache ``miss_cycles`` of its array; in all rounded up. ``D = S + cycles``.
M5 **Interrupts.** An interrupt runs before the decision of its event, ``interrupt_cycles`` as part of M4: of every
   event, of every first event of a half buffer, or none where a second core serves them.
M6 **Output.** A residual goes to the output buffer at ``P ≥ D``, when it holds fewer than ``output_depth`` at the start
   of the cycle; the core waits for that. The link can take it from ``P + 1`` on, one every ``link`` cycles (in 2^-16 of
   a cycle). The core is free from ``P`` (``D`` for a suppressed event) on.

The cache is simulated line by line, least recently used, write-allocate; writing a dirty line back is hidden by the
write buffer. A write and a pass touch the lines of their cells (with sets, of the whole set); a match those of its
window's rows; the ring those of its entries; buffers of DMA miss with every new line, for they are invalidated.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.function import KIND, LEFT, LOW, PASS, RIGHT, TOP, decide, rings_held
from tiegocancel.firmware_sim.core.loop import DROPPED
from tiegocancel.firmware_sim.core.rule import COUNTS, Rule, State
from tiegocancel.firmware_sim.jit import jit
from tiegocancel.firmware_sim.mcu.primitives import ITEMS

__all__ = ["CAUSES", "HITS", "MISSES", "Clock", "Plan", "lay_out_clock", "run_chunk"]

Int64s = NDArray[np.int64]

CAUSES = ("compute", "wait_states", "cache_misses", "interrupts", "sweep", "output_full")
"""What the core's cycles went to, in this order in ``Clock.spent``; code in flash counts as ``compute``."""
_COMPUTE, _WAIT, _MISS, _INTERRUPT, _SWEEP, _FULL = range(6)

_FREE, _TAKEN, _NEXT_SWEEP, _LINK_FREE, _RESIDUALS, _FILLED, _CLOSE, _HALVES, _INPUTS, MISSES, HITS = range(11)
_FOREVER = 1 << 62
_NEVER = -(1 << 40)

_SUPPRESSED, _PREDICTED, _OUTSIDE, _STILL = (COUNTS.index(n) for n in ("suppressed", "predicted", "outside", "still"))
_PASSES, _WRITES, _READ, _USES = (COUNTS.index(n) for n in ("passes", "writes", "cells_read", "uses_taken"))
_WAYS_WRITTEN, _WAYS_MATCHED = COUNTS.index("ways_written"), COUNTS.index("ways_matched")
_CANDIDATES, _TO_HIT, _WAYS_TO_HIT = (COUNTS.index(n) for n in ("candidates", "cells_to_hit", "ways_to_hit"))
(_I_EVENT, _I_PASS, _I_WRITE, _I_WAY_WRITTEN, _I_LOOK, _I_WAY_LOOKED, _I_CANDIDATE, _I_TAKE, _I_OUTPUT, _I_MAP,
 _I_STORE, _I_BORDER, _I_BORDER_OFFSET) = range(len(ITEMS))  # fmt: skip


class Plan(NamedTuple):
    """The firmware's constants; see the rules."""

    input_depth: int
    output_depth: int
    blocks: int  # 1: double buffering
    flush_cycles: int
    sweep_cycles: int  # 0: never
    sweep_block: int
    interrupt_every: int  # events, 0: no interrupts here
    interrupt_cycles: int
    link: int  # 2^-16 cycles for each residual
    stops: int  # looking stops at the first candidate
    reach: int  # px
    cost: Int64s  # [items] 2^-16 cycles
    wait: Int64s  # [items] cycles
    cached: int  # 1: table, 2: ring, 4: input, 8: output behind the data cache
    line_bytes: int
    cache_sets: int
    cache_ways: int
    miss_cycles: Int64s  # [4] for a line of table, ring, input, output
    table_base: int
    cell_bytes: int
    ring_base: int
    entry_bytes: int


class Clock(NamedTuple):
    """Where every part stands in time."""

    now: Int64s  # [11] scalars
    takes: Int64s  # [input_depth] cycles of the last takes
    leaves: Int64s  # [output_depth] cycles of the last departures
    half_done: Int64s  # [2] last take from either half
    tags: Int64s  # [cache_sets · cache_ways] line held, most recent first in a set, −1 none
    passed: Int64s  # [horizons] entries passed before this event
    before: Int64s  # [COUNTS] scratch
    work: Int64s  # [ITEMS] of the event
    done: Int64s  # [ITEMS] so far
    spent: Int64s  # [CAUSES] cycles so far


def lay_out_clock(plan: Plan, horizons: int) -> Clock:
    """Return a clock at rest."""
    now = np.zeros(11, np.int64)
    now[_NEXT_SWEEP] = plan.sweep_cycles or _FOREVER
    now[_CLOSE] = _NEVER
    return Clock(
        now=now,
        takes=np.full(plan.input_depth, _NEVER, np.int64),
        leaves=np.full(plan.output_depth, _NEVER, np.int64),
        half_done=np.full(2, _NEVER, np.int64),
        tags=np.full(max(plan.cache_sets * plan.cache_ways, 1), -1, np.int64),
        passed=np.zeros(horizons, np.int64),
        before=np.zeros(len(COUNTS), np.int64),
        work=np.zeros(len(ITEMS), np.int64),
        done=np.zeros(len(ITEMS), np.int64),
        spent=np.zeros(len(CAUSES), np.int64),
    )


@jit
def _touch(plan: Plan, clock: Clock, first: int, last: int) -> Any:
    """Bring the lines of the bytes ``first`` to ``last`` into the cache; return how many were not there."""
    missed, ways = 0, plan.cache_ways
    for line in range(first // plan.line_bytes, last // plan.line_bytes + 1):
        base = (line % plan.cache_sets) * ways
        at = ways - 1
        for way in range(ways):
            if clock.tags[base + way] == line:
                at = way
                break
        if clock.tags[base + at] == line:
            clock.now[HITS] += 1
        else:
            clock.now[MISSES] += 1
            missed += 1
        for way in range(at, 0, -1):
            clock.tags[base + way] = clock.tags[base + way - 1]
        clock.tags[base] = line
    return missed


@jit
def _touch_cells(rule: Rule, plan: Plan, clock: Clock, ops: NDArray[np.int64], op: int) -> Any:
    """Bring the cells of an operation into the cache."""
    missed = 0
    for row in range(ops[op, TOP], ops[op, LOW] + 1):
        if rule.ways == 0:
            first = plan.table_base + (row * rule.bins_x + ops[op, LEFT]) * plan.cell_bytes
            span = (ops[op, RIGHT] - ops[op, LEFT] + 1) * plan.cell_bytes
            missed += _touch(plan, clock, first, first + span - 1)
            continue
        for column in range(ops[op, LEFT], ops[op, RIGHT] + 1):
            low = ((row & ((1 << rule.set_rows) - 1)) << rule.set_columns) | (column & ((1 << rule.set_columns) - 1))
            first = plan.table_base + low * rule.ways * plan.cell_bytes
            missed += _touch(plan, clock, first, first + rule.ways * plan.cell_bytes - 1)
    return missed


@jit
def _misses(
    rule: Rule, state: State, plan: Plan, clock: Clock, ops: NDArray[np.int64], count: int, slot: int, suppressed: int
) -> Any:
    """Return the cycles that lines cost which an event misses."""
    missed, each = 0, plan.miss_cycles
    if plan.cached & 1:
        for op in range(count):
            if ops[op, KIND] != PASS:
                missed += _touch_cells(rule, plan, clock, ops, op) * each[0]
    if plan.cached & 2:
        for h in range(len(rule.horizon)):
            ring = h if rule.chooses else 0
            for number in range(clock.passed[h], state.passed[h]):
                at = state.ring_base[ring] + number % state.ring_room[ring]
                first = plan.ring_base + at * plan.entry_bytes
                missed += _touch(plan, clock, first, first + plan.entry_bytes - 1) * each[1]
            clock.passed[h] = state.passed[h]
        if slot >= 0:
            first = plan.ring_base + slot * plan.entry_bytes
            missed += _touch(plan, clock, first, first + plan.entry_bytes - 1) * each[1]
    fresh = max(plan.line_bytes // 8, 1)
    if plan.cached & 4 and clock.now[_INPUTS] % fresh == 0:
        missed += each[2]
        clock.now[MISSES] += 1
    if plan.cached & 8 and not suppressed and clock.now[_RESIDUALS] % fresh == 0:
        missed += each[3]
        clock.now[MISSES] += 1
    return missed


@jit
def _list_work(rule: Rule, state: State, plan: Plan, clock: Clock, x: int, y: int, suppressed: int, slot: int) -> None:
    """Fill ``clock.work`` with the items of the event that was just decided."""
    work, many = clock.work, len(rule.horizon)
    for c in range(len(state.counts)):
        clock.before[c] = state.counts[c] - clock.before[c]
    new = clock.before
    work[_I_EVENT], work[_I_PASS], work[_I_WRITE] = 1, new[_PASSES], new[_WRITES]
    work[_I_WAY_WRITTEN], work[_I_TAKE] = new[_WAYS_WRITTEN], new[_USES]
    if plan.stops:
        work[_I_LOOK], work[_I_WAY_LOOKED], work[_I_CANDIDATE] = new[_TO_HIT], new[_WAYS_TO_HIT], suppressed
    else:
        work[_I_LOOK], work[_I_WAY_LOOKED], work[_I_CANDIDATE] = new[_READ], new[_WAYS_MATCHED], new[_CANDIDATES]
    work[_I_OUTPUT], work[_I_STORE] = 1 - suppressed, new[_PREDICTED]
    maps = 0
    if rule.chooses:
        # Places are computed until a horizon is chosen; which one a discarded event would have chosen is not told.
        maps = many
        for ring in range(many):
            if slot >= state.ring_base[ring] and slot < state.ring_base[ring] + state.ring_room[ring]:
                maps = ring + 1
    elif not rule.at_gate:
        maps = many if new[_OUTSIDE] + new[_STILL] else 1
    work[_I_MAP] = maps
    reach = plan.reach
    border = x < reach or y < reach or x >= rule.width - reach or y >= rule.height - reach
    work[_I_BORDER] = 1 if border else 0
    work[_I_BORDER_OFFSET] = len(rule.dx) if border else 0


@jit
def _accept(plan: Plan, clock: Clock, arrival: Int64s, i: int) -> Any:
    """Return the cycle from which event ``i`` can be taken, −1 where it is dropped (M1)."""
    now, at = clock.now, arrival[i]
    if not plan.blocks:
        taken = now[_TAKEN]
        if taken >= plan.input_depth and clock.takes[taken % plan.input_depth] >= at:
            return -1
        return at + 1
    half = plan.input_depth // 2
    if now[_FILLED] == 0 or now[_FILLED] == half or at > now[_CLOSE]:
        if clock.half_done[now[_HALVES] % 2] >= at:
            return -1
        now[_HALVES] += 1
        now[_FILLED], now[_CLOSE] = 0, at + plan.flush_cycles
        if i + half <= len(arrival):
            now[_CLOSE] = min(now[_CLOSE], arrival[i + half - 1])
    now[_FILLED] += 1
    return now[_CLOSE] + 1


@jit
def _start(plan: Plan, clock: Clock, ready: int) -> Any:
    """Return when the core starts an event that is ready at ``ready``, after the sweeps that go first (M2, M3)."""
    now = clock.now
    while True:
        at = max(ready, now[_FREE])
        if now[_NEXT_SWEEP] > at:
            return at
        idle = (at - now[_NEXT_SWEEP]) // plan.sweep_cycles - 1
        if now[_FREE] <= now[_NEXT_SWEEP] and idle > 0:
            # Requests served while nothing waits end before the next one.
            now[_NEXT_SWEEP] += idle * plan.sweep_cycles
            clock.spent[_SWEEP] += idle * plan.sweep_block
        now[_FREE] = max(now[_FREE], now[_NEXT_SWEEP]) + plan.sweep_block
        now[_NEXT_SWEEP] += plan.sweep_cycles
        clock.spent[_SWEEP] += plan.sweep_block


@jit
def _deliver(plan: Plan, clock: Clock, decided: int) -> Any:
    """Put a residual into the output buffer; return when it leaves (M6)."""
    now = clock.now
    slot = now[_RESIDUALS] % plan.output_depth
    put = max(decided, clock.leaves[slot] + 1)
    clock.spent[_FULL] += put - decided
    free_q16 = max((put + 1) << 16, now[_LINK_FREE])
    left = (free_q16 + 65535) >> 16
    now[_LINK_FREE] = free_q16 + plan.link
    clock.leaves[slot] = left
    now[_RESIDUALS] += 1
    now[_FREE] = put
    return left


@jit
def run_chunk(
    rule: Rule,
    state: State,
    plan: Plan,
    clock: Clock,
    t: Int64s,
    x: NDArray[np.uint16],
    y: NDArray[np.uint16],
    p: NDArray[np.uint8],
    arrival: Int64s,
    saturated: int,
    ops: NDArray[np.int64],
    fate: NDArray[np.uint8],
    cycles: NDArray[np.int64],
) -> None:
    """Fill ``fate`` [n] and ``cycles`` [n, 4]: start, decision, departure; −1 where dropped.

    The last column is not a cycle: how many entries the rings hold after the event.

    ``arrival`` [n] rises; when ``saturated`` it is not looked at: the next event always waits.
    """
    now = clock.now
    for i in range(len(t)):
        ready = now[_FREE] if saturated else _accept(plan, clock, arrival, i)
        if ready < 0:
            fate[i] = DROPPED
            cycles[i, :] = -1
            continue
        start = _start(plan, clock, ready)
        clock.takes[now[_TAKEN] % plan.input_depth] = start
        now[_TAKEN] += 1
        if plan.blocks:
            clock.half_done[(now[_HALVES] - 1) % 2] = start
        for c in range(len(state.counts)):
            clock.before[c] = state.counts[c]
        suppressed, count, slot = decide(rule, state, t[i], int(x[i]), int(y[i]), int(p[i]), ops)
        _list_work(rule, state, plan, clock, int(x[i]), int(y[i]), suppressed, slot)
        cost, wait = 0, 0
        for item in range(len(plan.cost)):
            cost += clock.work[item] * plan.cost[item]
            wait += clock.work[item] * plan.wait[item]
            clock.done[item] += clock.work[item]
        compute = max((cost + 65535) >> 16, 1)
        missing = 0
        if plan.cached:
            missing = _misses(rule, state, plan, clock, ops, count, slot, suppressed)
        serve = 0
        if plan.interrupt_every and now[_INPUTS] % plan.interrupt_every == 0:
            serve = plan.interrupt_cycles
        now[_INPUTS] += 1
        decided = start + compute + wait + missing + serve
        spent = clock.spent
        spent[_COMPUTE] += compute
        spent[_WAIT] += wait
        spent[_MISS] += missing
        spent[_INTERRUPT] += serve
        left = decided
        now[_FREE] = decided
        if not suppressed:
            left = _deliver(plan, clock, decided)
        fate[i] = suppressed
        cycles[i, 0], cycles[i, 1], cycles[i, 2], cycles[i, 3] = start, decided, left, rings_held(rule, state)
