"""A motion that is found on the way decides as if it had been known, causally, whatever the chunks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import CancelConfig, Canceller, ConfigError, Events, MotionSchedule, RotationTrajectory
from tiegocancel.estimation.estimate import MotionEstimate, trajectory_of
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.motion.affine import AffineTrajectory
from tiegocancel.motion.schedule import turn_coefficients
from tiegocancel.motion.schedule_file import read_schedule, write_schedule
from tiegocancel.study import RunResult, Settings, run_stream
from tiegocancel.study import controls as controls_module
from tiegocancel.study.feed import FixedMotion, MotionFeed, ScheduledMotion, TrackedMotion, fixed_schedule
from tiegocancel.study.settings import MotionSettings, ReportSettings

CENTER = (80.0, 60.0)
CANCEL = CancelConfig(horizon_us=12_000)
PIXEL = st.integers(0, 1279)


class Kept:
    """Keep the residual events."""

    def __init__(self) -> None:
        self.parts: list[Events] = []

    def write(self, events: Events) -> None:
        """Take some."""
        self.parts.append(events)

    def columns(self) -> list[list[int]]:
        """Return all of them as plain lists."""
        whole = Events.concatenate(self.parts)
        return [whole.t.tolist(), whole.x.tolist(), whole.y.tolist(), whole.p.tolist()]


def row(t_us: int, omega: float, *, slope: float = 0.0, center: tuple[float, float] = CENTER) -> MotionEstimate:
    return MotionEstimate(t_us=t_us, center_px=center, omega_rad_s=omega, omega_dot_rad_s2=slope)


def true_rows(step_us: int = 5_000, first_us: int = 5_000) -> list[MotionEstimate]:
    """Rows that know the motion of the markers."""
    return [row(t, 10.0 + 80.0 * t * 1e-6, slope=80.0) for t in range(first_us, 90_000, step_us)]


def decided(
    events: Events, feed: MotionFeed | RotationTrajectory, chunk: int = 1 << 19, **motion: Any
) -> tuple[list[list[int]], RunResult]:
    """Run a stream; return what remains of it, and the result."""
    wanted = Settings(
        cancel=CANCEL,
        motion=MotionSettings(**motion),
        report=ReportSettings(chunk_events=chunk, disc_radius_px=54.0, diagnose=False),
    )
    kept = Kept()
    result = run_stream([events], wanted, feed, sink=kept)
    assert result is not None
    return kept.columns(), result


def shares(result: RunResult) -> dict[str, float]:
    return {name: tally.share().ratio for name, tally in result.controls.items()} | {
        "motion": result.tally.share().ratio
    }


def test_before_the_first_row_nothing_is_suppressed(markers: Events, scripted: Any) -> None:
    feed = TrackedMotion(scripted(true_rows(first_us=40_000)))
    residual, result = decided(markers, feed, chunk=500)
    first_us = 40_000 + CANCEL.horizon_us - CANCEL.tolerance_us
    before = int((markers.t < first_us).sum())
    assert residual[0][:before] == markers.t[:before].tolist()
    assert result.counters.suppressed > 0.5 * (markers.t > first_us + 2_000).sum()
    assert any("known from 0.040 s after the first event on; nothing before" in note for note in result.notes)


def test_without_any_row_nothing_is_suppressed_and_that_is_told(markers: Events, scripted: Any) -> None:
    lost = MotionEstimate(t_us=9_000, center_px=(math.nan, math.nan), omega_rad_s=0.0, confident=False, doubt="dark")
    residual, result = decided(markers, TrackedMotion(scripted([lost])))
    assert len(residual[0]) == len(markers)
    assert result.trajectory.source == "none found"
    assert any("no motion was found" in note for note in result.notes)
    assert result.to_json()["motion"]["estimates_confident"] == 0


@settings(max_examples=40)
@given(
    times=st.lists(st.integers(-5_000, 100_000), min_size=1, max_size=12, unique=True).map(sorted),
    omegas=st.lists(st.floats(-30, 30), min_size=12, max_size=12),
    slopes=st.lists(st.floats(-2_000, 2_000), min_size=12, max_size=12),
    chunk=st.sampled_from([61, 700, 5_000, 1 << 19]),
)
def test_a_run_decides_as_one_canceller_with_the_schedule_of_all_rows(
    markers: Events, scripted: Any, times: list[int], omegas: list[float], slopes: list[float], chunk: int
) -> None:
    rows = [row(t, omega, slope=slope) for t, omega, slope in zip(times, omegas, slopes, strict=False)]
    trajectory = trajectory_of(rows, source="all rows")
    last_us = int(markers.t[-1])
    known = trajectory.schedule(CANCEL.horizon_us, stop_us=max(last_us, times[0]))
    start = MotionSchedule.unknown(min(-6_000, times[0] - 1))
    whole = MotionSchedule(
        np.append(start.t_us, known.t_us), np.vstack([start.coefficients, known.coefficients]), CANCEL.horizon_us
    )
    canceller = Canceller(CANCEL, whole, width=160, height=120)
    left = markers.select(~canceller.process(markers).suppressed)
    expected = [left.t.tolist(), left.x.tolist(), left.y.tolist(), left.p.tolist()]
    residual, result = decided(markers, TrackedMotion(scripted(rows)), chunk, hold_us=0)
    assert residual == expected
    assert dict(result.counters) == dict(canceller.counters)
    assert decided(markers, trajectory)[0] == expected  # the rows read back from a file


def unknown_at(feed: TrackedMotion, t_us: int, start_us: int, stop_us: int) -> bool:
    """Tell whether an event of a time predicts nothing, by the schedule of a span."""
    schedule = feed.schedule(CANCEL.horizon_us, start_us=start_us, stop_us=stop_us, step_us=1000)
    at = np.array([t_us], np.int64)
    ahead_x, _ = schedule.predict(at, np.array([100], np.uint16), np.array([60], np.uint16))
    return int(ahead_x[0]) > 65_535


@settings(max_examples=60)
@given(
    times=st.lists(st.integers(0, 89_000), min_size=1, max_size=10, unique=True).map(sorted),
    sure=st.lists(st.booleans(), min_size=10, max_size=10),
    hold_us=st.integers(1, 40_000),
    span=st.tuples(st.integers(0, 89_000), st.integers(0, 89_000)).map(sorted),
    share=st.floats(0, 1),
)
def test_a_motion_is_known_for_as_long_as_a_confident_row_is_recent(
    markers: Events,
    scripted: Any,
    times: list[int],
    sure: list[bool],
    hold_us: int,
    span: list[int],
    share: float,
) -> None:
    """Whatever span the schedule is asked for: nothing after a time changes what holds at it."""
    rows = [replace(row(t, 9.0), confident=yes) for t, yes in zip(times, sure, strict=False)]
    feed = TrackedMotion(scripted(rows))
    feed.hold_us = hold_us
    feed.advance(markers)
    start_us, stop_us = span
    for t_us in (start_us, stop_us, start_us + int(share * (stop_us - start_us)), *times):
        if start_us <= t_us <= stop_us:
            recent = any(r.confident and r.t_us <= t_us <= r.t_us + hold_us for r in rows)
            assert unknown_at(feed, t_us, start_us, stop_us) is not recent


@pytest.mark.parametrize("chunk", [50, 700, 1 << 19])
def test_a_motion_in_doubt_stops_suppressing_and_goes_on_by_itself(markers: Events, scripted: Any, chunk: int) -> None:
    rows = [replace(r, confident=not 20_000 < r.t_us < 60_000) for r in true_rows()]
    residual, result = decided(markers, TrackedMotion(scripted(rows)), chunk, hold_us=10_000)
    left = np.bincount(np.array(residual[0]) // 1000, minlength=90)
    suppressed = np.bincount(markers.t // 1000, minlength=90) - left
    # What was predicted until 30 ms still falls due; what is predicted from 60 ms on falls due 12 ms later.
    assert suppressed[44:71].sum() == 0
    assert suppressed[20:41].min() > 0
    assert suppressed[74:89].min() > 0
    assert result.controls["reversed_motion"].share().ratio < 0.2
    assert residual == decided(markers, TrackedMotion(scripted(rows)), hold_us=10_000)[0]


def test_a_camera_at_rest_suppresses_nothing(markers: Events, scripted: Any) -> None:
    """Ten events a pixel at one place would all meet "same place"."""
    at = np.repeat(np.arange(0, 90_000, 1000), 3)
    events = Events(at, np.tile([3, 80, 150], 90), np.full(270, 60), np.ones(270, int), 160, 120)
    rows = [row(t, 1e-4) for t in range(0, 90_000, 5_000)]
    assert len(decided(events, TrackedMotion(scripted(rows)))[0][0]) == len(events)
    assert len(decided(events, TrackedMotion(scripted(rows)), hold_us=0)[0][0]) < len(events) / 2
    barely = [row(t, 0.6) for t in range(0, 90_000, 5_000)]  # half a pixel at 80 px and 12 ms is 0.52 rad/s
    assert len(decided(events, TrackedMotion(scripted(barely)))[0][0]) < len(events) / 2


def test_the_plain_model_decides_the_same(markers: Events, scripted: Any) -> None:
    few = markers[:1500]
    rows = true_rows(step_us=3_000, first_us=2_000)
    oracle = OracleCanceller(CANCEL, MotionSchedule.unknown(), width=160, height=120)
    feed, suppressed = TrackedMotion(scripted(rows)), []
    for first in range(0, len(few), 37):
        chunk = few[first : first + 37]
        feed.advance(chunk)
        span = {"start_us": int(chunk.t[0]), "stop_us": int(chunk.t[-1]), "step_us": 1000}
        oracle.motion = feed.schedule(CANCEL.horizon_us, **span)
        suppressed.append(oracle.process(chunk).suppressed)
    left = few.select(~np.concatenate(suppressed))
    assert 0 < len(left) < len(few)
    assert decided(few, TrackedMotion(scripted(rows)), chunk=400)[0][:3] == [
        left.t.tolist(), left.x.tolist(), left.y.tolist(),
    ]  # fmt: skip


@pytest.mark.parametrize("chunk", [13, 97, 1_000])
def test_chunks_change_no_number(markers: Events, scripted: Any, chunk: int) -> None:
    def numbers(size: int) -> dict[str, Any]:
        wanted = Settings(cancel=CANCEL, report=ReportSettings(chunk_events=size))  # the disc is guessed
        result = run_stream([markers], wanted, TrackedMotion(scripted(true_rows())))
        assert result is not None
        return result.to_json() | {"seconds": 0, "events_per_second": 0}

    assert numbers(chunk) == numbers(1 << 19)


def test_the_disc_is_told_by_the_same_events_whatever_the_chunks(markers: Events) -> None:
    """The centre moves: a mean over a first chunk would move with the chunk."""
    moving = RotationTrajectory(
        t_us=np.array([0, 90_000]), center_px=np.array([CENTER, (100.0, 70.0)]), omega_rad_s=np.array([10.0, 17.0])
    )
    centers = set()
    for size in (50, 3_000, 1 << 19):
        result = run_stream([markers], Settings(cancel=CANCEL, report=ReportSettings(chunk_events=size)), moving)
        assert result is not None
        centers.add(result.region.center_px)
    assert len(centers) == 1


def test_controls_run_under_the_motions_they_name(
    markers: Events, scripted: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The shuffle holds events back over many rows, and must not decide them with later ones."""
    monkeypatch.setattr(controls_module, "SHUFFLE_BLOCK", 4_000)
    rows = true_rows()
    trajectory = trajectory_of(rows, source="all rows")
    found = shares(decided(markers, TrackedMotion(scripted(rows)), chunk=150)[1])
    assert found == shares(decided(markers, trajectory)[1])
    assert found["motion"] > 0.6 > 2 * max(found[name] for name in found if name != "motion")
    backwards = shares(decided(markers, trajectory.reversed())[1])
    assert (backwards["motion"], backwards["reversed_motion"]) == (found["reversed_motion"], found["motion"])
    still = decided(markers, FixedMotion(RotationTrajectory.constant(center_px=CENTER, omega_rad_s=0.0)))[1]
    assert still.tally.share().ratio == found["zero_motion"]


