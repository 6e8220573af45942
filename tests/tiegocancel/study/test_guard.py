"""The guard decides as its written rule, whatever the chunks; a contradicted motion stops suppressing."""

from __future__ import annotations

import itertools
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule, RotationTrajectory
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.study import RunResult, Settings, run_stream
from tiegocancel.study.guard import Guard, GuardConfig, is_sampled
from tiegocancel.study.settings import ReportSettings

CENTER, OMEGA = (80.0, 60.0), 13.0
CANCEL = CancelConfig(horizon_us=12_000)
QUICK = GuardConfig(enabled=True, window_events=64, window_us=5_000)


def plain_guard(
    config: GuardConfig,
    events: Events,
    hits: NDArray[np.bool_],
    still: NDArray[Any],
    support: NDArray[Any] | None = None,
    levels: tuple[int, int] = (1, 1),
) -> tuple[list[bool], list[tuple[int, bool]]]:
    """Apply the rule of the docstring, event by event; ``still`` is the support of zero motion, in order.

    ``support`` is that of ``hits``, 1 unless given; ``levels`` are the least and the most that there is.
    """
    opened, n, d, t0, taken, need = False, 0, 0, 0, 0, levels[0]
    met: dict[int, int] = dict.fromkeys(range(levels[0], levels[1] + 1), 0)
    suppressed, changes = [], []
    supports = (hits if support is None else support).astype(int).tolist()

    def judge(now: int) -> None:
        nonlocal opened, n, d, need, met
        need = min([k for k in met if 65_536 * met[k] <= config.most_lost * n], default=levels[1] + 1)
        met = dict.fromkeys(met, 0)
        was = opened
        if 256 * d < config.close_below * n:
            opened = False
        elif n >= config.window_events // 32 and 256 * d >= config.open_at * n:
            opened = True
        if opened is not was:
            changes.append((now, opened))
        n = d = 0

    for t, x, y, hit, its in zip(*(getattr(events, c).tolist() for c in "txy"), hits.tolist(), supports, strict=True):
        sampled = ((x >> 4) + 5 * (y >> 4)) % 16 == 0
        if sampled and n > 0 and t - t0 >= config.window_us:
            judge(t)
        suppressed.append(hit and opened and its >= need)
        if sampled:
            t0 = t if n == 0 else t0
            n, d = n + 1, d + hit - bool(still[taken] >= levels[0])
            met = {k: count + bool(still[taken] >= k) for k, count in met.items()}
            taken += 1
            if n == config.window_events:
                judge(t)
    return suppressed, changes


@settings(max_examples=60)
@given(
    seed=st.integers(0, 1 << 30),
    span_us=st.sampled_from([500, 20_000, 400_000]),
    window_us=st.sampled_from([1, 300, 5_000, 1 << 28]),
    cuts=st.lists(st.integers(0, 900), max_size=6),
)
def test_the_rule_is_followed_to_the_event(seed: int, span_us: int, window_us: int, cuts: list[int]) -> None:
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(0, span_us, 900))
    events = Events(t, rng.integers(0, 40, 900), rng.integers(0, 40, 900), rng.integers(0, 2, 900), 40, 40)
    cancel = CancelConfig(horizon_us=300, tolerance_us=200, ring_capacity=4096)
    config = GuardConfig(enabled=True, window_events=32, window_us=window_us, margin=0.25)
    hits = rng.random(900) < np.where(np.arange(900) // 300 % 2, 0.1, 0.9)
    sampled = events.select(is_sampled(events.x, events.y))
    zero = OracleCanceller(cancel, MotionSchedule.still(), width=40, height=40)
    expected, changes = plain_guard(config, events, hits, zero.process(sampled).suppressed)
    guard = Guard(config, cancel, width=40, height=40)
    edges = [0, *sorted(cuts), 900]
    found = [guard.process(events[a:b], hits[a:b]) for a, b in itertools.pairwise(edges)]
    assert np.concatenate(found).tolist() == expected
    assert guard.changes == changes
    counters = guard.counters
    assert counters.openings - counters.closures == guard.open
    assert counters.passed == hits.sum() - sum(expected)
    assert (counters.sampled, counters.hits) == (len(sampled), hits[is_sampled(events.x, events.y)].sum())


@settings(max_examples=40)
@given(
    seed=st.integers(0, 1 << 30),
    max_loss=st.sampled_from([0.0, 0.02, 0.1, 0.4]),
    cuts=st.lists(st.integers(0, 900), max_size=4),
)
def test_support_is_asked_for_until_zero_motion_meets_no_more_than_the_bound(
    seed: int, max_loss: float, cuts: list[int]
) -> None:
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(0, 20_000, 900))
    events = Events(t, rng.integers(0, 20, 900), rng.integers(0, 20, 900), rng.integers(0, 2, 900), 40, 40)
    cancel = CancelConfig(horizon_us=300, early_us=100, late_us=200, uses=0, carry=3, need=2, ring_capacity=4096)
    config = GuardConfig(enabled=True, window_events=32, window_us=5000, margin=0.05, max_loss=max_loss)
    support = rng.integers(0, 5, 900).astype(np.uint8)
    hits = support >= 2
    sampled = events.select(is_sampled(events.x, events.y))
    zero = OracleCanceller(cancel, MotionSchedule.still(), width=40, height=40).process(sampled)
    assert zero.support is not None
    expected, changes = plain_guard(config, events, hits, zero.support, support, (2, 4))
    guard = Guard(config, cancel, width=40, height=40)
    edges = [0, *sorted(cuts), 900]
    found = [guard.process(events[a:b], hits[a:b], support[a:b]) for a, b in itertools.pairwise(edges)]
    assert np.concatenate(found).tolist() == expected
    assert guard.changes == changes
    assert guard.counters.raised <= guard.counters.windows


