"""Hold the pixel kernel to a plain model of one pixel at a time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.kernels.sensor import TIME_SHIFT, fire, pack, unpack

WIDTH = 7
STEP_US = 400
MASK = 0xFFFFFFFF


def scrambled(value):
    """The 32-bit mixer, in Python's integers."""
    value ^= value >> 16
    value = value * 0x7FEB352D & MASK
    value ^= value >> 15
    value = value * 0x846CA68B & MASK
    return value ^ value >> 16


def jitter(seed, pixel, step, count):
    """The jitter of one event, in deviations."""
    key = scrambled(seed ^ scrambled(pixel ^ scrambled(step ^ scrambled(count))))
    more = scrambled(key + 0x9E3779B9 & MASK)
    total = (key & 0xFFFF) + (key >> 16) + (more & 0xFFFF) + (more >> 16)
    return (total - 131070) * math.sqrt(3.0) / 65536


def plain_pixel(samples, shares, backs, start, memory, on, off, place_label, pixel, refractory_us, jitter_us, seed):
    """Return the events (t, p, label) of one pixel, stepping from crossing to crossing.

    What background and mover have done since the last reset is kept apart, each from 0, for the label.
    """
    found, release = [], None
    before, was_share, was_back = float(start), 1.0, float(start)
    memory = np.float32(memory)
    ego = mover = 0.0
    for step, (sample, share, back) in enumerate(zip(samples, shares, backs, strict=True)):
        after, begin, now, count = float(sample), step * STEP_US, 0.0, 0
        slope = (after - before) / STEP_US
        ego_slope = (float(back) - was_back) * 0.5 * (was_share + float(share)) / STEP_US
        counted_to = 0.0
        while True:
            if release is not None:
                if release >= begin + STEP_US:
                    break
                now = release - begin
                memory, release = np.float32(before + slope * now), None
                ego = mover = 0.0
                counted_to = now
            if slope == 0.0:
                break
            goal = memory + on if slope > 0.0 else memory - off
            when = max((float(goal) - before) / slope, now)
            if when >= STEP_US:
                break
            ego_then = ego + ego_slope * (when - counted_to)
            mover_then = mover + (slope - ego_slope) * (when - counted_to)
            toward = 1.0 if slope > 0.0 else -1.0
            label = 1 if toward * mover_then > toward * ego_then else place_label
            found.append((begin + when + jitter_us * jitter(seed, pixel, step, count), int(slope > 0.0), label))
            count += 1
            release = begin + when + refractory_us
        ego += ego_slope * (STEP_US - counted_to)
        mover += (slope - ego_slope) * (STEP_US - counted_to)
        before, was_share, was_back = after, float(share), float(back)
    return found


def scene(seed, pixels=35, steps=30, swing=0.25):
    """Return random walks of log-intensity, what movers let through, and a fresh state over a sensor of 7 × 6 px."""
    rng = np.random.default_rng(seed)
    size = WIDTH * 6
    chosen = np.sort(rng.permutation(size)[:pixels]).astype(np.int32)
    level = rng.normal(-1.0, 0.3, size).astype(np.float32)
    walk = level[chosen, None] + np.cumsum(rng.normal(0.0, swing, (pixels, steps)), axis=1)
    offset = rng.uniform(-0.15, 0.15, size)
    state = {
        "level": level,
        "clear": np.ones(size, np.float32),
        "behind": np.zeros(size, np.float32),
        "memory": (level + offset).astype(np.float32),
        "moved": (-0.5 * offset).astype(np.float32),
        "release_us": np.full(size, -1.0),
    }
    fixed = {
        "label_clear": rng.choice([0, 2], size).astype(np.uint8),
        "threshold_on": rng.uniform(0.18, 0.25, size).astype(np.float32),
        "threshold_off": rng.uniform(0.18, 0.25, size).astype(np.float32),
        "width": WIDTH,
        "step_us": STEP_US,
        "seed": seed,
    }
    return chosen, walk.astype(np.float32), screen(walk.astype(np.float32), swing, rng), state, fixed


def screen(levels, swing, rng):
    """Return what movers let through: on two pixels in three, half of the time, before a background of its own."""
    touched = rng.random(len(levels)) < 0.67
    veiled = np.where(touched, np.cumsum(touched) - 1, -1).astype(np.int32)
    mine = levels[touched]
    clear = np.where(rng.random(mine.shape) < 0.5, 1.0, rng.choice([0.0, 0.3, 0.8], mine.shape)).astype(np.float32)
    own = mine[:, :1] + np.cumsum(rng.normal(0.0, swing, mine.shape), axis=1).astype(np.float32)
    return {"veiled": veiled, "clear": clear, "behind": np.where(clear == 1.0, mine, own).astype(np.float32)}


def cut_between(view, first, last):
    """Return the columns of a screen from one step to another."""
    parts = {name: view[name][:, first:last].copy() for name in ("clear", "behind")}
    return {"veiled": view["veiled"], **parts}


def bare(levels):
    """Return a screen without movers."""
    none = np.zeros((0, levels.shape[1]), np.float32)
    return {"veiled": np.full(len(levels), -1, np.int32), "clear": none, "behind": none}


