"""The kernel equals the plain model bit for bit, whatever the stream, the gates and the cuts."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule, RotationTrajectory
from tiegocancel.matching.oracle import OracleCanceller

FAR = 1 << 40


@st.composite
def streams(draw: st.DrawFn, max_events: int = 120) -> Events:
    """Draw a stream dense enough in space and time that matches, ties and overwrites are common."""
    width, height = draw(st.sampled_from([(1, 1), (2, 3), (7, 5), (16, 12), (40, 3)]))
    count = draw(st.integers(0, max_events))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    start = draw(st.sampled_from([0, -5000, 1 << 29, FAR, -FAR]))
    scale = draw(st.sampled_from([0, 1, 40, 400, 1 << 20, 1 << 29]))
    t = start + np.cumsum(rng.integers(0, scale + 1, count)) if count else np.zeros(0, np.int64)
    return Events(
        t,
        rng.integers(0, width, count),
        rng.integers(0, height, count),
        rng.integers(0, 2, count),
        width,
        height,
    )


configs = st.builds(
    CancelConfig,
    horizon_us=st.sampled_from([0, 1, 37, 500, 8000, (1 << 28) - 1]),
    tolerance_us=st.sampled_from([0, 1, 60, 1000, (1 << 28) - 1]),
    tolerance_px=st.sampled_from([0.0, 0.9, 1.0, 1.5, 2.0, 5**0.5, 3.7]),
    polarity=st.sampled_from(["opposite", "equal", "ignore"]),
    ring_capacity=st.sampled_from([1, 2, 7, 1000]),
)


@st.composite
def schedules(draw: st.DrawFn, start_us: int) -> MotionSchedule:
    """Draw rotations, stillness and arbitrary affine motion, with entries before, inside and after the stream."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    entries = draw(st.integers(1, 5))
    span = draw(st.sampled_from([1, 3000, 1 << 29]))
    t_us = start_us + np.sort(rng.integers(-span, span + 1, entries))
    size = draw(st.sampled_from([0, 1 << 10, 1 << 16, 1 << 44]))
    shift = rng.integers(-3 << 16, (3 << 16) + 1, (entries, 6)) * np.array([0, 0, 1, 0, 0, 1])
    return MotionSchedule(t_us, np.clip(rng.integers(-size, size + 1, (entries, 6)) + shift, -(1 << 44), 1 << 44))


