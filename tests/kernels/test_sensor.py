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


def plain_pixel(samples, covers, start, start_cover, memory, on, off, clear, pixel, refractory_us, jitter_us, seed):
    """Return the events (t, p, label) of one pixel, stepping from crossing to crossing."""
    found, release = [], None
    before, was_covered = float(start), start_cover
    memory = np.float32(memory)
    for step, (sample, is_covered) in enumerate(zip(samples, covers, strict=True)):
        after, begin, now, count = float(sample), step * STEP_US, 0.0, 0
        slope = (after - before) / STEP_US
        while True:
            if release is not None:
                if release >= begin + STEP_US:
                    break
                now = release - begin
                memory, release = np.float32(before + slope * now), None
            if slope == 0.0:
                break
            goal = memory + on if slope > 0.0 else memory - off
            when = max((float(goal) - before) / slope, now)
            if when >= STEP_US:
                break
            label = 1 if was_covered or is_covered else clear
            found.append((begin + when + jitter_us * jitter(seed, pixel, step, count), int(slope > 0.0), label))
            count += 1
            release = begin + when + refractory_us
        before, was_covered = after, is_covered
    return found


def scene(seed, pixels=35, steps=30, swing=0.25):
    """Return random walks of log-intensity, covers and a fresh state over a sensor of 7 × 6 px."""
    rng = np.random.default_rng(seed)
    size = WIDTH * 6
    chosen = np.sort(rng.permutation(size)[:pixels]).astype(np.int32)
    level = rng.normal(-1.0, 0.3, size).astype(np.float32)
    walk = level[chosen, None] + np.cumsum(rng.normal(0.0, swing, (pixels, steps)), axis=1)
    state = {
        "level": level,
        "cover": np.zeros(size, np.uint8),
        "memory": (level + rng.uniform(-0.15, 0.15, size)).astype(np.float32),
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
    covered = (rng.random((pixels, steps)) < 0.2).astype(np.uint8)
    return chosen, walk.astype(np.float32), covered, state, fixed


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
    pixels, levels, covered, state, fixed = scene(seed, swing=swing)
    start = copied(state)
    keys = fire(levels, covered, pixels, state, first_step=0, refractory_us=refractory_us, jitter_us=jitter_us, **fixed)
    t, x, y, p, label = unpack(np.sort(keys))
    for row, pixel in enumerate(pixels):
        expected = plain_pixel(
            levels[row],
            covered[row],
            start["level"][pixel],
            start["cover"][pixel],
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
    pixels, levels, covered, state, fixed = scene(seed)
    model = {"refractory_us": 700.0, "jitter_us": 15.0, **fixed}
    parted = copied(state)
    whole = fire(levels, covered, pixels, state, first_step=0, **model)
    first = fire(levels[:, :cut].copy(), covered[:, :cut].copy(), pixels, parted, first_step=0, **model)
    second = fire(levels[:, cut:].copy(), covered[:, cut:].copy(), pixels, parted, first_step=cut, **model)
    later = second + (np.int64(cut * STEP_US) << TIME_SHIFT)
    one, other = unpack(np.sort(whole)), unpack(np.sort(np.concatenate([first, later])))
    assert len(one[0]) == len(other[0]) > 0
    # The memory is kept in 32 bits, so only the last microsecond may move.
    assert np.abs(one[0] - other[0]).max() <= 1
    np.testing.assert_allclose(parted["memory"], state["memory"], atol=1e-6)


def test_more_events_than_room_are_all_returned():
    size = WIDTH * 6
    pixels = np.arange(size, dtype=np.int32)
    state = {
        "level": np.zeros(size, np.float32),
        "cover": np.zeros(size, np.uint8),
        "memory": np.zeros(size, np.float32),
        "release_us": np.full(size, -1.0),
    }
    thresholds = np.full(size, 0.01, np.float32)
    levels = np.tile(np.array([[1.005, 0.0]], np.float32), (size, 1))
    keys = fire(
        levels,
        np.zeros((size, 2), np.uint8),
        pixels,
        state,
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
    pixels, levels, covered, state, fixed = scene(3, pixels=5)
    before = copied(state)
    fire(levels, covered, pixels, state, first_step=0, refractory_us=100.0, jitter_us=0.0, **fixed)
    others = np.setdiff1d(np.arange(WIDTH * 6), pixels)
    for name, column in state.items():
        np.testing.assert_array_equal(column[others], before[name][others])
    np.testing.assert_array_equal(state["level"][pixels], levels[:, -1])


def test_a_pixel_in_reset_through_a_pause_wakes_up_at_the_light_it_sees():
    pixels, levels, covered, state, fixed = scene(4, pixels=1, steps=1)
    state["release_us"][pixels] = 10.0
    state["memory"][pixels] = 99.0
    levels[:] = state["level"][pixels][:, None] + np.float32(0.05)
    keys = fire(levels, covered, pixels, state, first_step=1000, refractory_us=100.0, jitter_us=0.0, **fixed)
    assert len(keys) == 0
    np.testing.assert_array_equal(state["memory"][pixels], state["level"][pixels] - np.float32(0.05))


def test_a_pixel_outside_the_sensor_is_refused():
    pixels, levels, covered, state, fixed = scene(5)
    pixels[-1] = WIDTH * 6
    with pytest.raises(ValueError, match="pixels must be from 0 to 41"):
        fire(levels, covered, pixels, state, first_step=0, refractory_us=0.0, jitter_us=0.0, **fixed)
    with pytest.raises(ValueError, match="must agree"):
        fire(levels[:-1], covered, pixels, state, first_step=0, refractory_us=0.0, jitter_us=0.0, **fixed)


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
