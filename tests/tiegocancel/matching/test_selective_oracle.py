"""The plain model of the selective rule: each parameter does what it says, and the theorems hold."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import CancelConfig, Events, MotionSchedule, RotationTrajectory
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.matching.selective import Schedules
from tiegocancel.matching.selective_oracle import SelectiveOracle

STILL = MotionSchedule.still()
seeds = st.integers(0, 2**32)


def stream(rng: np.random.Generator, width: int, height: int) -> Events:
    """Return up to 150 events so crowded that matches, ties and overwrites are common, with gaps between."""
    count = int(rng.integers(0, 150))
    t = int(rng.choice([-5000, 0, 1 << 40])) + np.cumsum(rng.choice([0, 0, 1, 1, 3, 9, 70], count))
    return Events(t, *(rng.integers(0, limit, count) for limit in (width, height, 2)), width, height)


def selective(rng: np.random.Generator, **fixed: Any) -> CancelConfig:
    """Return a random configuration of at most three horizons."""
    tick = 1 << int(rng.integers(0, 3))
    horizons = np.sort(rng.choice(np.arange(6, 40), int(rng.integers(1, 4)), replace=False)) * tick
    carry = int(rng.choice([0, 1, 3]))
    table: dict[str, Any] = {
        "horizon_us": int(horizons[0]),
        "more_horizons_us": tuple(horizons[1:].tolist()),
        "early_us": int(rng.integers(0, 6)) * tick,
        "late_us": int(rng.integers(0, 6)) * tick,
        "tolerance_px": float(rng.choice([0, 1, 1.5, 2])),
        "polarity": str(rng.choice(["opposite", "equal", "ignore"])),
        "ring_capacity": int(rng.choice([2, 12, 500])),
        "carry": carry,
        "need": int(rng.integers(1, len(horizons) + carry + 1)),
        "uses": int(rng.integers(0, 4)),
        "tick_bits": tick.bit_length() - 1,
        "bin_bits": int(rng.integers(0, 3)),
        "set_bits": None if rng.random() < 0.5 else (int(rng.integers(0, 3)), int(rng.integers(0, 3))),
        "ways": int(rng.integers(1, 4)),
        "least_shift_px": float(rng.choice([0, 1.0])),
        "motion_at": str(rng.choice(["event", "gate"])),
    }
    return CancelConfig(**{**table, **fixed})


def motions(rng: np.random.Generator, config: CancelConfig, events: Events) -> Schedules:
    """Return a small affine motion for each horizon, changing before, inside and after the stream."""
    start = int(events.t[0]) if len(events) else 0
    rows = int(rng.integers(1, 5))
    t_us = start + np.sort(rng.integers(-200, 800, rows))
    size = int(rng.choice([0, 1 << 12, 1 << 15]))
    tables = rng.integers(-size, size + 1, (len(config.horizons_us), rows, 6))
    tables[..., [2, 5]] *= 8
    return tuple(MotionSchedule(t_us, *part) for part in zip(tables, config.horizons_us, strict=True))


def decided(oracle: Any, events: Events, cuts: list[int] | None = None) -> tuple[Any, ...]:
    """Return decisions, sources, counts and what is pending after ``events``, cut at ``cuts``."""
    edges = [0, *sorted(min(cut, len(events)) for cut in cuts or []), len(events)]
    parts = [oracle.process(events[first:last]) for first, last in pairwise(edges)]
    columns = ([value for part in parts for value in getattr(part, name)] for name in ("suppressed", "source"))
    return (*columns, dict(oracle.counters), oracle.pending)


def run(config: CancelConfig, motion: Any, events: Events, cuts: list[int] | None = None) -> tuple[Any, ...]:
    return decided(SelectiveOracle(config, motion, width=events.width, height=events.height), events, cuts)


def case(seed: int, **fixed: Any) -> tuple[CancelConfig, Schedules, Events]:
    rng = np.random.default_rng(seed)
    events = stream(rng, int(rng.integers(1, 12)), int(rng.integers(1, 9)))
    config = selective(rng, **fixed)
    return config, motions(rng, config, events), events


def hits(*rows: tuple[int, int, int, int], motion: Any = STILL, **table: Any) -> list[int]:
    """Return the indices of the events ``(t, x, y, p)`` that are suppressed; a horizon of 100, gates of 10 and 0 px."""
    config = CancelConfig(**{"horizon_us": 100, "tolerance_us": 10, "tolerance_px": 0.0, **table})
    events = Events(*np.array(rows).T, 16, 16)
    oracle = OracleCanceller(config, motion, width=16, height=16)
    return np.flatnonzero(oracle.process(events).suppressed).tolist()


# Theorems


@settings(max_examples=200)
@given(
    seed=seeds,
    horizon_us=st.sampled_from([0, 1, 7, 40, 500]),
    tolerance_us=st.sampled_from([0, 1, 9, 60]),
    tolerance_px=st.sampled_from([0.0, 1.0, 1.5, 2.0, 5**0.5]),
    polarity=st.sampled_from(["opposite", "equal", "ignore"]),
    ring_capacity=st.sampled_from([1, 5, 500]),
    floats=st.booleans(),
)
def test_defaults_are_the_plain_rule(seed: int, floats: bool, **table: Any) -> None:
    config = CancelConfig(**table)
    rng = np.random.default_rng(seed)
    events = stream(rng, 9, 7)
    motion: Any = motions(rng, config, events)
    if floats:
        motion = RotationTrajectory.constant(center_px=(4.0, 3.0), omega_rad_s=float(rng.normal(0, 3000)))
    plain = decided(OracleCanceller(config, motion, width=9, height=7), events)
    assert run(config, motion, events) == plain


@settings(max_examples=150)
@given(seed=seeds)
def test_counters_balance_and_the_ring_keeps_its_bound(seed: int) -> None:
    config, motion, events = case(seed)
    suppressed, source, counts, pending = run(config, motion, events)
    made = counts["predicted"] + counts["outside"] + counts["overflow"] + counts["still"]
    assert made == counts["events"] == len(events)
    assert counts["suppressed"] == sum(suppressed)
    assert pending <= counts["ring_high_water"] <= min(config.ring_capacity, counts["predicted"])
    assert all(-1 < of < i if hit else of == -1 for i, (hit, of) in enumerate(zip(suppressed, source, strict=True)))
    if config.motion_at == "gate":
        assert counts["outside"] == counts["still"] == 0


@settings(max_examples=100)
@given(seed=seeds, cuts=st.lists(st.integers(0, 150), max_size=4))
def test_cuts_between_chunks_change_nothing(seed: int, cuts: list[int]) -> None:
    assert run(*case(seed), cuts) == run(*case(seed))


@settings(max_examples=100)
@given(seed=seeds)
def test_the_class_for_every_configuration_decides_the_same(seed: int) -> None:
    config, motion, events = case(seed)
    oracle = OracleCanceller(config, motion, width=events.width, height=events.height)
    assert decided(oracle, events) == run(config, motion, events)


@settings(max_examples=100)
@given(seed=seeds)
def test_support_out_of_reach_suppresses_nothing(seed: int) -> None:
    # A round adds at most one for each horizon, and lasts from an event to the opening of its first gate at least.
    config, motion, events = case(seed, least_shift_px=0.0)
    config = replace(config, carry=15, need=len(config.horizons_us) + 15)
    rounds = -(-config.need // len(config.horizons_us))
    reach = (config.horizon_us - config.early_gate_us) * rounds
    start = int(events.t[0]) >> config.tick_bits << config.tick_bits if len(events) else 0
    early = events.select(events.t < start + reach)
    assert not any(run(config, motion, early)[0])


def test_support_is_reached_in_as_many_rounds_as_it_needs() -> None:
    rows = [(100 * i, 5, 5, 1) for i in range(8)]
    for need in range(1, 5):
        assert hits(*rows, carry=3, need=need) == list(range(need, 8))


@settings(max_examples=60)
@given(seed=seeds, motion_at=st.sampled_from(["event", "gate"]))
def test_a_camera_at_rest_suppresses_nothing_above_a_least_shift(seed: int, motion_at: str) -> None:
    config, _, events = case(seed, least_shift_px=0.5, motion_at=motion_at)
    suppressed, _, counts, _ = run(config, STILL, events)
    assert not any(suppressed)
    assert counts["still"] == (len(events) if motion_at == "event" else 0)


@settings(max_examples=60)
@given(seed=seeds, motion_at=st.sampled_from(["event", "gate"]))
def test_an_unknown_motion_suppresses_nothing(seed: int, motion_at: str) -> None:
    config, _, events = case(seed, motion_at=motion_at)
    suppressed, _, counts, _ = run(config, MotionSchedule.unknown(), events)
    assert not any(suppressed)
    assert counts["outside"] == (len(events) if motion_at == "event" else 0)


@settings(max_examples=100)
@given(seed=seeds, one_set=st.booleans())
def test_sets_that_hold_every_bin_are_a_dense_table(seed: int, one_set: bool) -> None:
    config, motion, events = case(seed, set_bits=None)
    bins = [((side - 1) >> config.bin_bits) + 1 for side in (events.width, events.height)]
    if one_set and bins[0] * bins[1] <= 64:
        sets = replace(config, set_bits=(0, 0), ways=bins[0] * bins[1])
    else:
        sets = replace(config, set_bits=tuple((many - 1).bit_length() for many in bins), ways=1)
    assert run(sets, motion, events) == run(config, motion, events)


@settings(max_examples=60)
@given(seed=seeds)
def test_more_need_suppresses_no_first_event_more(seed: int) -> None:
    # Without consumption and without carrying on, support does not depend on what was suppressed.
    config, motion, events = case(seed, uses=0, carry=0, need=1)
    before = run(config, motion, events)[0]
    for need in range(2, len(config.horizons_us) + 1):
        after = run(replace(config, need=need), motion, events)[0]
        assert all(b or not a for a, b in zip(after, before, strict=True))
        before = after


# Each parameter by hand


@pytest.mark.parametrize(("uses", "expected"), [(1, [2]), (2, [2, 3]), (3, [2, 3]), (0, [2, 3, 4])])
def test_a_cell_bears_as_many_hits_as_predictions_were_written_up_to_uses(uses: int, expected: list[int]) -> None:
    rows = [(0, 5, 5, 1), (1, 5, 5, 1), *((100 + i, 5, 5, 1) for i in range(3))]
    assert hits(*rows, uses=uses) == expected


def test_a_latched_cell_closes_with_its_gate() -> None:
    assert hits((0, 5, 5, 1), (110, 5, 5, 1), (111, 5, 5, 1), uses=0) == [1]


def test_early_and_late_are_gates_of_their_own() -> None:
    rows = [(0, 5, 5, 1), (96, 5, 5, 1), (97, 5, 5, 1), (120, 5, 5, 1), (121, 5, 5, 1)]
    assert hits(*rows, uses=0, early_us=3, late_us=20) == [2, 3]


def test_two_horizons_must_agree_where_two_are_needed() -> None:
    rows = [(0, 5, 5, 1), (50, 5, 5, 1), (150, 5, 5, 1)]  # 150 is foretold by 50 over 100 and by 0 over 150
    assert hits(*rows, more_horizons_us=(150,), need=2) == [2]
    assert hits(*rows[1:], more_horizons_us=(150,), need=2) == []
    assert hits(rows[0], rows[2], more_horizons_us=(150,), need=1) == [1]


def test_agreement_is_counted_over_all_cells_of_the_window() -> None:
    shift = MotionSchedule(np.zeros(1), np.array([[0, 0, 1 << 16, 0, 0, 0]]), 150)  # type: ignore[arg-type]
    rows = [(0, 5, 5, 1), (50, 5, 5, 1), (150, 5, 5, 1)]
    two = {"more_horizons_us": (150,), "need": 2, "motion": (STILL, shift)}
    assert hits(*rows, **two, tolerance_px=1.0) == [2]
    assert hits(*rows, **two, tolerance_px=0.0) == []


def test_carried_support_counts_beside_the_horizon_that_agrees() -> None:
    rows = [(0, 5, 5, 1), (100, 5, 5, 1), (200, 5, 5, 1), (205, 5, 5, 0)]
    assert hits(*rows, carry=1, need=2) == [2]
    assert hits(*rows[1:], carry=1, need=2) == []


def test_no_more_than_carry_is_handed_on() -> None:
    rows = [(0, 5, 5, 1), (50, 5, 5, 1), (150, 5, 5, 1), (200, 9, 9, 1), (250, 5, 5, 1)]  # two agree on 150, one on 250
    assert hits(*rows, more_horizons_us=(150,), carry=1, need=3) == []
    assert hits(*rows, more_horizons_us=(150,), carry=2, need=3) == [4]


def test_a_cell_keeps_the_most_support_that_was_written_to_it() -> None:
    rows = [(0, 5, 5, 1), (100, 5, 5, 1), (115, 5, 5, 1), (207, 5, 5, 1)]  # 115 was not foretold, 100 was
    assert hits(*rows, carry=1, need=2) == [3]


def test_times_are_compared_in_ticks() -> None:
    rows = [(15, 5, 5, 1), (111, 5, 5, 1), (112, 5, 5, 1), (127, 5, 5, 1), (128, 5, 5, 1)]  # ticks 0, 6, 7, 7, 8
    assert hits(*rows, horizon_us=112, tolerance_us=0, tick_bits=4, uses=0) == [2, 3]
    before = [(t - 1600, *rest) for t, *rest in rows]
    assert hits(*before, horizon_us=112, tolerance_us=0, tick_bits=4, uses=0) == [2, 3]  # type: ignore[arg-type]


def test_a_bin_is_one_cell_for_its_pixels_and_is_looked_at_once() -> None:
    assert hits((0, 4, 4, 1), (100, 5, 5, 1), bin_bits=1) == [1]
    assert hits((0, 4, 4, 1), (100, 6, 5, 1), bin_bits=1) == []
    assert hits((0, 4, 4, 1), (100, 5, 5, 1), (100, 5, 5, 1), bin_bits=1, tolerance_px=1.0) == [1]


def test_a_full_set_gives_up_the_cell_that_is_due_first() -> None:
    rows = [(i, 1 + i, 1, 1) for i in range(4)] + [(105, 1 + i, 1, 1) for i in range(4)]
    assert hits(*rows, set_bits=(0, 0), ways=2) == [6, 7]
    assert hits(*rows, set_bits=(0, 0), ways=3) == [5, 6, 7]
    assert hits(*rows[:3], *rows[4:7], set_bits=(1, 0), ways=1) == [4, 5]  # columns 1 and 3 share a set


def test_motion_at_the_gate_is_that_of_its_opening() -> None:
    right = [0, 0, 3 << 16, 0, 0, 0]
    for changes_us, expected in ((89, [1]), (90, [1]), (91, [])):  # a gate at 100 − 10
        schedule = MotionSchedule(np.array([0, changes_us]), np.array([[0] * 6, right]))
        assert hits((0, 5, 5, 1), (100, 8, 5, 1), motion=schedule, motion_at="gate") == expected
        assert hits((0, 5, 5, 1), (100, 5, 5, 1), motion=schedule, uses=0) == [1]


def test_a_trajectory_serves_every_horizon_at_either_time() -> None:
    turn = RotationTrajectory.constant(center_px=(8.0, 8.0), omega_rad_s=np.pi / 2 / 100e-6)  # 90° in 100 µs
    rows = [(0, 12, 8, 1), (100, 8, 12, 1), (200, 4, 8, 1)]
    for motion_at in ("event", "gate"):
        two = {"more_horizons_us": (200,), "motion_at": motion_at, "motion": turn}
        assert hits(*rows, **two, need=2) == [2]
        assert hits(*rows, **two, need=1) == [1, 2]


def test_an_entry_is_held_until_the_longest_horizon_has_passed_it() -> None:
    config = CancelConfig(horizon_us=100, more_horizons_us=(200,), tolerance_us=10, ring_capacity=1, need=1)
    oracle = SelectiveOracle(config, STILL, width=4, height=4)
    for t, pending, overflow in ((0, 1, 0), (150, 1, 1), (189, 1, 2), (190, 1, 2)):
        oracle.process(Events([t], [1], [1], [1], 4, 4))
        assert (oracle.pending, oracle.counters.overflow) == (pending, overflow)
    assert oracle.counters.predicted == 2


def test_outside_goes_before_still_and_one_prediction_is_enough() -> None:
    far = MotionSchedule(np.zeros(1), np.array([[0, 0, 99 << 16, 0, 0, 0]]))  # type: ignore[arg-type]
    near = MotionSchedule(np.zeros(1), np.array([[0, 0, 2 << 16, 0, 0, 0]]))  # type: ignore[arg-type]
    config = CancelConfig(horizon_us=100, more_horizons_us=(200,), tolerance_us=10, least_shift_px=1.0)
    one = Events([0], [1], [1], [1], 8, 8)
    for motion, counted in (
        ((STILL, STILL), "still"),
        ((STILL, far), "outside"),
        ((far, far), "outside"),
        ((STILL, near), "predicted"),
        ((far, near), "predicted"),
    ):
        assert run(config, motion, one)[2][counted] == 1


def along(px: int) -> MotionSchedule:
    """Return a motion that moves every event so many px to the right."""
    return MotionSchedule(np.zeros(1), np.array([[0, 0, px << 16, 0, 0, 0]]))  # type: ignore[arg-type]


def test_an_event_chooses_the_shortest_horizon_that_moves_it_far_enough() -> None:
    rows = [(0, 5, 5, 1), (100, 6, 5, 1), (150, 8, 5, 1), (200, 9, 5, 1)]  # where 1, 3 and 4 px put it
    three = {"more_horizons_us": (150, 200), "motion": (along(1), along(3), along(4)), "uses": 0}
    for choose_px, expected in ((0.0, [1, 2, 3]), (1.0, [1]), (1.5, [2]), (3.0, [2]), (3.5, [3]), (9.0, [3])):
        assert hits(*rows[:1], *rows[1:], choose_px=choose_px, **three) == expected


def test_a_ring_that_is_full_leaves_the_other_horizons_theirs() -> None:
    config = CancelConfig(
        horizon_us=100, more_horizons_us=(200,), tolerance_us=10, choose_px=2.0,
        ring_capacity=1, more_ring_capacities=(2,),
    )  # fmt: skip
    grows = MotionSchedule(np.zeros(1), np.array([[1 << 15, 0, 0, 0, 0, 0]]))  # type: ignore[arg-type]
    oracle = SelectiveOracle(config, (grows, grows), width=16, height=16)
    # x' = 1.5 x: from x = 4 on the first horizon is far enough.
    oracle.process(Events([0, 0, 0, 0, 0, 1], [1, 5, 5, 2, 2, 9], [3] * 6, [1] * 6, 16, 16))
    assert (oracle.pending, oracle.most_held) == (3, (1, 2))
    assert (oracle.counters.predicted, oracle.counters.overflow) == (3, 3)
    oracle.process(Events([90], [5], [3], [1], 16, 16))  # the first ring's entry has left, this one has come
    assert (oracle.pending, oracle.counters.ring_high_water) == (3, 3)


def test_a_gate_that_spreads_is_wider_where_the_shift_is() -> None:
    # Over a horizon of 100 µs the gate is a quarter of the shift: 1 px from a shift of 4 px on.
    for px, expected in ((3, []), (4, [1])):
        for beside in ((px + 1, 0), (px, 1)):
            rows = [(0, 2, 5, 1), (100, 2 + beside[0], 5 + beside[1], 1)]
            assert hits(*rows, motion=along(px), tolerance_px=1.0, spread_us=25) == expected
            assert hits(*rows, motion=along(px), tolerance_px=1.0) == [1]
            assert hits(*rows, motion=along(px), tolerance_px=0.0, spread_us=25) == []


def test_an_event_must_have_moved_on_by_as_much_as_it_is_late() -> None:
    # 10 px in 100 µs: a tenth of a pixel a µs. The prediction stands at x = 12 for t = 100.
    table: dict[str, Any] = {"motion": along(10), "tolerance_px": 2.0, "uses": 0, "line_px": 0.5}
    first = (0, 2, 5, 1)
    assert hits(first, *((t, 12, 5, 1) for t in (94, 95, 100, 105, 106)), **table) == [2, 3, 4]
    assert hits(first, *((t, 13, 5, 1) for t in (104, 105, 110)), **table) == [2, 3]
    assert hits(first, *((t, 11, 5, 1) for t in (90, 95, 96)), **table) == [1, 2]
    assert hits(first, (100, 12, 6, 1), **table) == []
    assert hits(first, (100, 12, 6, 1), **{**table, "line_px": 1.0}) == [1]


@pytest.mark.parametrize(("bits", "expected"), [(0, [1, 2]), (1, [1]), (2, [1]), (3, [1])])
def test_bits_below_the_pixel_tell_where_in_it_the_prediction_stands(bits: int, expected: list[int]) -> None:
    quarter = MotionSchedule(np.zeros(1), np.array([[0, 0, (10 << 16) + (1 << 14), 0, 0, 0]]))  # type: ignore[arg-type]
    rows = [(0, 2, 5, 1), (100, 12, 5, 1), (100, 11, 5, 1)]  # 0.25 px before and 1.25 px behind 12.25
    assert hits(*rows, motion=quarter, tolerance_px=1.0, uses=0, line_px=1.1, fraction_bits=bits) == expected


def test_a_line_needs_a_schedule() -> None:
    turn = RotationTrajectory.constant(center_px=(8.0, 8.0), omega_rad_s=3.0)
    with pytest.raises(ValueError, match="line_px needs a schedule"):
        hits((0, 5, 5, 1), (100, 5, 5, 1), motion=turn, line_px=1.0)


def test_off_predictions_have_gates_of_their_own() -> None:
    gates: dict[str, Any] = {"early_us": 3, "late_us": 20, "off_late_us": 5, "uses": 0}
    for p, expected in ((1, [2, 3, 4]), (0, [2, 3])):
        assert hits(*((t, 5, 5, p) for t in (0, 96, 97, 105, 120)), **gates) == expected
    beside = [(0, 5, 5, 1), (0, 9, 5, 0), (100, 6, 5, 1), (100, 10, 5, 0)]
    assert hits(*beside, tolerance_px=1.0, off_tolerance_px=0.0) == [2]
    assert hits(*beside, tolerance_px=0.0, off_tolerance_px=1.0) == [3]
    # With "equal" an ON event meets OFF predictions, and their gate.
    across = [(0, 5, 5, 0), (100, 6, 5, 1)]
    assert hits(*across, polarity="equal", tolerance_px=0.0, off_tolerance_px=1.0) == [1]


@settings(max_examples=100)
@given(seed=seeds)
def test_a_window_always_open_and_gates_written_twice_change_nothing(seed: int) -> None:
    config, motion, events = case(seed)
    same = {
        "off_late_us": config.late_gate_us,
        "off_tolerance_px": config.tolerance_px,
        "spread_px": config.tolerance_px,
        "line_px": 64.0,
    }
    assert run(replace(config, **same), motion, events) == run(config, motion, events)


def test_the_source_is_the_event_whose_prediction_was_written_last() -> None:
    config = CancelConfig(horizon_us=100, tolerance_us=10, tolerance_px=0.0, uses=2, more_horizons_us=(150,))
    oracle = SelectiveOracle(config, STILL, width=8, height=8)
    decisions = oracle.process(Events([0, 50, 51, 150], [1, 1, 1, 1], [1, 1, 1, 1], [1, 1, 1, 1], 8, 8))
    assert decisions.source is not None
    assert decisions.horizon is not None
    assert decisions.source.tolist() == [-1, -1, -1, 0]  # 0 over 150 comes after 50 and 51 over 100
    assert decisions.horizon.tolist() == [0, 0, 0, 1]
