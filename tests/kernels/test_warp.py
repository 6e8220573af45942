"""Hold the kernel of warped-event images equal to a plain NumPy model, to the last bit."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.kernels.warp import EVENT_WEIGHT, MAX_EVENTS, warp_energy

from tiegocancel.motion.schedule import rotation_coefficients


def model(x, y, weight, slot, warp, cell_bits, margin, shape):
    """Splat one event after the other, as the docstring of the kernel says."""
    image = np.zeros(shape, np.int64)
    for layer, table in zip(image, warp, strict=True):
        for px, py, w, (a, b, c, d, e, f) in zip(
            x.tolist(), y.tolist(), weight.tolist(), table[slot].tolist(), strict=True
        ):
            fine_x = (((px << 16) + a * px + b * py + c) >> (10 + cell_bits)) + 32
            fine_y = (((py << 16) + d * px + e * py + f) >> (10 + cell_bits)) + 32
            column, row, u, v = (fine_x >> 6) + margin, (fine_y >> 6) + margin, fine_x & 63, fine_y & 63
            if not (1 <= column < shape[2] - 1 and 1 <= row < shape[1] - 1):
                continue
            across = np.array([(64 - u) ** 2, 8192 - (64 - u) ** 2 - u * u, u * u])
            down = np.array([(64 - v) ** 2, 8192 - (64 - v) ** 2 - v * v, v * v])
            layer[row - 1 : row + 2, column - 1 : column + 2] += w * ((np.outer(down, across) + 8192) >> 14)
    return image


def case(seed, *, count=60, candidates=3, slots=4, scale=1.0):
    rng = np.random.default_rng(seed)
    x, y = (rng.integers(0, side, count).astype(np.int32) for side in (48, 32))
    weight = rng.integers(-1, 2, count).astype(np.int32)
    slot = np.sort(rng.integers(0, slots, count)).astype(np.int32)
    omega = rng.uniform(-40, 40, (candidates, slots)) * scale
    warp = rotation_coefficients(rng.uniform(-20, 70), rng.uniform(-20, 50), omega, 10_000)
    return x, y, weight, slot, np.ascontiguousarray(warp)


@given(
    seed=st.integers(0, 2**31),
    cell_bits=st.integers(0, 6),
    margin=st.integers(0, 5),
    scale=st.sampled_from([0.0, 0.1, 1.0]),
)
@settings(max_examples=60, deadline=None)
def test_image_sum_and_energy_equal_the_model(seed, cell_bits, margin, scale):
    events = case(seed, scale=scale)
    image = np.full((4, (32 >> cell_bits) + 2 * margin + 3, (48 >> cell_bits) + 2 * margin + 3), 77, np.int32)
    total, energy = warp_energy(*events, cell_bits, margin, image)
    expected = model(*events, cell_bits, margin, (3, *image.shape[1:]))
    assert np.array_equal(image[:3], expected)
    assert (image[3] == 77).all(), "a layer beyond the candidates was written"
    assert np.array_equal(total, expected.sum(axis=(1, 2)))
    assert np.array_equal(energy, (expected**2).sum(axis=(1, 2)))


def test_event_at_a_cell_centre_spreads_symmetrically_and_keeps_its_weight():
    one = np.ones(1, np.int32)
    image = np.zeros((1, 9, 9), np.int32)
    total, _ = warp_energy(one * 3, one * 3, one, one * 0, np.zeros((1, 1, 6), np.int64), 0, 1, image)
    assert np.array_equal(image[0], image[0].T)
    assert np.array_equal(image[0], image[0][:, [8, 7, 6, 5, 4, 3, 2, 1, 0]])
    assert image[0].argmax() == 4 * 9 + 4
    assert abs(int(total[0]) - EVENT_WEIGHT) <= 9


@pytest.mark.parametrize("far", [1 << 44, -(1 << 44), (1 << 40) + (5 << 16), 1 << 48])
def test_far_warps_leave_the_image_empty_and_never_wrap_into_it(far):
    x = np.arange(5, dtype=np.int32)
    warp = np.zeros((1, 1, 6), np.int64)
    warp[0, 0, 2] = far
    image = np.zeros((1, 12, 12), np.int32)
    total, energy = warp_energy(x, x, np.ones(5, np.int32), np.zeros(5, np.int32), warp, 0, 2, image)
    assert not image.any()
    assert (total[0], energy[0]) == (0, 0)


def test_no_events_clear_the_image():
    none = np.zeros(0, np.int32)
    image = np.ones((2, 4, 4), np.int32)
    total, energy = warp_energy(none, none, none, none, np.zeros((2, 1, 6), np.int64), 0, 0, image)
    assert not image.any()
    assert not total.any()
    assert not energy.any()


def test_most_events_on_one_cell_do_not_overflow():
    column = np.full(MAX_EVENTS, 3, np.int32)
    image = np.zeros((1, 9, 9), np.int32)
    one, none = np.ones(MAX_EVENTS, np.int32), np.zeros(MAX_EVENTS, np.int32)
    total, energy = warp_energy(column, column, one, none, np.zeros((1, 1, 6), np.int64), 0, 1, image)
    single = np.zeros((1, 9, 9), np.int32)
    warp_energy(column[:1], column[:1], one[:1], none[:1], np.zeros((1, 1, 6), np.int64), 0, 1, single)
    exact = single.astype(object) * MAX_EVENTS
    assert int(total[0]) == exact.sum()
    assert int(energy[0]) == (exact**2).sum()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("slot", np.full(60, 4, np.int32), "slot must be from 0 to 3"),
        ("slot", np.full(60, -1, np.int32), "slot must be from 0 to 3"),
        ("weight", np.full(60, 2, np.int32), "weight must be from -1 to 1"),
        ("x", np.zeros(59, np.int32), None),
        ("x", np.zeros(120, np.int32)[::2], "contiguous"),
        ("warp", np.zeros((3, 4, 5), np.int64), "warp must be"),
        ("cell_bits", 7, "cell_bits must be from 0 to 6"),
        ("margin", -1, "margin must not be negative"),
        ("image", np.zeros((2, 40, 60), np.int32), "image must be"),
        ("image", np.zeros((3, 40, 60), np.int64), "image must be"),
    ],
)
def test_misuse_is_refused_before_the_launch(name, value, message):
    names = ("x", "y", "weight", "slot", "warp", "cell_bits", "margin", "image")
    arguments = dict(zip(names, (*case(1), 0, 2, np.zeros((3, 40, 60), np.int32)), strict=True))
    arguments[name] = value
    with pytest.raises(ValueError, match=message):
        warp_energy(*arguments.values())


_PROGRAM = """
import hashlib, numpy as np
from tiegocancel.kernels.warp import warp_energy
from tiegocancel.motion.schedule import rotation_coefficients
rng = np.random.default_rng(3)
n = 20000
x, y = rng.integers(0, 320, n).astype(np.int32), rng.integers(0, 240, n).astype(np.int32)
warp = np.ascontiguousarray(rotation_coefficients(150.0, 90.0, rng.uniform(-9, 9, (7, 16)), 10000))
image = np.zeros((7, 150, 190), np.int32)
weight = (rng.integers(0, 2, n) * 2 - 1).astype(np.int32)
total, energy = warp_energy(x, y, weight, (np.arange(n) * 16 // n).astype(np.int32), warp, 1, 10, image)
print(hashlib.sha256(image.tobytes() + total.tobytes() + energy.tobytes()).hexdigest())
"""


def test_number_of_threads_changes_no_bit():
    digests = set()
    for threads in ("1", "3"):
        environment = {**os.environ, "TIEGOCANCEL_THREADS": threads}
        done = subprocess.run(
            [sys.executable, "-c", _PROGRAM], env=environment, capture_output=True, text=True, check=True, timeout=120
        )
        digests.add(done.stdout)
    assert len(digests) == 1
    assert len(digests.pop().strip()) == 64