def test_one_pixel_in_sixteen_is_sampled() -> None:
    y, x = np.divmod(np.arange(1280 * 720), 1280)
    assert is_sampled(x.astype(np.uint16), y.astype(np.uint16)).mean() == pytest.approx(1 / 16, abs=1e-3)
    far = np.array([65_535], np.uint16)
    assert is_sampled(far, far)[0] == ((4095 + 5 * 4095) % 16 == 0)


def decided(events: Events, omega: float, **guard: Any) -> RunResult:
    wanted = Settings(
        cancel=CANCEL,
        guard=GuardConfig(**{**asdict(QUICK), **guard}),
        report=ReportSettings(disc_radius_px=60.0, diagnose=False, controls=False, chunk_events=701),
    )
    result = run_stream([events], wanted, RotationTrajectory.constant(center_px=CENTER, omega_rad_s=omega))
    assert result is not None
    return result


def test_a_true_motion_is_let_work(turning_scene: Events) -> None:
    free, guarded = (decided(turning_scene, OMEGA, enabled=on) for on in (False, True))
    assert guarded.guard is not None
    assert guarded.guard["openings"] == 1
    assert guarded.guard["closures"] == 0
    assert guarded.counters.suppressed > 0.9 * free.counters.suppressed
    assert guarded.counters.suppressed + guarded.guard["passed"] == free.counters.suppressed
    numbers = guarded.to_json()
    assert numbers["events"] - numbers["residual"] == numbers["suppressed"] == guarded.counters.suppressed


def test_a_motion_of_the_wrong_sign_suppresses_nothing(turning_scene: Events) -> None:
    assert decided(turning_scene, -OMEGA, enabled=False).counters.suppressed > 100
    assert decided(turning_scene, -OMEGA, window_events=512, window_us=100_000).counters.suppressed == 0


def test_suppression_stops_within_two_windows_of_the_contradiction_and_resumes(turning_scene: Events) -> None:
    right = MotionSchedule.rotation(center_px=CENTER, omega_rad_s=OMEGA, horizon_us=CANCEL.horizon_us)
    wrong = MotionSchedule.rotation(center_px=CENTER, omega_rad_s=-OMEGA, horizon_us=CANCEL.horizon_us)
    both = MotionSchedule(
        np.array([0, 30_000, 60_000]),
        np.concatenate([right.coefficients, wrong.coefficients, right.coefficients]),
        CANCEL.horizon_us,
    )
    hits = Canceller(CANCEL, both, width=160, height=120).process(turning_scene).suppressed
    guard = Guard(QUICK, CANCEL, width=160, height=120)
    guard.process(turning_scene, hits)
    sampled = turning_scene.t[is_sampled(turning_scene.x, turning_scene.y)]
    assert [opened for _, opened in guard.changes] == [True, False, True]
    due_us = [start + CANCEL.horizon_us for start in (0, 30_000, 60_000)]
    for (t_us, _), from_us in zip(guard.changes, due_us, strict=True):
        first = np.searchsorted(sampled, from_us - CANCEL.tolerance_us)
        last = np.searchsorted(sampled, from_us + CANCEL.tolerance_us)
        assert from_us - CANCEL.tolerance_us <= t_us
        assert t_us <= sampled[last + 2 * QUICK.window_events]
        assert first <= last


def test_zero_motion_is_there_to_compare_even_where_small_shifts_are_not_predicted(turning_scene: Events) -> None:
    still = Events(
        turning_scene.t, np.full(len(turning_scene), 3), np.full(len(turning_scene), 3), turning_scene.p, 160, 120
    )
    guard = Guard(QUICK, CancelConfig(horizon_us=12_000, least_shift_px=2.0), width=160, height=120)
    guard.process(still, np.ones(len(still), np.bool_))
    assert guard.counters.still_hits > 0.2 * len(still)


@pytest.mark.parametrize(
    ("field", "value"),
    [("window_events", 31), ("window_us", 0), ("margin", 0.001), ("margin", float("nan")), ("max_loss", 1.5)],
)
def test_what_is_out_of_range_is_refused_by_name(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=field):
        GuardConfig(**{field: value})  # type: ignore[arg-type]


def test_a_selective_canceller_has_a_guard_too(turning_scene: Events) -> None:
    cancel = CancelConfig(horizon_us=6_000, more_horizons_us=(12_000,), need=2, uses=0, least_shift_px=1.0)
    wanted = Settings(cancel=cancel, guard=QUICK, report=ReportSettings(disc_radius_px=60.0, controls=False))
    found = {}
    for omega in (OMEGA, -OMEGA):
        motion = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=omega)
        result = run_stream([turning_scene], wanted, motion)
        assert result is not None
        found[omega] = result.counters.suppressed / len(turning_scene)
    assert found[OMEGA] > 0.3
    assert found[-OMEGA] < 0.05