def test_a_sink_takes_every_row_in_time(markers: Events, scripted: Any) -> None:
    taken: list[list[int]] = []
    feed = TrackedMotion(scripted(true_rows()))
    feed.sink = lambda rows: taken.append([r.t_us for r in rows])
    decided(markers, feed, chunk=1000)
    assert [t for times in taken for t in times] == [r.t_us for r in true_rows()] == [r.t_us for r in feed.estimates]


def test_remarks_on_the_estimator_reach_the_user(markers: Events, scripted: Any) -> None:
    feed = TrackedMotion(scripted(true_rows()), notes=["the axes are guessed"])
    assert "the axes are guessed" in decided(markers, feed)[1].trajectory.notes


@pytest.mark.parametrize("kind", ["constant", "linear", "causal"])
def test_a_schedule_file_decides_as_the_motion_that_made_it(markers: Events, tmp_path: Any, kind: str) -> None:
    motions = {
        "constant": RotationTrajectory.constant(center_px=CENTER, omega_rad_s=13.0),
        "linear": RotationTrajectory(
            t_us=np.array([0, 40_000, 90_000]), center_px=np.array([CENTER] * 3), omega_rad_s=np.array([10, 13.2, 17.2])
        ),
        "causal": trajectory_of(true_rows(first_us=0, step_us=9_000), source="rows"),
    }
    motion = motions[kind]
    write_schedule(fixed_schedule(motion, CANCEL.horizon_us, 0, 1000), tmp_path / "m.schedule")
    feed = ScheduledMotion(read_schedule(tmp_path / "m.schedule"), CANCEL.horizon_us, source="m.schedule")
    residual, result = decided(markers, feed)
    expected, reference = decided(markers, motion)
    assert residual == expected
    assert shares(result) == pytest.approx(shares(reference), abs=0.02)  # the inverse of rounded numbers is rounded
    assert shares(result)["motion"] > 0.5
    # A schedule tells the mean over the horizon: half of 80 rad/s² · 12 ms more than ω at its beginning.
    assert result.omega_rad_s == pytest.approx(reference.omega_rad_s, abs=0.6)