@st.composite
def trajectories(draw: st.DrawFn, start_us: int) -> RotationTrajectory:
    """Draw a moving centre and speed for the float path."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    entries = draw(st.integers(1, 4))
    t_us = start_us + np.cumsum(rng.integers(1, 4000, entries))
    return RotationTrajectory(
        t_us=t_us,
        center_px=rng.normal(5, 3, (entries, 2)),
        omega_rad_s=rng.normal(0, 60, entries),
        source="test",
    )


@st.composite
def cases(draw: st.DrawFn) -> tuple[Events, CancelConfig, MotionSchedule | RotationTrajectory, list[int]]:
    events = draw(streams())
    start = int(events.t[0]) if len(events) else 0
    motion = draw(st.one_of(schedules(start), trajectories(start)))
    cuts = sorted(draw(st.lists(st.integers(0, len(events)), max_size=4)))
    return events, draw(configs), motion, cuts


def decide(canceller: Any, events: Events, cuts: list[int] = ()) -> tuple[list[bool], list[int]]:  # type: ignore[assignment]
    """Process ``events`` cut at ``cuts``; return what was suppressed and by which prediction."""
    suppressed: list[bool] = []
    source: list[int] = []
    for first, last in zip([0, *cuts], [*cuts, len(events)], strict=True):
        decisions = canceller.process(events[first:last])
        suppressed += decisions.suppressed.tolist()
        source += decisions.source.tolist()
    return suppressed, source


def hold_equal(case: Any) -> None:
    """Compare the kernel, cut into chunks, with the plain model over the whole stream."""
    events, config, motion, cuts = case
    kernel = Canceller(config, motion, width=events.width, height=events.height)
    oracle = OracleCanceller(config, motion, width=events.width, height=events.height)
    assert decide(kernel, events, cuts) == decide(oracle, events)
    assert kernel.counters == oracle.counters
    counters = kernel.counters
    assert counters.events == counters.predicted + counters.outside + counters.overflow == len(events)


@settings(max_examples=400, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(cases())
def test_kernel_equals_oracle_for_any_stream_config_motion_and_chunking(case: Any) -> None:
    hold_equal(case)


@pytest.mark.slow
@settings(max_examples=5000, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(cases())
def test_kernel_equals_oracle_over_thousands_of_cases(case: Any) -> None:
    hold_equal(case)


@settings(max_examples=60)
@given(cases())
def test_decisions_do_not_depend_on_tracking_the_source(case: Any) -> None:
    events, config, motion, _ = case
    size = {"width": events.width, "height": events.height}
    plain = Canceller(config, motion, track_source=False, **size)
    tracked = Canceller(config, motion, **size)
    without, with_source = plain.process(events), tracked.process(events)
    assert without.source is None
    assert without.suppressed.tolist() == with_source.suppressed.tolist()
    assert plain.counters == tracked.counters


@settings(max_examples=60)
@given(cases())
def test_each_prediction_is_used_once_and_never_by_its_own_event(case: Any) -> None:
    events, config, motion, _ = case
    decisions = Canceller(config, motion, width=events.width, height=events.height).process(events)
    assert decisions.source is not None
    used = decisions.source[decisions.suppressed]
    assert len(np.unique(used)) == len(used)
    assert (used < np.flatnonzero(decisions.suppressed)).all()
    assert (decisions.source[~decisions.suppressed] == -1).all()


def pair(gap_us: int, dx: int = 0, dy: int = 0, polarities: tuple[int, int] = (1, 1), start_us: int = 0) -> Events:
    """Return two events, the second ``gap_us`` later and ``(dx, dy)`` away from pixel (10, 10)."""
    return Events(
        np.array([start_us, start_us + gap_us]),
        np.array([10, 10 + dx]),
        np.array([10, 10 + dy]),
        np.array(polarities),
        32,
        24,
    )


def second_is_suppressed(events: Events, **config: Any) -> bool:
    canceller = Canceller(CancelConfig(**config), MotionSchedule.still(), width=events.width, height=events.height)
    return bool(canceller.process(events).suppressed[1])


@pytest.mark.parametrize("start_us", [0, FAR, -FAR])
@pytest.mark.parametrize(("gap_us", "met"), [(6999, False), (7000, True), (8000, True), (9000, True), (9001, False)])
def test_time_gate_is_inclusive_at_both_edges(gap_us: int, met: bool, start_us: int) -> None:
    assert second_is_suppressed(pair(gap_us, start_us=start_us)) is met


@pytest.mark.parametrize(
    ("dx", "dy", "tolerance_px", "met"),
    [(2, 0, 2.0, True), (1, 1, 2.0, True), (2, 1, 2.0, False), (2, 1, 5**0.5, True), (3, 2, 13**0.5, True),
     (0, 0, 0.0, True), (1, 0, 0.0, False), (1, 0, 0.99, False), (-8, -6, 10.0, True), (-8, -7, 10.0, False)],
)  # fmt: skip
def test_space_gate_is_a_disc_with_its_rim(dx: int, dy: int, tolerance_px: float, met: bool) -> None:
    assert second_is_suppressed(pair(8000, dx, dy), tolerance_px=tolerance_px) is met


@pytest.mark.parametrize(
    ("polarity", "same", "other"),
    [("opposite", True, False), ("equal", False, True), ("ignore", True, True)],
)
def test_polarity_modes_mean_what_the_semantics_page_says(polarity: str, same: bool, other: bool) -> None:
    for first in (0, 1):
        assert second_is_suppressed(pair(8000, polarities=(first, first)), polarity=polarity) is same
        assert second_is_suppressed(pair(8000, polarities=(first, 1 - first)), polarity=polarity) is other


def test_an_event_never_meets_its_own_prediction_even_when_the_horizon_is_inside_the_gate() -> None:
    events = pair(5000)
    config = CancelConfig(horizon_us=0, tolerance_us=1000)
    assert not Canceller(config, MotionSchedule.still(), width=32, height=24).process(events).suppressed.any()


def test_nearest_prediction_wins_then_the_first_in_row_major_order() -> None:
    at = [(12, 10), (10, 9), (9, 10), (11, 10)]  # distances 2, 1, 1, 1 from (10, 10)
    events = Events(
        np.array([0, 0, 0, 0, 8000, 8000, 8000, 8000]),
        np.array([x for x, _ in at] + [10] * 4),
        np.array([y for _, y in at] + [10] * 4),
        np.ones(8, np.uint8),
        32,
        24,
    )
    decisions = Canceller(CancelConfig(), MotionSchedule.still(), width=32, height=24).process(events)
    assert decisions.source is not None
    assert decisions.source[4:].tolist() == [1, 2, 3, 0]


def test_full_ring_discards_the_new_prediction_and_counts_it() -> None:
    events = Events(np.arange(5), np.arange(5), np.zeros(5, int), np.ones(5, int), 8, 1)
    canceller = Canceller(CancelConfig(ring_capacity=2), MotionSchedule.still(), width=8, height=1)
    canceller.process(events)
    assert dict(canceller.counters) | {"events": 5, "predicted": 2, "overflow": 3} == dict(canceller.counters)
    assert canceller.pending == canceller.counters.ring_high_water == 2


def test_a_stale_cell_does_not_come_back_when_relative_time_wraps() -> None:
    """One prediction, left unused; its 30-bit time would alias once every 2^30 µs."""
    period = 1 << 30
    t = np.concatenate([[0], period * np.arange(1, 6) + 8000])
    events = Events(t, np.full(6, 3), np.full(6, 3), np.ones(6, int), 8, 8)
    canceller = Canceller(CancelConfig(), MotionSchedule.still(), width=8, height=8)
    assert not canceller.process(events).suppressed.any()


def test_chunks_from_the_past_and_from_another_sensor_are_refused() -> None:
    canceller = Canceller(CancelConfig(), MotionSchedule.still(), width=32, height=24)
    canceller.process(pair(10, start_us=1000))
    canceller.process(Events.empty(32, 24))
    with pytest.raises(ValueError, match="the chunk begins at 500 µs, before the last event at 1010 µs"):
        canceller.process(pair(10, start_us=500))
    with pytest.raises(ValueError, match="8×8 px do not fit a canceller of 32×24 px"):
        canceller.process(Events.empty(8, 8))


def test_rotation_cancels_a_rotating_ring_and_zero_motion_does_not() -> None:
    """A synthetic ring: 12 markers on a circle, each firing as it enters a pixel."""
    omega, center, horizon = 3.6, (100.0, 100.0), 40_000
    t = np.arange(0, 400_000, 200)
    angle = omega * t[:, None] * 1e-6 + np.arange(12)[None, :] * (np.pi / 6)
    x = np.floor(center[0] + 80 * np.cos(angle) + 0.5).astype(int)
    y = np.floor(center[1] + 80 * np.sin(angle) + 0.5).astype(int)
    moved = np.ones_like(x, bool)
    moved[1:] = (x[1:] != x[:-1]) | (y[1:] != y[:-1])
    events = Events(np.repeat(t, 12)[moved.ravel()], x[moved], y[moved], np.ones(moved.sum(), int), 200, 200)
    config = CancelConfig(horizon_us=horizon, tolerance_us=2000)
    true = MotionSchedule.rotation(center_px=center, omega_rad_s=omega, horizon_us=horizon)
    late = events.t >= horizon + 2000
    share = {
        name: Canceller(config, motion, width=200, height=200).process(events).suppressed[late].mean()
        for name, motion in (("true", true), ("still", MotionSchedule.still()))
    }
    # The pixel raster costs the rest: two markers' predictions can round into one cell, which holds one of them.
    assert share["true"] > 0.88
    assert share["still"] < 0.05


def test_thread_count_changes_nothing() -> None:
    program = textwrap.dedent("""
        import hashlib, numpy as np
        from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule
        rng = np.random.default_rng(7)
        n = 50_000
        events = Events(np.sort(rng.integers(0, 100_000, n)), rng.integers(0, 64, n), rng.integers(0, 48, n),
                        rng.integers(0, 2, n), 64, 48)
        motion = MotionSchedule.rotation(center_px=(30, 20), omega_rad_s=9.0, horizon_us=8000)
        d = Canceller(CancelConfig(ring_capacity=3000), motion, width=64, height=48).process(events)
        print(hashlib.sha256(d.suppressed.tobytes() + d.source.tobytes()).hexdigest(), d.suppressed.sum())
    """)
    answers = set()
    for threads in ("1", "2"):
        environment = os.environ | {"TIEGOCANCEL_THREADS": threads}
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True
        )
        assert done.stderr == ""
        answers.add(done.stdout)
    assert len(answers) == 1
    assert int(answers.pop().split()[1]) > 1000
