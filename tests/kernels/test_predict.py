"""The predict kernel equals the schedule's own arithmetic, for any entries and any cuts between them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.kernels.predict import predict

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule


@settings(max_examples=80)
@given(st.integers(0, 2**32 - 1), st.integers(0, 200), st.integers(1, 9), st.sampled_from([0, 1 << 12, 1 << 44]))
def test_kernel_equals_the_schedule(seed: int, count: int, entries: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    width, height, stride, origin = 300, 200, 303, 911
    x, y = rng.integers(0, width, count).astype(np.uint16), rng.integers(0, height, count).astype(np.uint16)
    coefficients = rng.integers(-size, size + 1, (entries, 6))
    segments = np.concatenate([[0], np.sort(rng.integers(0, count + 1, entries - 1)), [count]]).astype(np.int64)
    ahead = np.full(count + 3, -7, np.int32)
    predict(
        width=width, height=height, stride=stride, origin=origin, segments=segments, coefficients=coefficients,
        x=x, y=y, ahead=ahead,
    )  # fmt: skip
    for entry in range(entries):
        rows = slice(segments[entry], segments[entry + 1])
        one = MotionSchedule(np.zeros(1, np.int64), coefficients[entry : entry + 1])
        to_x, to_y = one.predict(np.zeros(len(x[rows]), np.int64), x[rows], y[rows])
        inside = (to_x >= 0) & (to_x < width) & (to_y >= 0) & (to_y < height)
        assert ahead[rows].tolist() == np.where(inside, origin + to_y * stride + to_x, -1).tolist()
    assert (ahead[count:] == -7).all()


def test_a_chunk_may_be_shorter_than_the_one_before() -> None:
    """The buffer of predictions is kept between chunks; its tail must not leak into a shorter chunk."""
    rng = np.random.default_rng(1)
    t = np.sort(rng.integers(0, 40_000, 600))
    events = Events(t, rng.integers(0, 9, 600), rng.integers(0, 9, 600), rng.integers(0, 2, 600), 9, 9)
    motion = MotionSchedule.rotation(center_px=(4, 4), omega_rad_s=20.0, horizon_us=3000)
    whole, parts = (Canceller(CancelConfig(horizon_us=3000), motion, width=9, height=9) for _ in range(2))
    expected = whole.process(events).suppressed
    found = [parts.process(events[a:b]).suppressed for a, b in ((0, 500), (500, 501), (501, 600))]
    assert np.array_equal(np.concatenate(found), expected)