@given(cx=st.floats(-300, 1600), cy=st.floats(-300, 1000), theta=st.floats(-1, 1), x=PIXEL, y=PIXEL)
def test_a_schedule_run_backwards_takes_a_point_back(cx: float, cy: float, theta: float, x: int, y: int) -> None:
    there = MotionSchedule(np.zeros(1, np.int64), turn_coefficients(cx, cy, theta)[None], 8_000)
    feed = ScheduledMotion(there, 8_000, source="s")
    back = feed.backwards(8_000, start_us=0, stop_us=0, step_us=1)
    inverse = turn_coefficients(cx, cy, -theta)
    # Half of 2^-16 on each coefficient, times a coordinate, at most doubled by the inverse.
    assert np.abs(back.coefficients[0] - inverse).max() <= 4 * (abs(cx) + abs(cy) + 2_000)
    ahead = back.predict(np.zeros(1, np.int64), np.array([x], np.uint16), np.array([y], np.uint16))
    exact = MotionSchedule(np.zeros(1, np.int64), inverse[None]).predict(
        np.zeros(1, np.int64), np.array([x], np.uint16), np.array([y], np.uint16)
    )
    assert abs(int(ahead[0][0]) - int(exact[0][0])) <= 1
    assert abs(int(ahead[1][0]) - int(exact[1][0])) <= 1


