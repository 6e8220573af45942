"""Turn log-intensity over time into events: the threshold model of an event camera's pixel.

A pixel remembers the log-intensity of its last reset and fires when the signal has moved one threshold away from
it. After an event the pixel is held in reset for the refractory period and remembers the level at the release.
Between two samples the signal is a straight line, so that several crossings in one step keep their own times.

Who caused an event: with w the share of the pixel through which the background B is seen past the movers, the signal
L changes in a step by ΔL, of which the background causes w̄·ΔB (w̄ the mean of w over the step) and the movers the
rest: their own pattern and what their outline hides or bares. With one mover M of cover a = 1 − w the rest is exactly
ā·ΔM + (M̄ − B̄)·Δa. Both parts are summed from the pixel's last reset to the event, and the event is the movers' where
theirs has moved the signal farther towards it than the background's; else its label is that of the place.
"""

import numpy as np
from tiegocancel.kernels.runtime import start, ti

__all__ = ["TIME_SHIFT", "fire", "pack", "unpack"]

MOVER = 1  # the label of what a mover causes
LABEL_BITS = 2
X_SHIFT = 3
Y_SHIFT = 19
TIME_SHIFT = 35
"""An event is one int64: ``t << 35 | y << 19 | x << 3 | p << 2 | label``; the order of keys is (t, y, x, p, label)."""

GROUP = 512  # pixels that one thread handles in a row; each group fills a segment of its own


@ti.func
def mix(value: ti.u32) -> ti.u32:
    """Scramble 32 bits, one to one; shifts and factors are those of C. Wellons's lowbias32."""
    value ^= value >> 16
    value *= ti.u32(0x7FEB352D)
    value ^= value >> 15
    value *= ti.u32(0x846CA68B)
    value ^= value >> 16
    return value


@ti.func
def unit_jitter(seed: ti.u32, pixel: ti.u32, step: ti.u32, count: ti.u32) -> ti.f64:
    """Return a number of mean 0, deviation 1 and bound 2·√3: four uniform 16-bit numbers, summed."""
    key = mix(seed ^ mix(pixel ^ mix(step ^ mix(count))))
    more = mix(key + ti.u32(0x9E3779B9))
    total = (key & 0xFFFF) + (key >> 16) + (more & 0xFFFF) + (more >> 16)
    return (ti.cast(total, ti.f64) - 131070.0) * (ti.sqrt(ti.cast(3.0, ti.f64)) / 65536.0)


