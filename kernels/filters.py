"""Filter a launch of events in order, one 32-bit cell a pixel that the host owns.

``now`` is a relative time that the host keeps between its span and twice that, so a cell of time 0 is long ago without
a bit to say so. Each kernel reads ``kept`` and clears what it removes; what is 0 already leaves no trace. The decisions
are arithmetic instead of branches: noise is what filters are for, and no processor predicts it.
"""

from functools import cache

from tiegocancel.kernels.runtime import start, ti

__all__ = ["MAX_UNROLLED_RADIUS_PX", "background", "flicker", "hot_pixel", "refractory"]

MAX_UNROLLED_RADIUS_PX = 2
"""A window of a larger radius is searched by a loop instead of unrolled code."""


def hot_pixel(**arguments):
    """Mute pixels whose leaky counter is above its limit; a cell is the time at which the counter will be empty."""
    start()
    _hot_pixel()(**arguments)


def flicker(**arguments):
    """Mute pixels whose onsets follow each other at a period of the band; see :func:`_flicker` for the cell."""
    start()
    _flicker()(**arguments)


def refractory(*, by_polarity, **arguments):
    """Let pixels rest after an event that is kept; a cell is the time of that event."""
    start()
    _refractory(by_polarity)(**arguments)


def background(*, radius_px, **arguments):
    """Keep events that neighbours support; a cell is the time of the pixel's last event, kept or not."""
    start()
    _background(radius_px)(**arguments)


@cache
def _hot_pixel():
    @ti.kernel
    def run(
        count: ti.i32,  # events of this launch, from `first`
        first: ti.i32,
        base_us: ti.i64,  # 2^30 ≤ t − base < 2^31
        leak_us: ti.u32,  # what one event adds
        limit_us: ti.u32,  # muted above; the counter stops at twice this, < 2^29
        width: ti.i32,
        t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] µs
        x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        cells: ti.types.ndarray(dtype=ti.u32, ndim=1),  # [pixels]
        kept: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n] in and out
    ):
        ti.loop_config(serialize=True)
        for _ in range(1):  # one serial task: what follows lives in registers, not in global temporaries
            for i in range(first, first + count):
                now = ti.cast(t[i] - base_us, ti.u32)
                cell = ti.cast(y[i], ti.i32) * width + ti.cast(x[i], ti.i32)
                seen = kept[i]
                old = cells[cell]
                empty = ti.min(ti.max(old, now) + leak_us, now + 2 * limit_us)
                cells[cell] = ti.select(seen != 0, empty, old)
                kept[i] = seen & ti.select(empty - now <= limit_us, ti.u8(1), ti.u8(0))

    return run


@cache
def _flicker():
    """Compile; a cell is ``onset << 6 | muted << 5 | polarity << 4 | count``."""

    @ti.kernel
    def run(
        count: ti.i32,  # events of this launch, from `first`
        first: ti.i32,
        base_us: ti.i64,  # 2^25 ≤ t − base < 2^26
        periods: ti.u32,  # ≤ 15
        shortest_us: ti.u32,
        longest_us: ti.u32,
        silence_us: ti.u32,  # < 2^25
        width: ti.i32,
        t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] µs
        x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        p: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n]
        cells: ti.types.ndarray(dtype=ti.u32, ndim=1),  # [pixels]
        kept: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n] in and out
    ):
        ti.loop_config(serialize=True)
        for _ in range(1):  # one serial task, as above
            for i in range(first, first + count):
                now = ti.cast(t[i] - base_us, ti.u32)
                cell = ti.cast(y[i], ti.i32) * width + ti.cast(x[i], ti.i32)
                on = ti.cast(p[i], ti.u32)
                seen = kept[i]
                old = cells[cell]
                onset = old >> 6
                gap = now - onset
                silent = gap > silence_us
                level = ti.select(silent, ti.u32(0), old & 15)
                muted = ti.select(silent, ti.u32(0), (old >> 5) & 1)
                begins = (on & ~(old >> 4) & 1) != 0
                regular = gap - shortest_us <= longest_us - shortest_us  # wraps far above when the gap is too short
                up = ti.min(level + 1, periods)
                down = level - ti.min(level, ti.u32(1))
                level = ti.select(begins, ti.select(regular, up, down), level)
                flips = ti.select(level == periods, ti.u32(1), ti.select(level == 0, ti.u32(0), muted))
                muted = ti.select(begins, flips, muted)
                onset = ti.select(begins, now, onset)
                new = (onset << 6) | (muted << 5) | (on << 4) | level
                cells[cell] = ti.select(seen != 0, new, old)
                kept[i] = seen & ti.cast(muted ^ 1, ti.u8)

    return run


@cache
def _refractory(by_polarity):
    @ti.kernel
    def run(
        count: ti.i32,  # events of this launch, from `first`
        first: ti.i32,
        base_us: ti.i64,  # 2^30 ≤ t − base < 2^31
        period_us: ti.u32,  # < 2^30
        width: ti.i32,
        t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] µs
        x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        p: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n]
        cells: ti.types.ndarray(dtype=ti.u32, ndim=1),  # [pixels], or [2·pixels] by polarity
        kept: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n] in and out
    ):
        ti.loop_config(serialize=True)
        for _ in range(1):  # one serial task, as above
            for i in range(first, first + count):
                now = ti.cast(t[i] - base_us, ti.u32)
                cell = ti.cast(y[i], ti.i32) * width + ti.cast(x[i], ti.i32)
                if ti.static(by_polarity):
                    cell = 2 * cell + ti.cast(p[i], ti.i32)
                old = cells[cell]
                passes = kept[i] & ti.select(now - old >= period_us, ti.u8(1), ti.u8(0))
                cells[cell] = ti.select(passes != 0, now, old)
                kept[i] = passes

    return run


@cache
def _background(radius):
    reach = range(-radius, radius + 1)
    window = tuple((dx, dy) for dy in reach for dx in reach if dx or dy) if radius <= MAX_UNROLLED_RADIUS_PX else ()

    @ti.kernel
    def run(
        count: ti.i32,  # events of this launch, from `first`
        first: ti.i32,
        base_us: ti.i64,  # 2^30 ≤ t − base < 2^31
        delay_us: ti.u32,  # < 2^30
        support: ti.i32,
        stride: ti.i32,  # cells from one row of the table to the next: the width and a border of the radius
        t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] µs
        x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        cells: ti.types.ndarray(dtype=ti.u32, ndim=1),  # [(height + 2·radius)·stride + radius]
        kept: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n] in and out
    ):
        ti.loop_config(serialize=True)
        for _ in range(1):  # one serial task, as above
            for i in range(first, first + count):
                now = ti.cast(t[i] - base_us, ti.u32)
                cell = (ti.cast(y[i], ti.i32) + radius) * stride + ti.cast(x[i], ti.i32) + radius
                seen = kept[i]
                old = cells[cell]
                found = 0
                if ti.static(len(window) > 0):
                    for dx, dy in ti.static(window):
                        found += ti.cast(now - cells[cell + dy * stride + dx] <= delay_us, ti.i32)
                else:
                    found = -ti.cast(now - old <= delay_us, ti.i32)  # the loop counts the event's own pixel too
                    for dy in range(-radius, radius + 1):
                        for dx in range(-radius, radius + 1):
                            found += ti.cast(now - cells[cell + dy * stride + dx] <= delay_us, ti.i32)
                cells[cell] = ti.select(seen != 0, now, old)
                kept[i] = seen & ti.select(found >= support, ti.u8(1), ti.u8(0))

    return run
