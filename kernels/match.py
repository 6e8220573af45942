"""Drain, match and store the predictions of a launch of events, in order, over packed state that the host owns.

A cell is 4 bytes, ``t' << 2 | p << 1 | valid`` with ``t'`` in 30 bits relative to the launch's base time; 0 is empty.
The table carries a border as wide as the spatial gate, so that a window never needs a bounds test. Gate in time,
polarity and valid bit are one comparison: with ``want`` the packed cell at the gate's early edge, ``cell − want``
rotated right by two is at most ``2·ε_t`` exactly when all three hold.
"""

from functools import cache

from tiegocancel.kernels.runtime import start, ti

__all__ = ["MAX_UNROLLED", "cancel"]

MAX_UNROLLED = 32
"""A window of more offsets than this is searched by a loop instead of unrolled code."""


def cancel(*, polarity, offsets, track_source, state):
    """Run one launch; ``state`` holds the kernel's arguments by name, as :func:`_kernel` lists them.

    ``polarity``: opposite, equal or ignore; ``offsets``: window as linear cell offsets, in order of preference;
    ``track_source``: fill ``source``. ``cursors`` are the ring's head and number of pending predictions, then the
    counts of events, suppressed, predicted, outside, overflow, overwritten, and the most ever pending.
    """
    start()
    window = tuple(offsets.tolist()) if len(offsets) <= MAX_UNROLLED else ()
    _kernel(polarity, window, track_source)(**state)


@cache
def _kernel(polarity, window, track_source):
    """Compile one variant; ``window`` holds linear offsets to compile in, so it is one for each sensor width and gate.

    An empty ``window`` searches the kernel's argument ``offsets`` in a loop.
    """
    flip = 1 if polarity == "equal" else 0
    blur = 2 if polarity == "ignore" else 0

    @ti.kernel
    def run(
        count: ti.i32,  # events of this launch, from `first`
        first: ti.i32,
        base_us: ti.i64,  # 0 ≤ t − base < 2^29
        horizon_us: ti.u32,
        gate_us: ti.u32,
        stride: ti.i32,  # cells from one row of the table to the next
        origin: ti.i32,  # cell of pixel (0, 0)
        capacity: ti.i32,
        t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] µs
        x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        p: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n]
        ahead: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n or more] cell of the prediction, −1 outside
        offsets: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [window] linear, nearest first
        cells: ti.types.ndarray(dtype=ti.u32, ndim=1),  # [table], 0 where empty
        cell_source: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [table], [1] when not tracked
        ring: ti.types.ndarray(dtype=ti.u64, ndim=1),  # [capacity] cell index << 32 | packed cell
        ring_source: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [capacity], [1] when not tracked
        cursors: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [9], see cancel
        suppressed: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n] out
        source: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] out, [1] when not tracked
    ):
        ti.loop_config(serialize=True)
        for _ in range(1):  # one serial task: what follows lives in registers, not in global temporaries
            head = ti.cast(cursors[0], ti.i32)
            pending = ti.cast(cursors[1], ti.i32)
            index = cursors[2]
            hits = ti.u32(0)
            outside = ti.i64(0)
            overflow = ti.i64(0)
            overwritten = ti.u32(0)
            high_water = ti.cast(cursors[8], ti.i32)
            due = ti.u32(0xFFFFFFFF)  # relative t' of the ring's head; nothing pending: never
            if pending > 0:
                due = ti.cast(ring[head], ti.u32) >> 2
            twice = gate_us << 1

            for i in range(first, first + count):
                at = t[i]
                now = ti.cast(at - base_us, ti.u32)
                column = ti.cast(x[i], ti.i32)
                row = ti.cast(y[i], ti.i32)
                sign = ti.cast(p[i], ti.u32)
                here = origin + row * stride + column

                # 1. drain
                reach = now + gate_us
                while due <= reach:
                    packed = ring[head]
                    cell = ti.cast(packed >> 32, ti.i32)
                    old = cells[cell]
                    overwritten += ti.select((old >> 2) + gate_us >= now, old & 1, ti.u32(0))
                    cells[cell] = ti.cast(packed, ti.u32)
                    if ti.static(track_source):
                        cell_source[cell] = ring_source[head]
                    head += 1
                    if head == capacity:
                        head = 0
                    pending -= 1
                    due = ti.u32(0xFFFFFFFF)
                    if pending > 0:
                        due = ti.cast(ring[head], ti.u32) >> 2

                # 2. match
                want = ((now - gate_us) << 2) | ((sign ^ ti.u32(flip)) << 1) | ti.u32(blur | 1)
                met = 0
                searching = True  # a constant on each path, so that the unrolled search ends in one jump
                if ti.static(len(window) > 0):
                    for offset in ti.static(window):
                        if searching:
                            beside = here + offset
                            gap = (cells[beside] | ti.u32(blur)) - want
                            if ((gap >> 2) | (gap << 30)) <= twice:
                                met = beside
                                searching = False
                else:
                    k = 0
                    while k < offsets.shape[0]:
                        beside = here + offsets[k]
                        gap = (cells[beside] | ti.u32(blur)) - want
                        k += 1
                        if ((gap >> 2) | (gap << 30)) <= twice:
                            met = beside
                            searching = False
                            k = offsets.shape[0]
                if searching:
                    suppressed[i] = ti.u8(0)
                    if ti.static(track_source):
                        source[i] = ti.i64(-1)
                else:
                    cells[met] = ti.u32(0)
                    suppressed[i] = ti.u8(1)
                    hits += 1
                    if ti.static(track_source):
                        source[i] = cell_source[met]

                # 3. store the prediction
                target = ahead[i]
                if target < 0:
                    outside += 1
                elif pending == capacity:
                    overflow += 1
                else:
                    tail = head + pending
                    if tail >= capacity:
                        tail -= capacity
                    later = now + horizon_us
                    ring[tail] = (ti.cast(target, ti.u64) << 32) | ti.cast(
                        (later << 2) | (sign << 1) | ti.u32(1), ti.u64
                    )
                    if ti.static(track_source):
                        ring_source[tail] = index
                    if pending == 0:
                        due = later
                    pending += 1
                    high_water = ti.max(high_water, pending)
                index += 1

            cursors[0] = head
            cursors[1] = pending
            cursors[2] = index
            cursors[3] += hits
            cursors[4] += count - outside - overflow
            cursors[5] += outside
            cursors[6] += overflow
            cursors[7] += overwritten
            cursors[8] = high_water

    return run
