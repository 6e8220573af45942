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

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.config import CoreConfig, window_shape
from tiegocancel.firmware_sim.core.function import KIND, LEFT, LOW, MATCH, PASS, READY, RIGHT, TOP, WRITE, WRITES
from tiegocancel.firmware_sim.core.rule import Rule
from tiegocancel.firmware_sim.jit import jit

from tiegocancel.matching.config import CancelConfig

__all__ = ["CAUSES", "Clock", "Plan", "drops", "fastest_scrub", "issue_event", "lay_out_clock", "lay_out_plan", "take"]

Int64s = NDArray[np.int64]

SCRUB = 3
"""Kind of an operation beside those of :mod:`function`."""

CAUSES = ("ring", "credit", "places", "scrub", "lane", "hazard")
"""Why an operation waited, in this order in ``Clock.waited``: for an entry just stored, for room in the output, for
room before the table, for a scrub, for a lane in use, for a write under way."""
_RING, _CREDIT, _PLACES, _SCRUB_WAIT, _LANE, _HAZARD = range(6)

LAST_TAKE, LAST_ISSUE, GAP, LAST_ENTRY, LAST_OUT, LINK_FREE, NEXT_SCRUB, TAKEN, OPS, MATCHES = range(10)
WORK_READS, WORK_WRITES, WORK_MAPS, WORK_PREDICTS, WORK_SCRUBS, WORK_MISSES, WORK_HITS = range(7)
WORK = ("table_reads", "table_writes", "drain_maps", "predict_maps", "scrubs", "cache_misses", "cache_hits")
"""What ``Clock.work`` holds, in this order: slots read and cells written in the table, places computed, words scrubbed,
lines missed and met in the cache."""

_EVERYTHING = 1 << 40
_FOREVER = 1 << 62


class Plan(NamedTuple):
    """The core's constants, in cycles; see the rules."""

    input_depth: int
    output_depth: int
    predict_gap: int
    predict_depth: int
    predict_room: int
    pass_gap: int
    drain_depth: int
    lanes: int
    serialised: int  # overlap none
    interlocked: int
    pass_slots: int
    match_slots: int
    tail: int  # cycles from the last slot to the commit
    scrub_cycles: int
    scrub_slots: int
    link: int  # 2^-16 cycles for each residual, 0 for as many as come
    cached: int
    line_cells: int
    cache_lines: int
    miss_cycles: int


class Clock(NamedTuple):
    """Where every part stands in time."""

    now: Int64s  # [10] scalars
    takes: Int64s  # [max(input_depth, 1)] cycles of the last takes
    issues: Int64s  # [predict_room] cycles of the last matches
    entries: Int64s  # [drain_depth + 1] cycles of the last entries to the table
    lane_free: Int64s  # [lanes]
    writers: Int64s  # [under way, 5] commit, bins of operations that may write
    early_returns: Int64s  # [output_depth] ends of matches that were suppressed
    late_returns: Int64s  # [output_depth] ends of residuals in the output FIFO
    queues: Int64s  # [4] head and length of the two
    tags: Int64s  # [cache_lines] line held, −1 none
    dirty: Int64s  # [cache_lines]
    waited: Int64s  # [CAUSES]
    work: Int64s  # [WORK]


def fastest_scrub(core: CoreConfig) -> int:
    """Return the least cycles between two words of the sweep: twice what one of them takes."""
    return 2 * (core.read_latency + core.select_depth + scrub_slots(core))


def scrub_slots(core: CoreConfig) -> int:
    """Return the slots of one word of the sweep: one, and behind a cache its share of the line that is streamed."""
    return 1 + (-(-core.miss_cycles // core.line_cells) if core.table_memory == "external" else 0)


def lay_out_plan(core: CoreConfig, cancel: CancelConfig, *, scrub_cycles: int, link_q16: int) -> Plan:
    """Return the constants of a core for a configuration of the canceller.

    Raise ``ValueError`` for a sweep that leaves events no cycle: ``scrub_cycles`` must be 0 or above
    :func:`fastest_scrub`.
    """
    if 0 < scrub_cycles < fastest_scrub(core):
        raise ValueError(
            f"scrub_cycles must be 0 or at least {fastest_scrub(core)}, or the sweep leaves no room for events, "
            f"not {scrub_cycles}"
        )
    bins, _, rows = window_shape(cancel)
    ways = 1 if cancel.set_bits is None else cancel.ways
    together = core.ways_per_read or ways
    read = -(-ways // together)
    asks = cancel.motion_at == "event" or cancel.spreads or cancel.chooses or cancel.lines
    maps = len(cancel.horizons_us) if cancel.motion_at == "event" or cancel.chooses else 1
    stores_places = cancel.is_plain
    return Plan(
        input_depth=core.input_depth,
        output_depth=core.output_depth,
        predict_gap=-(-4 * maps // core.predict_multipliers) if asks else 1,
        predict_depth=core.map_depth if asks else 1,
        predict_room=(core.map_depth if asks else 1) + 1,
        pass_gap=1 if stores_places else -(-4 // core.drain_multipliers),
        drain_depth=0 if stores_places else core.map_depth,
        lanes=core.lanes,
        serialised=int(core.overlap == "none"),
        interlocked=int(core.overlap == "interlock"),
        pass_slots=read,
        match_slots=read * {"serial": bins, "row": rows, "banked": 1}[core.lookup],
        tail=core.read_latency + core.select_depth,
        scrub_cycles=scrub_cycles,
        scrub_slots=scrub_slots(core),
        link=link_q16,
        cached=int(core.table_memory == "external"),
        line_cells=core.line_cells,
        cache_lines=core.cache_lines,
        miss_cycles=core.miss_cycles,
    )


def lay_out_clock(plan: Plan) -> Clock:
    """Return a clock at rest."""
    now = np.zeros(10, np.int64)
    now[[LAST_TAKE, LAST_ISSUE, LAST_ENTRY, LAST_OUT]] = -_EVERYTHING
    now[NEXT_SCRUB] = plan.scrub_cycles or _FOREVER
    under_way = plan.match_slots + plan.tail + plan.drain_depth + 2

    def never(length: int) -> Int64s:
        return np.full(length, -_EVERYTHING, np.int64)

    return Clock(
        now=now,
        takes=never(plan.input_depth),
        issues=never(plan.predict_room),
        entries=never(plan.drain_depth + 1),
        lane_free=never(plan.lanes),
        writers=never(5 * under_way * (1 if plan.interlocked else 0)).reshape(-1, 5),
        early_returns=never(plan.output_depth),
        late_returns=never(plan.output_depth),
        queues=np.zeros(4, np.int64),
        tags=np.full(plan.cache_lines if plan.cached else 1, -1, np.int64),
        dirty=np.zeros(plan.cache_lines if plan.cached else 1, np.int64),
        waited=np.zeros(len(CAUSES), np.int64),
        work=np.zeros(len(WORK), np.int64),
    )


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
        first = _FOREVER
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
