"""Decide one event as the semantics say, and list the work that it takes: entries passed, cells written, cells read."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.rule import Rule, State
from tiegocancel.firmware_sim.jit import jit

__all__ = [
    "KIND", "LEFT", "LOW", "MATCH", "OP_FIELDS", "OWNER", "PASS", "READY", "RIGHT", "TOP", "WRITE", "WRITES",
    "decide", "op_room", "rings_held",
]  # fmt: skip

Int64s = NDArray[np.int64]

PASS, WRITE, MATCH = 0, 1, 2
"""Kinds of operation: an entry passed without effect, one passed and written to its cell, the match of an event."""

KIND, LEFT, RIGHT, TOP, LOW, READY, WRITES, OWNER = range(8)
"""Fields of an operation: its kind, the bins that it touches (first and last column and row), the first cycle in which
its ring entry can be read, whether it may write to the bins that it touches, and whose entry is passed."""
OP_FIELDS = 8

_COUNT_SUPPRESSED, _PREDICTED, _OUTSIDE, _OVERFLOW, _OVERWRITTEN, _HIGH, _STILL = 1, 2, 3, 4, 5, 6, 7
_PASSES, _WRITES, _LATE, _READ, _TAKEN = 8, 9, 10, 11, 12
_WAYS_MATCHED, _WAYS_WRITTEN, _CANDIDATES, _READ_TO_HIT, _WAYS_TO_HIT = 13, 14, 15, 16, 17
_FARTHEST = 1 << 16


def op_room(state: State) -> int:
    """Return the most operations that one event can need."""
    return int(state.ring_room.sum()) * len(state.passed) + 1


@jit
def _along(rows: Int64s, at: int, own: int, x: int, y: int) -> Any:
    """Return one coordinate of a prediction; ``at`` is where its three coefficients begin."""
    return ((own << 16) + rows[at] * x + rows[at + 1] * y + rows[at + 2] + 32768) >> 16


@jit
def _row_of(row_t: Int64s, hint: int, t: int) -> Any:
    """Return the last row of the schedule at or before ``t``, starting from one that was right of late."""
    k = hint
    while k > 0 and row_t[k] > t:
        k -= 1
    while k + 1 < len(row_t) and row_t[k + 1] <= t:
        k += 1
    return k


@jit
def _age_left(rule: Rule, state: State, cell: int, now: int) -> Any:
    """Return how many ticks a cell stays open, from 0 on; −1 when it is closed or, by its stamp, seems so."""
    if state.cell_horizons[cell] == 0:
        return -1
    p = state.cell_p[cell]
    left = state.cell_due[cell] - now + rule.late[p]
    if rule.stamp_period:
        left &= rule.stamp_period - 1
        if left > rule.early + rule.late[p]:
            return -1
    return max(left, -1)


@jit
def _first_of_set(rule: Rule, column: int, row: int) -> Any:
    """Return the first way of a bin's set; without sets, the bin's own cell."""
    if rule.ways == 0:
        return row * rule.bins_x + column
    low = ((row & ((1 << rule.set_rows) - 1)) << rule.set_columns) | (column & ((1 << rule.set_columns) - 1))
    return low * rule.ways


@jit
def _find(rule: Rule, state: State, column: int, row: int, now: int, writing: int) -> Any:
    """Return the open cell of a bin; when writing, else the first that is not open, else the one due first; else −1."""
    first = _first_of_set(rule, column, row)
    if rule.ways == 0:
        return first
    name = row * rule.bins_x + column
    free, oldest, least = -1, first, 1 << 62
    ways = _WAYS_WRITTEN if writing else _WAYS_MATCHED
    for cell in range(first, first + rule.ways):
        state.counts[ways] += 1
        left = _age_left(rule, state, cell, now)
        if left < 0:
            if free < 0:
                free = cell
        elif state.cell_bin[cell] == name:
            return cell
        due = state.cell_due[cell]
        if rule.stamp_period:
            due = (due - now + rule.late[state.cell_p[cell]]) & (rule.stamp_period - 1)
        if due < least:
            oldest, least = cell, due
    if not writing:
        return -1
    return free if free >= 0 else oldest


@jit
def _write(rule: Rule, state: State, h: int, column: int, row: int, slot: int, due: int, now: int) -> Any:
    """Expect in a bin what a ring entry predicts over horizon ``h``; return the cell."""
    cell = _find(rule, state, column, row, now, 1)
    name, p = row * rule.bins_x + column, state.ring_p[slot]
    is_open = _age_left(rule, state, cell, now) >= 0
    support = state.ring_support[slot]
    if is_open and state.cell_bin[cell] == name and state.cell_p[cell] == p:
        if (state.cell_horizons[cell] >> h) & 1 == 0:
            state.cell_horizons[cell] |= 1 << h
        elif rule.uses:
            if state.cell_uses[cell] == rule.uses:
                state.counts[_OVERWRITTEN] += 1
            else:
                state.cell_uses[cell] += 1
        state.cell_support[cell] = max(state.cell_support[cell], support)
    else:
        if is_open:
            state.counts[_OVERWRITTEN] += 1
        state.cell_bin[cell], state.cell_p[cell] = name, p
        state.cell_horizons[cell], state.cell_uses[cell], state.cell_support[cell] = 1 << h, 1, support
    state.cell_due[cell] = due
    return cell


@jit
def _moves(rows: Int64s, at: int, x: int, y: int) -> Any:
    """Return one coordinate of a displacement with 16 fractional bits."""
    return rows[at] * x + rows[at + 1] * y + rows[at + 2]


@jit
def _drain(rule: Rule, state: State, now: int, ops: NDArray[np.int64]) -> Any:
    """Pass every entry whose gate has opened, horizon after horizon; return how many operations that took."""
    count, width = 0, len(rule.row_t)
    for h in range(len(rule.horizon)):
        ring = h if rule.chooses else 0
        while state.passed[h] < state.stored[ring]:
            slot = state.ring_base[ring] + state.passed[h] % state.ring_room[ring]
            due = (state.ring_t[slot] >> rule.tick_bits) + rule.horizon[h]
            if due - rule.early > now:
                break
            state.passed[h] += 1
            state.counts[_PASSES] += 1
            asked = state.ring_t[slot]
            if rule.at_gate:
                asked += (rule.horizon[h] - rule.early) << rule.tick_bits
            k = _row_of(rule.row_t, state.row_hint[h], asked)
            state.row_hint[h] = k
            x, y, at = state.ring_x[slot], state.ring_y[slot], (h * width + k) * 6
            to_x, to_y = _along(rule.rows, at, x, x, y), _along(rule.rows, at + 3, y, x, y)
            inside = 0 <= to_x < rule.width and 0 <= to_y < rule.height
            late = due + rule.late[state.ring_p[slot]] < now
            if late:
                state.counts[_LATE] += 1
            column, row = to_x >> rule.bin_bits, to_y >> rule.bin_bits
            made = inside and (to_x - x) * (to_x - x) + (to_y - y) * (to_y - y) >= rule.least_squared
            ops[count, KIND] = WRITE if made and not late else PASS
            ops[count, LEFT], ops[count, RIGHT], ops[count, TOP], ops[count, LOW] = column, column, row, row
            ops[count, READY], ops[count, WRITES] = state.ring_ready[slot], 1 if made and not late else 0
            ops[count, OWNER] = state.ring_owner[slot]
            count += 1
            if made and not late:
                state.counts[_WRITES] += 1
                cell = _write(rule, state, h, column, row, slot, due, now)
                if rule.lines:
                    fine = 16 - rule.fraction_bits
                    state.cell_x[cell] = ((x << 16) + _moves(rule.rows, at, x, y) + 32768) >> fine
                    state.cell_y[cell] = ((y << 16) + _moves(rule.rows, at + 3, x, y) + 32768) >> fine
    return count


@jit
def _shift_squared(rule: Rule, at: int, x: int, y: int) -> Any:
    """Return how far a prediction lies from its event, squared; a component counts for 2^16 px at most."""
    dx = min(abs(_along(rule.rows, at, x, x, y) - x), _FARTHEST)
    dy = min(abs(_along(rule.rows, at + 3, y, x, y) - y), _FARTHEST)
    return dx * dx + dy * dy


@jit
def _off_line(rule: Rule, place: int, fine: int, moves: int, since: int) -> Any:
    """Tell whether one coordinate lies off the line along which a prediction has moved for ``since`` ticks."""
    bits = rule.fraction_bits
    most = _FARTHEST << (bits + 1)
    velocity = min(max(moves >> (15 - bits), -most), most)
    residual = (place << (bits + 1)) - (2 * fine + 1 - (1 << bits))
    return abs(residual * rule.horizon[0] - velocity * since) > rule.line_limit


@jit
def _match(rule: Rule, state: State, now: int, x: int, y: int, p: int, row: int) -> Any:
    """Return the nearest candidate cell, −1 without one, and the support of all candidates together."""
    shift = _shift_squared(rule, row * 6, x, y) if rule.spreads else 0
    nearest, votes, carried, looked = -1, 0, 0, 0
    ways, to_hit, ways_to_hit = state.counts[_WAYS_MATCHED], 0, 0
    for o in range(len(rule.dx)):
        bx, by = x + rule.dx[o], y + rule.dy[o]
        if shift < rule.offset_shift[o] or bx < 0 or by < 0 or bx >= rule.width or by >= rule.height:
            continue
        column, line = bx >> rule.bin_bits, by >> rule.bin_bits
        name, fresh = line * rule.bins_x + column, True
        if rule.bin_bits:
            for s in range(looked):
                if state.seen[s] == name:
                    fresh = False
                    break
        if not fresh:
            continue
        state.seen[looked] = name
        looked += 1
        cell = _find(rule, state, column, line, now, 0)
        left = _age_left(rule, state, cell, now) if cell >= 0 else -1
        if left < 0:
            continue
        sign = state.cell_p[cell]
        if not rule.blur and sign != p ^ rule.flip:
            continue
        if rule.dx[o] * rule.dx[o] + rule.dy[o] * rule.dy[o] > rule.reach[sign]:
            continue
        if rule.lines:
            since = rule.late[sign] - left
            if _off_line(rule, x, state.cell_x[cell], _moves(rule.rows, row * 6, x, y), since) or _off_line(
                rule, y, state.cell_y[cell], _moves(rule.rows, row * 6 + 3, x, y), since
            ):
                continue
        state.counts[_CANDIDATES] += 1
        if nearest < 0:
            nearest, to_hit, ways_to_hit = cell, looked, state.counts[_WAYS_MATCHED] - ways
        votes |= state.cell_horizons[cell]
        carried = max(carried, state.cell_support[cell])
    state.counts[_READ] += looked
    state.counts[_READ_TO_HIT] += looked if nearest < 0 else to_hit
    state.counts[_WAYS_TO_HIT] += state.counts[_WAYS_MATCHED] - ways if nearest < 0 else ways_to_hit
    support = carried
    while votes:
        support += votes & 1
        votes >>= 1
    return nearest, support


@jit
def rings_held(rule: Rule, state: State) -> Any:
    """Return how many entries all rings hold together."""
    held = 0
    for ring in range(len(state.ring_room)):
        held += state.stored[ring] - state.passed[ring if rule.chooses else len(rule.horizon) - 1]
    return held


@jit
def _remember(rule: Rule, state: State, t: int, x: int, y: int, p: int, support: int, row: int) -> Any:
    """Store the event unless its motion predicts nothing or the ring is full; return the slot, −1 where not stored."""
    ring, many, width = 0, len(rule.horizon), len(rule.row_t)
    if rule.chooses:
        ring = many - 1
        for h in range(many - 1):
            if _shift_squared(rule, (h * width + row) * 6, x, y) >= rule.choose_squared:
                ring = h
                break
    if not rule.at_gate:
        made, beyond = False, False
        for h in range(many):
            if rule.chooses and h != ring:
                continue
            at = (h * width + row) * 6
            to_x, to_y = _along(rule.rows, at, x, x, y), _along(rule.rows, at + 3, y, x, y)
            if not (0 <= to_x < rule.width and 0 <= to_y < rule.height):
                beyond = True
            elif (to_x - x) * (to_x - x) + (to_y - y) * (to_y - y) >= rule.least_squared:
                made = True
        if not made:
            state.counts[_OUTSIDE if beyond else _STILL] += 1
            return -1
    held = state.stored[ring] - state.passed[ring if rule.chooses else many - 1]
    if held == state.ring_room[ring]:
        state.counts[_OVERFLOW] += 1
        return -1
    slot = state.ring_base[ring] + state.stored[ring] % state.ring_room[ring]
    state.ring_t[slot], state.ring_x[slot], state.ring_y[slot], state.ring_p[slot] = t, x, y, p
    state.ring_support[slot], state.ring_owner[slot] = min(rule.carry, support), state.counts[0] - 1
    state.stored[ring] += 1
    state.counts[_PREDICTED] += 1
    state.counts[_HIGH] = max(state.counts[_HIGH], rings_held(rule, state))
    return slot


@jit
def decide(rule: Rule, state: State, t: int, x: int, y: int, p: int, ops: NDArray[np.int64]) -> Any:
    """Decide an event; return whether it is suppressed, how many operations ``ops`` lists, and its slot in the ring.

    The last operation is the match. The slot is −1 where the event was not stored; whoever models time writes there,
    into ``ring_ready``, the first cycle in which the entry can be read.
    """
    now = t >> rule.tick_bits
    count = _drain(rule, state, now, ops)
    row = _row_of(rule.row_t, state.row_hint[-1], t)
    state.row_hint[-1] = row
    nearest, support = _match(rule, state, now, x, y, p, row)
    suppressed = 1 if nearest >= 0 and support >= rule.need else 0
    state.counts[0] += 1
    if suppressed:
        state.counts[_COUNT_SUPPRESSED] += 1
        if rule.uses:
            state.counts[_TAKEN] += 1
            state.cell_uses[nearest] -= 1
            if state.cell_uses[nearest] == 0:
                state.cell_horizons[nearest] = 0
    reach_x, reach_y = 0, 0
    for o in range(len(rule.dx)):
        reach_x, reach_y = max(reach_x, rule.dx[o]), max(reach_y, rule.dy[o])
    ops[count, KIND] = MATCH
    ops[count, LEFT] = max(x - reach_x, 0) >> rule.bin_bits
    ops[count, RIGHT] = min(x + reach_x, rule.width - 1) >> rule.bin_bits
    ops[count, TOP] = max(y - reach_y, 0) >> rule.bin_bits
    ops[count, LOW] = min(y + reach_y, rule.height - 1) >> rule.bin_bits
    ops[count, READY], ops[count, WRITES], ops[count, OWNER] = 0, 1 if rule.uses else 0, state.counts[0] - 1
    slot = _remember(rule, state, t, x, y, p, support, row)
    return suppressed, count + 1, slot
