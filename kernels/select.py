"""Run the selective canceller over a launch of events, in order: several horizons, carried support, bins and sets.

The rule is that of ``tiegocancel/matching/semantics.md``; ``kernels.match`` is the same rule at its defaults, several
times as fast. Times are whole ticks in 64 bits, so that nothing wraps here; a device's narrow stamps must not show.
"""

from functools import cache

from tiegocancel.kernels.runtime import start, ti

__all__ = ["COUNTS", "select"]

COUNTS = ("events", "suppressed", "predicted", "outside", "overflow", "overwritten", "ring_high_water", "still")
"""What ``counts`` holds, in this order."""


_FARTHEST = 1 << 16  # px; a component of a shift counts for no more where shifts are compared


def select(*, horizons, ways, at_gate, chooses, spreads, splits, lines, state):
    """Run one launch; ``state`` holds the kernel's arguments by name, as :func:`_kernel` lists them.

    ``horizons``: how many; ``ways``: cells of a set, 0 for a cell for every bin; ``at_gate``: predict with the motion
    of the time when the gate opens; ``chooses``: each event is predicted over one horizon, from that one's own ring;
    ``spreads``: the gate in space grows with the shift; ``splits``: OFF predictions have gates of their own;
    ``lines``: events must lie near the line along which their prediction moves.
    """
    start()
    _kernel(horizons, ways, at_gate, chooses, spreads, splits, lines)(**state)


