"""Lay out what the timing of a core needs: its constants in cycles, and where every part stands in time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.config import CoreConfig, window_shape

from tiegocancel.matching.config import CancelConfig

__all__ = [
    "CAUSES",
    "NEVER",
    "SCRUB",
    "WORK",
    "Clock",
    "Plan",
    "fastest_scrub",
    "lay_out_clock",
    "lay_out_plan",
    "scrub_slots",
]

Int64s = NDArray[np.int64]

SCRUB = 3
"""Kind of an operation beside those of :mod:`function`."""

CAUSES = ("ring", "credit", "places", "scrub", "lane", "hazard")
"""Why an operation waited, in this order in ``Clock.waited``: for an entry just stored, for room in the output, for
room before the table, for a scrub, for a lane in use, for a write under way."""

LAST_TAKE, LAST_ISSUE, GAP, LAST_ENTRY, LAST_OUT, LINK_FREE, NEXT_SCRUB, TAKEN, OPS, MATCHES = range(10)
WORK_READS, WORK_WRITES, WORK_MAPS, WORK_PREDICTS, WORK_SCRUBS, WORK_MISSES, WORK_HITS = range(7)
WORK = ("table_reads", "table_writes", "drain_maps", "predict_maps", "scrubs", "cache_misses", "cache_hits")
"""What ``Clock.work`` holds, in this order: slots read and cells written in the table, places computed, words scrubbed,
lines missed and met in the cache."""

NEVER = 1 << 62
"""Later than every cycle of a run."""

_LONG_AGO = -(1 << 40)


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
    now[[LAST_TAKE, LAST_ISSUE, LAST_ENTRY, LAST_OUT]] = _LONG_AGO
    now[NEXT_SCRUB] = plan.scrub_cycles or NEVER
    under_way = plan.match_slots + plan.tail + plan.drain_depth + 2

    def never(length: int) -> Int64s:
        return np.full(length, _LONG_AGO, np.int64)

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