@ti.kernel
def fire_kernel(
    levels: ti.types.ndarray(ti.f32, ndim=2),  # (n, steps) log-intensity at the end of each step
    veiled: ti.types.ndarray(ti.i32, ndim=1),  # (n,) row in clear and behind, −1 where no mover comes
    clear: ti.types.ndarray(ti.f32, ndim=2),  # (m, steps) share through which the background is seen
    behind: ti.types.ndarray(ti.f32, ndim=2),  # (m, steps) log-intensity of the background
    pixels: ti.types.ndarray(ti.i32, ndim=1),  # (n,) y * width + x
    label_clear: ti.types.ndarray(ti.u8, ndim=1),  # (size,) label of events that no mover causes
    level: ti.types.ndarray(ti.f32, ndim=1),  # (size,) log-intensity at the start
    last_clear: ti.types.ndarray(ti.f32, ndim=1),  # (size,) the same of clear
    last_behind: ti.types.ndarray(ti.f32, ndim=1),  # (size,) the same of behind; unused where clear is 1
    moved: ti.types.ndarray(ti.f32, ndim=1),  # (size,) the movers' part of the change since the last reset
    memory: ti.types.ndarray(ti.f32, ndim=1),  # (size,) log-intensity at the last reset
    release_us: ti.types.ndarray(ti.f64, ndim=1),  # (size,) end of the reset, below 0 when the pixel is live
    threshold_on: ti.types.ndarray(ti.f32, ndim=1),  # (size,)
    threshold_off: ti.types.ndarray(ti.f32, ndim=1),  # (size,)
    next_memory: ti.types.ndarray(ti.f32, ndim=1),  # (n,)
    next_release_us: ti.types.ndarray(ti.f64, ndim=1),  # (n,)
    next_moved: ti.types.ndarray(ti.f32, ndim=1),  # (n,)
    keys: ti.types.ndarray(ti.i64, ndim=2),  # (groups, capacity) packed events
    counts: ti.types.ndarray(ti.i32, ndim=1),  # (groups,) events of the group, also those beyond the capacity
    width: ti.i32,
    first_step: ti.i32,
    step_us: ti.f64,
    refractory_us: ti.f64,
    jitter_us: ti.f64,
    seed: ti.u32,
):
    """Run every pixel through all steps; times in the keys count from the start of the block."""
    for group in range(counts.shape[0]):
        filled = 0
        for i in range(group * GROUP, ti.min((group + 1) * GROUP, pixels.shape[0])):
            pixel = pixels[i]
            place = (ti.cast(pixel // width, ti.i64) << Y_SHIFT) | (ti.cast(pixel % width, ti.i64) << X_SHIFT)
            reset = memory[pixel]
            release = release_us[pixel] - ti.cast(first_step, ti.f64) * step_us
            if release_us[pixel] < 0.0:
                release = -1.0
            elif release < 0.0:
                release = 0.0
            high = reset + threshold_on[pixel]
            low = reset - threshold_off[pixel]
            before = level[pixel]
            row = veiled[i]
            theirs = ti.cast(moved[pixel], ti.f64)
            part = ti.cast(0.0, ti.f64)
            was_clear = last_clear[pixel]
            was_behind = before
            if was_clear < 1.0:
                was_behind = last_behind[pixel]
            for step in range(levels.shape[1]):
                after = levels[i, step]
                if row >= 0:
                    is_clear = clear[row, step]
                    is_behind = behind[row, step]
                    part = ti.cast(after, ti.f64) - ti.cast(before, ti.f64)
                    part -= 0.5 * (ti.cast(was_clear, ti.f64) + is_clear) * (ti.cast(is_behind, ti.f64) - was_behind)
                    was_clear = is_clear
                    was_behind = is_behind
                if release >= 0.0 or after >= high or after <= low:
                    begin = ti.cast(step, ti.f64) * step_us
                    change = ti.cast(after, ti.f64) - ti.cast(before, ti.f64)
                    now = ti.cast(0.0, ti.f64)
                    fired = 0
                    waiting = True
                    while waiting:
                        waiting = False
                        if release >= 0.0 and release < begin + step_us:
                            now = ti.max(release - begin, 0.0)
                            reset = ti.cast(before + change * (now / step_us), ti.f32)
                            high = reset + threshold_on[pixel]
                            low = reset - threshold_off[pixel]
                            release = -1.0
                            theirs = -part * (now / step_us)
                        if release < 0.0 and change != 0.0:
                            target = ti.cast(high, ti.f64)
                            if change < 0.0:
                                target = ti.cast(low, ti.f64)
                            when = ti.max((target - before) / change * step_us, now)
                            if when < step_us:
                                noise = unit_jitter(
                                    seed,
                                    ti.cast(pixel, ti.u32),
                                    ti.cast(first_step + step, ti.u32),
                                    ti.cast(fired, ti.u32),
                                )
                                stamp = ti.cast(ti.floor(begin + when + jitter_us * noise), ti.i64)
                                label = ti.cast(label_clear[pixel], ti.i64)
                                share = 2.0 * (theirs + part * (when / step_us))
                                whole = before + change * (when / step_us) - reset
                                if (change > 0.0 and share > whole) or (change < 0.0 and share < whole):
                                    label = ti.i64(MOVER)
                                polarity = ti.i64(0)
                                if change > 0.0:
                                    polarity = ti.i64(1)
                                if filled < keys.shape[1]:
                                    keys[group, filled] = (
                                        (stamp << TIME_SHIFT) | place | (polarity << LABEL_BITS) | label
                                    )
                                filled += 1
                                fired += 1
                                release = begin + when + refractory_us
                                waiting = True
                before = after
                theirs += part
            next_memory[i] = reset
            next_moved[i] = ti.cast(theirs, ti.f32)
            next_release_us[i] = release
            if release >= 0.0:
                next_release_us[i] = release + ti.cast(first_step, ti.f64) * step_us
        counts[group] = filled


def fire(
    levels,
    pixels,
    state,
    *,
    veiled,
    clear,
    behind,
    label_clear,
    threshold_on,
    threshold_off,
    width,
    first_step,
    step_us,
    refractory_us,
    jitter_us,
    seed,
):
    """Return the packed events int64[m] of one block, in no particular order, and advance ``state`` in place.

    ``levels`` float32[n, steps] belongs to the ends of the steps; ``pixels`` int32[n] names each pixel at most once.
    ``veiled`` int32[n] is the row of ``clear`` and ``behind`` float32[m, steps] that belongs to a pixel, −1 where no
    mover comes. ``state`` is a dict of arrays over the whole sensor: ``level``, ``clear`` (1 = no mover), ``behind``,
    ``memory`` and ``moved`` float32, ``release_us`` float64 (−1 = live); pixels that are not listed keep theirs.
    Jitter is a hash of seed, pixel, step and count: blocks and threads change nothing. Times count from the start of
    the block and, jitter included, lie between ``−2·√3·jitter_us`` and the block's length plus the same. Raise
    ``ValueError`` when a pixel index lies outside the sensor or the shapes differ.
    """
    start()
    size = len(state["level"])
    if len(pixels) == 0:
        return np.zeros(0, np.int64)
    if len(levels) != len(pixels) or len(veiled) != len(pixels):
        raise ValueError(f"levels {levels.shape}, veiled {veiled.shape} and {len(pixels)} pixels must agree")
    if clear.shape != behind.shape or clear.shape[1] != levels.shape[1]:
        raise ValueError(f"clear {clear.shape}, behind {behind.shape} and levels {levels.shape} must agree")
    if int(veiled.max()) >= len(clear):
        raise ValueError(f"veiled must be below {len(clear)}, not {int(veiled.max())}")
    if int(pixels.min()) < 0 or int(pixels.max()) >= size:
        raise ValueError(f"pixels must be from 0 to {size - 1}, not {int(pixels.min())} to {int(pixels.max())}")
    groups = -(-len(pixels) // GROUP)
    next_memory = np.empty(len(pixels), np.float32)
    next_release_us = np.empty(len(pixels), np.float64)
    next_moved = np.empty(len(pixels), np.float32)
    counts = np.zeros(groups, np.int32)
    capacity = 2 * GROUP
    while True:
        keys = np.empty((groups, capacity), np.int64)
        fire_kernel(
            levels,
            veiled,
            clear,
            behind,
            pixels,
            label_clear,
            state["level"],
            state["clear"],
            state["behind"],
            state["moved"],
            state["memory"],
            state["release_us"],
            threshold_on,
            threshold_off,
            next_memory,
            next_release_us,
            next_moved,
            keys,
            counts,
            width,
            first_step,
            float(step_us),
            float(refractory_us),
            float(jitter_us),
            seed & 0xFFFFFFFF,
        )
        if int(counts.max()) <= capacity:
            break
        capacity = int(counts.max())  # the state is still that of the start: run the block again with room
    state["level"][pixels] = levels[:, -1]
    touched = veiled >= 0
    state["clear"][pixels] = 1.0
    state["clear"][pixels[touched]] = clear[veiled[touched], -1]
    state["behind"][pixels[touched]] = behind[veiled[touched], -1]
    state["moved"][pixels] = next_moved
    state["memory"][pixels] = next_memory
    state["release_us"][pixels] = next_release_us
    return keys[np.arange(capacity)[None, :] < counts[:, None]]


def pack(t_us, x, y, p, label):
    """Return events as int64 keys whose order is that of (t, y, x, p, label); ``|t_us| < 2^28``, x and y below 2^16."""
    t_us, x, y, p, label = (np.asarray(column).astype(np.int64) for column in (t_us, x, y, p, label))
    return (t_us << TIME_SHIFT) | (y << Y_SHIFT) | (x << X_SHIFT) | (p << LABEL_BITS) | label


def unpack(keys):
    """Return the columns t int64, x uint16, y uint16, p uint8 and label int8 of packed events."""
    x = ((keys >> X_SHIFT) & 0xFFFF).astype(np.uint16)
    y = ((keys >> Y_SHIFT) & 0xFFFF).astype(np.uint16)
    p = ((keys >> LABEL_BITS) & 1).astype(np.uint8)
    return keys >> TIME_SHIFT, x, y, p, (keys & 3).astype(np.int8)