@pytest.mark.parametrize("entry", [[-65_536, 0, 0, 0, 0, 0], [-65_535, 0, 1 << 40, 0, 0, 0]])
def test_a_schedule_that_cannot_be_run_backwards_is_refused(entry: list[int]) -> None:
    with pytest.raises(ValueError, match=r"inverse|too far"):
        ScheduledMotion(MotionSchedule(np.zeros(1, np.int64), np.array([entry])), 8_000, source="s")


def test_an_unknown_entry_of_a_schedule_predicts_nothing_either_way() -> None:
    feed = ScheduledMotion(MotionSchedule.unknown(), 8_000, source="s")
    x = np.array([0, 159], np.uint16)
    span = {"start_us": 0, "stop_us": 9, "step_us": 1}
    for schedule in (feed.schedule(8_000, **span), feed.backwards(8_000, **span)):
        ahead_x, ahead_y = schedule.predict(np.zeros(2, np.int64), x, x)
        assert ((ahead_x < 0) | (ahead_x > 65_535)).all()
        assert ((ahead_y < 0) | (ahead_y > 65_535)).all()
    assert isinstance(feed.trajectory, AffineTrajectory)


def test_a_causal_motion_is_carried_on_after_its_last_row() -> None:
    schedule = fixed_schedule(trajectory_of([row(0, 1.0, slope=50.0)], source="one"), 10_000, 0, 1000)
    sines = schedule.coefficients[:, 3] / 65_536
    assert sines[0] == pytest.approx(math.sin(0.01 * (1.0 + 50.0 * 0.005)), abs=1e-4)
    assert sines[49] > sines[0]
    assert schedule.t_us[-1] >= 50_000
    steady = fixed_schedule(RotationTrajectory.constant(center_px=CENTER, omega_rad_s=1.0), 10_000, 0, 1000)
    assert len(steady) == 1


def test_a_schedule_of_too_many_entries_is_refused_by_name() -> None:
    long = RotationTrajectory(
        t_us=np.array([0, 10_000_000_000]), center_px=np.array([CENTER] * 2), omega_rad_s=np.array([1.0, 2.0])
    )
    with pytest.raises(ConfigError, match="--schedule-step-us longer than 1000"):
        fixed_schedule(long, 10_000, 0, 1000)


def test_the_float_path_is_refused_for_a_motion_found_on_the_way(markers: Events, scripted: Any) -> None:
    with pytest.raises(ConfigError, match="--motion-path float"):
        decided(markers, TrackedMotion(scripted(true_rows())), path="float")