@cache
def _kernel(horizons, ways, at_gate, chooses, spreads, splits, lines):
    @ti.func
    def moved_by(axis: ti.template(), rows: ti.template(), h: ti.i32, row: ti.i32, x: ti.i64, y: ti.i64) -> ti.i64:
        return rows[h, row, 3 * axis] * x + rows[h, row, 3 * axis + 1] * y + rows[h, row, 3 * axis + 2]

    @ti.func
    def place(axis: ti.template(), rows: ti.template(), h: ti.i32, row: ti.i32, x: ti.i64, y: ti.i64) -> ti.i64:
        along = x
        if ti.static(axis == 1):
            along = y
        return ((along << 16) + moved_by(axis, rows, h, row, x, y) + 32768) >> 16

    @ti.func
    def velocity(axis: ti.template(), rows: ti.template(), row: ti.i32, x: ti.i64, y: ti.i64, bits: ti.i32) -> ti.i64:
        farthest = ti.cast(_FARTHEST, ti.i64) << (bits + 1)
        return ti.min(ti.max(moved_by(axis, rows, 0, row, x, y) >> (15 - bits), -farthest), farthest)

    @ti.func
    def shift_squared(rows: ti.template(), h: ti.i32, row: ti.i32, x: ti.i64, y: ti.i64) -> ti.i64:
        dx = ti.min(abs(place(0, rows, h, row, x, y) - x), _FARTHEST)
        dy = ti.min(abs(place(1, rows, h, row, x, y) - y), _FARTHEST)
        return dx * dx + dy * dy

    @ti.func
    def gate_of(off: ti.i64, on: ti.i64, sign: ti.i32) -> ti.i64:
        gate = on
        if ti.static(splits):
            gate = ti.select(sign & 1 == 0, off, on)
        return gate

    @ti.func
    def cell_for(
        cell_bin: ti.template(),
        cell_time: ti.template(),
        cell_horizons: ti.template(),
        cell_sign: ti.template(),
        bin: ti.i32,
        bins_x: ti.i32,
        set_columns: ti.i32,
        set_rows: ti.i32,
        now: ti.i64,
        off_late: ti.i64,
        on_late: ti.i64,
        write: ti.template(),
    ) -> ti.i32:
        found = bin
        if ti.static(ways > 0):
            column = bin % bins_x
            row = bin // bins_x
            base = ((row & ((1 << set_rows) - 1)) << set_columns | (column & ((1 << set_columns) - 1))) * ways
            found = -1
            free = -1
            oldest = base
            for w in range(ways):
                at = base + w
                late = on_late
                if ti.static(splits):
                    late = gate_of(off_late, on_late, ti.cast(cell_sign[at], ti.i32))
                is_open = cell_horizons[at] != 0 and now <= cell_time[at] + late
                if is_open and cell_bin[at] == bin and found < 0:
                    found = at
                if not is_open and free < 0:
                    free = at
                if cell_time[at] < cell_time[oldest]:
                    oldest = at
            if ti.static(write):
                if found < 0:
                    found = free
                if found < 0:
                    found = oldest
        return found

    @ti.kernel
    def run(
        first: ti.i32,
        last: ti.i32,
        width: ti.i64,
        height: ti.i64,
        tick_bits: ti.i32,
        horizon: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [horizons] ticks, rising
        early: ti.i64,  # ticks
        off_late: ti.i64,  # ticks, of OFF predictions
        on_late: ti.i64,  # ticks
        reaches: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [2] px², of the gate in space
        flip: ti.i32,  # 0 opposite, 1 equal
        blur: ti.i32,  # 1 ignores polarity
        bin_bits: ti.i32,
        bins_x: ti.i32,
        set_columns: ti.i32,
        set_rows: ti.i32,
        uses: ti.i32,
        carry: ti.i32,
        need: ti.i32,
        least_squared: ti.i64,
        choose_squared: ti.i64,
        offsets: ti.types.ndarray(dtype=ti.i32, ndim=2),  # [window, 2] dx dy, nearest first
        fraction_bits: ti.i32,
        line_limit: ti.i64,  # 2^-(fraction_bits + 1) px · ticks
        offset_shifts: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [window] px², least shift at which each is looked at
        row_t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [rows] µs
        rows: ti.types.ndarray(dtype=ti.i64, ndim=3),  # [horizons, rows, 6]
        ring_base: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [rings] first slot; one ring, or one for each horizon
        ring_room: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [rings] slots
        t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] µs
        x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n]
        y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n]
        p: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n]
        ring_t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [slots] µs
        ring_x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [slots]
        ring_y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [slots]
        ring_p: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [slots] polarity | support << 1
        ring_source: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [slots]
        stored: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [rings] entries stored
        passed: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [horizons] entries passed by each
        most_held: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [rings]
        cell_bin: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [cells]
        cell_time: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [cells] ticks
        cell_horizons: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [cells] a bit for each, 0 is empty
        cell_sign: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [cells] polarity | support << 1
        cell_uses: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [cells]
        cell_source: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [cells]
        cell_x: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [cells] 2^-fraction_bits px; [1] unless lines
        cell_y: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [cells]
        cell_last: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [cells] the horizon that wrote last
        counts: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [8], see COUNTS
        suppressed: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n] out
        source: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] out
        used_horizon: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n] out
        supports: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n] out
    ):
        ti.loop_config(serialize=True)
        for _ in range(1):  # one serial task
            row_of = ti.Vector.zero(ti.i32, 5)  # the row that each pointer's entry uses, then that of the event
            many = row_t.shape[0]
            room = ring_room[0]
            base = ti.i64(0)
            for i in range(first, last):
                at = t[i]
                now = at >> tick_bits
                column = ti.cast(x[i], ti.i64)
                line = ti.cast(y[i], ti.i64)
                sign = ti.cast(p[i], ti.i32)

                # 1. drain
                for h in ti.static(range(horizons)):
                    going = True
                    while going:
                        going = False
                        ring = ti.static(h if chooses else 0)
                        if passed[h] < stored[ring]:
                            if ti.static(chooses):
                                room = ring_room[ring]
                                base = ring_base[ring]
                            slot = ti.cast(base + passed[h] % room, ti.i32)
                            due = (ring_t[slot] >> tick_bits) + horizon[h]
                            if due - early <= now:
                                going = True
                                passed[h] += 1
                                asked = ring_t[slot]
                                if ti.static(at_gate):
                                    asked += (horizon[h] - early) << tick_bits
                                k = row_of[h]
                                while k + 1 < many and row_t[k + 1] <= asked:
                                    k += 1
                                row_of[h] = k
                                from_x = ti.cast(ring_x[slot], ti.i64)
                                from_y = ti.cast(ring_y[slot], ti.i64)
                                to_x = place(0, rows, h, k, from_x, from_y)
                                to_y = place(1, rows, h, k, from_x, from_y)
                                inside = to_x >= 0 and to_x < width and to_y >= 0 and to_y < height
                                moved = ti.i64(0)
                                if inside:
                                    moved = (to_x - from_x) * (to_x - from_x) + (to_y - from_y) * (to_y - from_y)
                                its_sign = ti.cast(ring_p[slot] & 1, ti.i32)
                                timely = due + gate_of(off_late, on_late, its_sign) >= now
                                if inside and moved >= least_squared and timely:
                                    bin = ti.cast((to_y >> bin_bits) * bins_x + (to_x >> bin_bits), ti.i32)
                                    cell = cell_for(
                                        cell_bin, cell_time, cell_horizons, cell_sign, bin, bins_x,
                                        set_columns, set_rows, now, off_late, on_late, True,
                                    )  # fmt: skip
                                    support = ti.cast(ring_p[slot] >> 1, ti.i32)
                                    old_sign = ti.cast(cell_sign[cell] & 1, ti.i32)
                                    late = gate_of(off_late, on_late, old_sign)
                                    is_open = cell_horizons[cell] != 0 and now <= cell_time[cell] + late
                                    if is_open and cell_bin[cell] == bin and old_sign == its_sign:
                                        held = ti.cast(cell_horizons[cell], ti.i32)
                                        if (held >> h) & 1 == 0:
                                            cell_horizons[cell] = ti.cast(held | (1 << h), ti.u8)
                                        elif uses > 0:
                                            if ti.cast(cell_uses[cell], ti.i32) == uses:
                                                counts[5] += 1
                                            else:
                                                cell_uses[cell] += ti.u8(1)
                                        support = ti.max(support, ti.cast(cell_sign[cell] >> 1, ti.i32))
                                    else:
                                        if is_open:
                                            counts[5] += 1
                                        cell_bin[cell] = bin
                                        cell_horizons[cell] = ti.cast(1 << h, ti.u8)
                                        cell_uses[cell] = ti.u8(1)
                                    cell_sign[cell] = ti.cast(its_sign | (support << 1), ti.u8)
                                    cell_time[cell] = due
                                    cell_source[cell] = ring_source[slot]
                                    cell_last[cell] = ti.u8(h)
                                    if ti.static(lines):
                                        fine_x = (from_x << 16) + moved_by(0, rows, h, k, from_x, from_y) + 32768
                                        fine_y = (from_y << 16) + moved_by(1, rows, h, k, from_x, from_y) + 32768
                                        cell_x[cell] = ti.cast(fine_x >> (16 - fraction_bits), ti.i32)
                                        cell_y[cell] = ti.cast(fine_y >> (16 - fraction_bits), ti.i32)

                # The row of the event's own time
                if ti.static(spreads or lines or not at_gate):
                    k = row_of[4]
                    while k + 1 < many and row_t[k + 1] <= at:
                        k += 1
                    row_of[4] = k

                # 2. match
                shift = ti.i64(0)
                if ti.static(spreads):
                    shift = shift_squared(rows, 0, row_of[4], column, line)
                velocity_x = ti.i64(0)
                velocity_y = ti.i64(0)
                if ti.static(lines):
                    velocity_x = velocity(0, rows, row_of[4], column, line, fraction_bits)
                    velocity_y = velocity(1, rows, row_of[4], column, line, fraction_bits)
                nearest = -1
                votes = 0
                carried = 0
                searching = True
                for o in range(offsets.shape[0]):
                    beside_x = ti.cast(column, ti.i32) + offsets[o, 0]
                    beside_y = ti.cast(line, ti.i32) + offsets[o, 1]
                    near = True
                    if ti.static(spreads):
                        near = shift >= offset_shifts[o]
                    there = beside_x >= 0 and beside_y >= 0 and beside_x < width and beside_y < height
                    if searching and near and there:
                        bin = (beside_y >> bin_bits) * bins_x + (beside_x >> bin_bits)
                        fresh = True
                        if bin_bits > 0:
                            # Each bin once: the first offset that falls into it.
                            for q in range(o):
                                other_x = ti.cast(column, ti.i32) + offsets[q, 0]
                                other_y = ti.cast(line, ti.i32) + offsets[q, 1]
                                within = other_x >= 0 and other_y >= 0 and other_x < width and other_y < height
                                if within and (other_y >> bin_bits) * bins_x + (other_x >> bin_bits) == bin:
                                    fresh = False
                        if fresh:
                            cell = cell_for(
                                cell_bin, cell_time, cell_horizons, cell_sign, bin, bins_x,
                                set_columns, set_rows, now, off_late, on_late, False,
                            )  # fmt: skip
                            if cell >= 0:
                                held = ti.cast(cell_horizons[cell], ti.i32)
                                old_sign = ti.cast(cell_sign[cell] & 1, ti.i32)
                                passes = blur == 1 or old_sign == (sign ^ flip)
                                since = now - cell_time[cell]
                                timely = since <= gate_of(off_late, on_late, old_sign)
                                timely = timely and since >= -early
                                if ti.static(splits):
                                    far = offsets[o, 0] * offsets[o, 0] + offsets[o, 1] * offsets[o, 1]
                                    passes = passes and far <= reaches[old_sign]
                                if ti.static(lines):
                                    # In halves of the kept fraction, so that its middle is a whole number.
                                    half = ti.cast(1, ti.i64) << fraction_bits
                                    beyond_x = 2 * half * column - (2 * ti.cast(cell_x[cell], ti.i64) + 1 - half)
                                    beyond_y = 2 * half * line - (2 * ti.cast(cell_y[cell], ti.i64) + 1 - half)
                                    passes = passes and abs(beyond_x * horizon[0] - velocity_x * since) <= line_limit
                                    passes = passes and abs(beyond_y * horizon[0] - velocity_y * since) <= line_limit
                                if held != 0 and timely and passes:
                                    if nearest < 0:
                                        nearest = cell
                                    votes |= held
                                    carried = ti.max(carried, ti.cast(cell_sign[cell] >> 1, ti.i32))
                                    searching = ti.static(horizons > 1) or not (need == 1 and carry == 0)
                support = 0
                if nearest >= 0:
                    support = carried + (votes & 1) + ((votes >> 1) & 1) + ((votes >> 2) & 1) + ((votes >> 3) & 1)
                supports[i] = ti.cast(support, ti.u8)
                hit = nearest >= 0 and support >= need
                suppressed[i] = ti.cast(hit, ti.u8)
                source[i] = ti.i64(-1)
                if hit:
                    counts[1] += 1
                    source[i] = cell_source[nearest]
                    used_horizon[i] = cell_last[nearest]
                    if uses > 0:
                        if cell_uses[nearest] > 1:
                            cell_uses[nearest] -= ti.u8(1)
                        else:
                            cell_horizons[nearest] = ti.u8(0)

                # 3. remember
                made = ti.static(1 if at_gate else 0) + 0 * sign
                beyond = False
                ring = 0
                if ti.static(chooses):
                    # From the longest down, so that the shortest that is far enough stays.
                    ring = horizons - 1
                    for back in ti.static(range(2, horizons + 1)):
                        if shift_squared(rows, horizons - back, row_of[4], column, line) >= choose_squared:
                            ring = horizons - back
                    room = ring_room[ring]
                    base = ring_base[ring]
                if ti.static(not at_gate):
                    for h in ti.static(range(horizons)):
                        if ti.static(not chooses) or ring == h:
                            to_x = place(0, rows, h, row_of[4], column, line)
                            to_y = place(1, rows, h, row_of[4], column, line)
                            if to_x >= 0 and to_x < width and to_y >= 0 and to_y < height:
                                if (to_x - column) * (to_x - column) + (to_y - line) * (to_y - line) >= least_squared:
                                    made = 1
                            else:
                                beyond = True
                if made == 0:
                    if beyond:
                        counts[3] += 1
                    else:
                        counts[7] += 1
                elif stored[ring] - passed[ti.static(0 if chooses else horizons - 1) + ring] == room:
                    counts[4] += 1
                else:
                    slot = ti.cast(base + stored[ring] % room, ti.i32)
                    ring_t[slot] = at
                    ring_x[slot] = x[i]
                    ring_y[slot] = y[i]
                    ring_p[slot] = ti.cast(sign | (ti.min(support, carry) << 1), ti.u8)
                    ring_source[slot] = counts[0]
                    stored[ring] += 1
                    counts[2] += 1
                    held = stored[ring] - passed[ti.static(0 if chooses else horizons - 1) + ring]
                    most_held[ring] = ti.max(most_held[ring], held)
                    if ti.static(chooses):
                        for h in ti.static(range(horizons)):
                            if ring != h:
                                held += stored[h] - passed[h]
                    counts[6] = ti.max(counts[6], held)
                counts[0] += 1

    return run
