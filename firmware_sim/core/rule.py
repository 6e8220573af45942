"""Lay out what the matching core decides with: the rule's constants and its state, as plain arrays of integers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tiegocancel.matching.config import CancelConfig

__all__ = ["COUNTS", "Rule", "State", "lay_out_rule", "lay_out_state"]

Int64s = NDArray[np.int64]

COUNTS = (
    "events", "suppressed", "predicted", "outside", "overflow", "overwritten", "ring_high_water", "still",
    "passes", "writes", "late_passes", "cells_read", "uses_taken",
    "ways_matched", "ways_written", "candidates", "cells_to_hit", "ways_to_hit",
)  # fmt: skip
"""What ``State.counts`` holds, in this order: the canceller's counters, then the core's work.

``passes`` of entries by horizon pointers, ``writes`` of cells among them, ``late_passes`` whose gate had closed before
an event came to pass them (they are never written), ``cells_read`` by matches, ``uses_taken`` from cells by hits.
``ways_matched`` and ``ways_written``: cells of sets compared to find one bin's, by matches and by writes;
``candidates`` of matches; ``cells_to_hit`` and ``ways_to_hit``: read up to the first candidate, else all:
what a processor looks at that stops there.
"""


class Rule(NamedTuple):
    """Constants of one configuration on one sensor, in ticks and px; see ``matching/semantics.md``.

    ``stamp_period``: 0 where a sweep hides aliases or stamps never wrap, so that cells know their age exactly;
    otherwise ``2^T``: stamps are compared modulo this and stale cells come back.
    """

    width: int
    height: int
    tick_bits: int
    stamp_period: int
    horizon: Int64s  # [horizons], rising
    early: int
    late: Int64s  # [2] of OFF and ON predictions
    reach: Int64s  # [2] px²
    flip: int
    blur: int
    bin_bits: int
    bins_x: int
    set_columns: int
    set_rows: int
    ways: int  # 0: one cell for every bin
    uses: int
    carry: int
    need: int
    least_squared: int
    chooses: int
    choose_squared: int
    at_gate: int
    dx: Int64s  # [window]
    dy: Int64s  # [window]
    offset_shift: Int64s  # [window] px², least shift at which each offset is looked at
    spreads: int
    lines: int
    fraction_bits: int
    line_limit: int
    row_t: Int64s  # [rows] µs
    rows: Int64s  # [horizons · rows · 6]


class State(NamedTuple):
    """Everything that changes: rings, table, counters and scratch."""

    ring_base: Int64s  # [rings] first slot
    ring_room: Int64s  # [rings] slots
    ring_t: Int64s  # [slots] µs
    ring_x: Int64s
    ring_y: Int64s
    ring_p: Int64s
    ring_support: Int64s
    ring_ready: Int64s  # [slots] first cycle in which the entry can be passed
    ring_owner: Int64s  # [slots] which event it is, counting those decided
    stored: Int64s  # [rings]
    passed: Int64s  # [horizons]
    cell_bin: Int64s  # [cells]
    cell_due: Int64s  # [cells] ticks
    cell_p: Int64s
    cell_horizons: Int64s  # a bit for each, 0 is empty
    cell_uses: Int64s
    cell_support: Int64s
    cell_x: Int64s  # place of the last prediction, with fraction_bits below the pixel; one cell where no line is asked
    cell_y: Int64s
    counts: Int64s  # see COUNTS
    seen: Int64s  # [window] scratch: bins that a match has looked at
    row_hint: Int64s  # [horizons + 1] scratch: row of the schedule last used by each pointer, and by events


def lay_out_rule(
    config: CancelConfig,
    row_t: Int64s,
    rows: Int64s,
    *,
    width: int,
    height: int,
    stamp_period: int = 0,
) -> Rule:
    """Return the constants; ``row_t`` int64[rows] and ``rows`` int64[horizons, rows, 6] are the motion schedules."""
    tick = config.tick_bits
    offsets = np.array(config.offsets, np.int64).reshape(-1, 2)
    columns, lines = config.set_bits or (0, 0)
    return Rule(
        width=width,
        height=height,
        tick_bits=tick,
        stamp_period=stamp_period,
        horizon=np.array(config.horizons_us, np.int64) >> tick,
        early=config.early_gate_us >> tick,
        late=np.array(config.late_gates_us, np.int64) >> tick,
        reach=np.array(config.reaches_squared_px, np.int64),
        flip=int(config.polarity == "equal"),
        blur=int(config.polarity == "ignore"),
        bin_bits=config.bin_bits,
        bins_x=((width - 1) >> config.bin_bits) + 1,
        set_columns=columns,
        set_rows=lines,
        ways=0 if config.set_bits is None else config.ways,
        uses=config.uses,
        carry=config.carry,
        need=config.need,
        least_squared=config.least_shift_squared_px,
        chooses=int(config.chooses),
        choose_squared=config.choose_squared_px,
        at_gate=int(config.motion_at == "gate"),
        dx=offsets[:, 0].copy(),
        dy=offsets[:, 1].copy(),
        offset_shift=np.array(config.spread_shifts_squared, np.int64),
        spreads=int(config.spreads),
        lines=int(config.lines),
        fraction_bits=config.fraction_bits,
        line_limit=config.line_limit if config.lines else 0,
        row_t=np.array(row_t, np.int64),
        rows=np.array(rows, np.int64).reshape(-1),
    )


def lay_out_state(config: CancelConfig, *, width: int, height: int) -> State:
    """Return an empty state."""
    rooms = np.array(config.ring_capacities, np.int64)
    slots = int(rooms.sum())
    bins = (((width - 1) >> config.bin_bits) + 1) * (((height - 1) >> config.bin_bits) + 1)
    cells = bins if config.set_bits is None else config.ways << sum(config.set_bits)
    horizons = len(config.horizons_us)

    def zeros(length: int) -> Int64s:
        return np.zeros(length, np.int64)

    return State(
        ring_base=np.concatenate([[0], np.cumsum(rooms)[:-1]]).astype(np.int64),
        ring_room=rooms,
        ring_t=zeros(slots),
        ring_x=zeros(slots),
        ring_y=zeros(slots),
        ring_p=zeros(slots),
        ring_support=zeros(slots),
        ring_ready=zeros(slots),
        ring_owner=zeros(slots),
        stored=zeros(len(rooms)),
        passed=zeros(horizons),
        cell_bin=zeros(cells),
        cell_due=zeros(cells),
        cell_p=zeros(cells),
        cell_horizons=zeros(cells),
        cell_uses=zeros(cells),
        cell_support=zeros(cells),
        cell_x=zeros(cells if config.lines else 1),
        cell_y=zeros(cells if config.lines else 1),
        counts=zeros(len(COUNTS)),
        seen=zeros(max(len(config.offsets), 1)),
        row_hint=zeros(horizons + 1),
    )