def copied(state):
    return {name: column.copy() for name, column in state.items()}


@settings(max_examples=25)
@given(
    seed=st.integers(0, MASK),
    refractory_us=st.sampled_from([0.0, 90.0, 400.0, 3000.0]),
    jitter_us=st.sampled_from([0.0, 20.0]),
    swing=st.sampled_from([0.05, 0.25, 1.5]),
)
def test_events_equal_those_of_the_plain_pixel(seed, refractory_us, jitter_us, swing):
    pixels, levels, view, state, fixed = scene(seed, swing=swing)
    start = copied(state)
    model = {"refractory_us": refractory_us, "jitter_us": jitter_us, **fixed}
    keys = fire(levels, pixels, state, first_step=0, **view, **model)
    t, x, y, p, label = unpack(np.sort(keys))
    for row, pixel in enumerate(pixels):
        expected = plain_pixel(
            levels[row],
            view["clear"][view["veiled"][row]] if view["veiled"][row] >= 0 else np.ones(levels.shape[1]),
            view["behind"][view["veiled"][row]] if view["veiled"][row] >= 0 else levels[row],
            start["level"][pixel],
            start["memory"][pixel],
            fixed["threshold_on"][pixel],
            fixed["threshold_off"][pixel],
            int(fixed["label_clear"][pixel]),
            int(pixel),
            refractory_us,
            jitter_us,
            seed,
        )
        here = y.astype(int) * WIDTH + x == pixel
        found = list(zip(t[here].tolist(), p[here].tolist(), label[here].tolist(), strict=True))
        assert len(found) == len(expected)
        # Sorting by time may swap jittered neighbours, and floating point may cross the edge of a microsecond.
        for one, other in zip(found, sorted((math.floor(e[0]), *e[1:]) for e in expected), strict=True):
            assert abs(one[0] - other[0]) <= 1
        assert sorted(e[1:] for e in found) == sorted(e[1:] for e in expected)


@settings(max_examples=10)
@given(seed=st.integers(0, MASK), cut=st.integers(1, 29))
def test_cutting_time_into_blocks_changes_nothing(seed, cut):
    pixels, levels, view, state, fixed = scene(seed)
    model = {"refractory_us": 700.0, "jitter_us": 15.0, **fixed}
    parted = copied(state)
    whole = fire(levels, pixels, state, first_step=0, **view, **model)
    early, late = cut_between(view, 0, cut), cut_between(view, cut, 30)
    first = fire(levels[:, :cut].copy(), pixels, parted, first_step=0, **early, **model)
    second = fire(levels[:, cut:].copy(), pixels, parted, first_step=cut, **late, **model)
    later = second + (np.int64(cut * STEP_US) << TIME_SHIFT)
    one, other = unpack(np.sort(whole)), unpack(np.sort(np.concatenate([first, later])))
    assert len(one[0]) == len(other[0]) > 0
    # The memory is kept in 32 bits, so only the last microsecond may move.
    assert np.abs(one[0] - other[0]).max() <= 1
    assert np.count_nonzero(one[4] != other[4]) == 0
    np.testing.assert_allclose(parted["memory"], state["memory"], atol=1e-6)
    np.testing.assert_allclose(parted["moved"], state["moved"], atol=1e-5)


def test_more_events_than_room_are_all_returned():
    size = WIDTH * 6
    pixels = np.arange(size, dtype=np.int32)
    state = {
        "level": np.zeros(size, np.float32),
        "clear": np.ones(size, np.float32),
        "behind": np.zeros(size, np.float32),
        "memory": np.zeros(size, np.float32),
        "moved": np.zeros(size, np.float32),
        "release_us": np.full(size, -1.0),
    }
    thresholds = np.full(size, 0.01, np.float32)
    levels = np.tile(np.array([[1.005, 0.0]], np.float32), (size, 1))
    keys = fire(
        levels,
        pixels,
        state,
        **bare(levels),
        label_clear=np.zeros(size, np.uint8),
        threshold_on=thresholds,
        threshold_off=thresholds,
        width=WIDTH,
        first_step=0,
        step_us=STEP_US,
        refractory_us=0.0,
        jitter_us=0.0,
        seed=0,
    )
    _, _, _, p, _ = unpack(keys)
    assert p.sum() == 100 * size
    assert len(keys) - p.sum() in range(99 * size, 101 * size + 1)


def test_pixels_that_are_not_listed_keep_their_state():
    pixels, levels, view, state, fixed = scene(3, pixels=5)
    before = copied(state)
    fire(levels, pixels, state, **view, first_step=0, refractory_us=100.0, jitter_us=0.0, **fixed)
    others = np.setdiff1d(np.arange(WIDTH * 6), pixels)
    for name, column in state.items():
        np.testing.assert_array_equal(column[others], before[name][others])
    np.testing.assert_array_equal(state["level"][pixels], levels[:, -1])


def test_a_pixel_in_reset_through_a_pause_wakes_up_at_the_light_it_sees():
    pixels, levels, view, state, fixed = scene(4, pixels=1, steps=1)
    state["release_us"][pixels] = 10.0
    state["memory"][pixels] = 99.0
    levels[:] = state["level"][pixels][:, None] + np.float32(0.05)
    keys = fire(levels, pixels, state, **view, first_step=1000, refractory_us=100.0, jitter_us=0.0, **fixed)
    assert len(keys) == 0
    np.testing.assert_array_equal(state["memory"][pixels], state["level"][pixels] - np.float32(0.05))


def test_a_pixel_outside_the_sensor_is_refused():
    pixels, levels, view, state, fixed = scene(5)
    pixels[-1] = WIDTH * 6
    with pytest.raises(ValueError, match="pixels must be from 0 to 41"):
        fire(levels, pixels, state, **view, first_step=0, refractory_us=0.0, jitter_us=0.0, **fixed)
    pixels[-1] = 0
    short = {**view, "clear": view["clear"][:-1], "behind": view["behind"][:-1]}
    with pytest.raises(ValueError, match="veiled must be below"):
        fire(levels, pixels, state, **short, first_step=0, refractory_us=0.0, jitter_us=0.0, **fixed)
    with pytest.raises(ValueError, match="must agree"):
        fire(levels[:-1], pixels, state, **view, first_step=0, refractory_us=0.0, jitter_us=0.0, **fixed)


def labelled(levels, clear, behind, *, level=0.0, offset=0.0, refractory_us=0.0):
    """Return (p, label) of the events of one pixel on moving ground, of threshold 0.2, in the order of their times."""
    levels, clear, behind = (np.asarray([row], np.float32) for row in (levels, clear, behind))
    state = {
        "level": np.float32([level]),
        "clear": np.ones(1, np.float32),
        "behind": np.zeros(1, np.float32),
        "memory": np.float32([level + offset]),
        "moved": np.float32([-0.5 * offset]),
        "release_us": np.full(1, -1.0),
    }
    keys = fire(
        levels, np.zeros(1, np.int32), state, veiled=np.zeros(1, np.int32), clear=clear, behind=behind,
        label_clear=np.zeros(1, np.uint8), threshold_on=np.full(1, 0.2, np.float32),
        threshold_off=np.full(1, 0.2, np.float32), width=1, first_step=0, step_us=STEP_US,
        refractory_us=refractory_us, jitter_us=0.0, seed=0,
    )  # fmt: skip
    _, _, _, p, label = unpack(np.sort(keys))
    return list(zip(p.tolist(), label.tolist(), strict=True))


def test_an_edge_of_the_background_past_a_mover_that_covers_a_little_is_the_backgrounds():
    # The mover covers a tenth all the while; the background brightens by 0.5 behind it.
    assert labelled([-0.05, 0.4], [0.9, 0.9], [0.0, 0.5]) == [(1, 0)]


def test_the_outline_of_a_mover_belongs_to_it_when_it_comes_and_when_it_goes():
    # A mover darker by 0.3 covers a still background and leaves again.
    assert labelled([-0.3, -0.3, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], refractory_us=300.0) == [(0, 1), (1, 1)]


def test_what_the_background_does_once_the_mover_has_gone_is_the_backgrounds():
    # The pixel wakes up after the mover has left, and then an edge of the background passes.
    seen, clear = [-0.3, -0.3, 0.0, 0.0, 0.3], [0.0, 0.0, 1.0, 1.0, 1.0]
    assert labelled(seen, clear, [0.0, 0.0, 0.0, 0.0, 0.3], refractory_us=1000.0) == [(0, 1), (1, 0)]


def test_the_larger_share_of_the_change_decides_not_who_comes_last():
    # First the mover's 0.15, then the background's 0.06 which crosses the threshold, and the other way round.
    assert labelled([0.15, 0.21], [0.5, 0.5], [0.0, 0.12]) == [(1, 1)]
    assert labelled([0.15, 0.21], [1.0, 0.5], [0.15, 0.15]) == [(1, 0)]


def test_the_first_memory_which_nobody_made_decides_nothing():
    # The pixel begins 0.09 away from its memory: of the 0.12 that are missing the mover makes all, or the background.
    assert labelled([0.12], [0.5], [0.0], offset=-0.09) == [(1, 1)]
    assert labelled([0.12], [0.5], [0.16], offset=-0.09) == [(1, 0)]


@given(
    st.lists(
        st.tuples(
            st.integers(-(2**28) + 1, 2**28 - 1),
            st.integers(0, 65535),
            st.integers(0, 65535),
            st.integers(0, 1),
            st.integers(0, 2),
        ),
        min_size=1,
    )
)
def test_keys_keep_every_column_and_the_order(rows):
    t, x, y, p, label = np.array(rows, np.int64).T
    keys = pack(t, x, y, p, label)
    for column, given_column in zip(unpack(keys), (t, x, y, p, label), strict=True):
        np.testing.assert_array_equal(column, given_column)
    by_key = [rows[i] for i in np.argsort(keys, kind="stable")]
    assert by_key == sorted(rows, key=lambda row: (row[0], row[2], row[1], row[3], row[4]))
