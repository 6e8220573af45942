"""One pass of an estimator: what came is counted and kept, whatever ends it."""

from __future__ import annotations

import json
import math
import os
import signal
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from tiegocancel import Events, InputError, RotationTrajectory
from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.study.estimation_run import EstimationResult, estimate_stream


def row(t_us: int, omega: float = 13.0, **given: Any) -> MotionEstimate:
    return MotionEstimate(t_us=t_us, **{"center_px": (80.0, 60.0), "omega_rad_s": omega, **given})


def result(*rows: MotionEstimate, fault: str | None = None) -> EstimationResult:
    return EstimationResult(estimates=rows, events=1000, duration_s=0.5, seconds=0.25, fault=fault)


def test_events_time_and_rows_are_counted_and_the_sink_takes_rows_as_they_come(markers: Events, scripted: Any) -> None:
    taken: list[int] = []
    seen: list[int] = []
    found = estimate_stream(
        [markers[:100], markers[100:]],
        scripted([row(1_000), row(50_000), row(95_000)]),
        sink=lambda rows: taken.extend(r.t_us for r in rows),
        progress=lambda chunk: seen.append(len(chunk)),
    )
    assert found.events == sum(seen) == len(markers)
    assert found.duration_s == pytest.approx((markers.t[-1] - markers.t[0]) * 1e-6)
    assert taken == [r.t_us for r in found.estimates] == [1_000, 50_000]
    assert found.fault is None


def test_a_stream_without_events_has_no_rows(scripted: Any) -> None:
    found = estimate_stream([], scripted([row(0)]))
    assert (found.events, found.estimates, found.duration_s) == (0, (), 0.0)
    assert found.trajectory(source="s") is None
    assert "0 of them confident" in found.text()


def test_a_fault_keeps_the_rows_before_it(markers: Events, scripted: Any) -> None:
    def torn() -> Iterator[Events]:
        yield markers[:500]
        raise InputError("f.raw", "byte 12", "the file ends inside a word")

    found = estimate_stream(torn(), scripted([row(1_000), row(80_000)]))
    assert found.fault == "f.raw: byte 12: the file ends inside a word"
    assert (found.events, len(found.estimates), found.interrupted) == (500, 1, False)

    def broken() -> Iterator[Events]:
        raise InputError("f.raw", "byte 0", "no recording")
        yield markers

    with pytest.raises(InputError, match="no recording"):
        estimate_stream(broken(), scripted([]))


def test_an_interrupt_keeps_the_rows_before_it(markers: Events, scripted: Any) -> None:
    def asked() -> Iterator[Events]:
        yield markers[:500]
        os.kill(os.getpid(), signal.SIGINT)
        yield markers[500:]

    found = estimate_stream(asked(), scripted([row(1_000)]))
    assert found.interrupted
    assert len(found.estimates) == 1


def test_the_trajectory_is_causal_and_leaves_unknown_centres_out() -> None:
    unknown = row(0, center_px=(math.nan, math.nan))
    motion = result(unknown, row(10), row(20, 14.0)).trajectory(source="rows")
    assert motion is not None
    assert (motion.t_us.tolist(), motion.interpolation, motion.source) == ([10, 20], "causal", "rows")
    assert result(unknown).trajectory(source="rows") is None


def test_errors_are_of_confident_rows_and_relative_to_the_truth() -> None:
    truth = RotationTrajectory(
        t_us=np.array([0, 100]), center_px=np.array([[80.0, 60.0]] * 2), omega_rad_s=np.array([10.0, 20.0])
    )
    found = result(
        row(0, 10.1), row(50, 15.3, center_px=(83.0, 64.0)), row(100, 99.0, confident=False, doubt="dark (σ 3)")
    )
    errors = found.summary(truth)["errors"]
    assert errors["omega_share_max"] == pytest.approx(0.02)
    assert errors["omega_share_median"] == errors["omega_bias_share"] == pytest.approx(0.015)
    assert (errors["center_px_median"], errors["center_px_max"]) == (2.5, 5.0)
    text = found.text(truth)
    assert "rows         3, 2 of them confident" in text
    assert "|Δω|/|ω| median 1.50%" in text
    assert "1 ×: dark\n" in text
    assert "errors" not in found.summary()
    assert "errors" not in result(row(0, confident=False)).summary(truth)


def test_doubts_that_differ_in_numbers_alone_are_counted_together() -> None:
    doubts = [
        "no rim: 45% of the events lie near",
        "no rim: 46.5% of the events lie near",
        "only 3 events in the window",
    ]
    found = result(*(row(t, confident=False, doubt=doubt) for t, doubt in enumerate([*doubts, "", doubts[0]])))
    assert found.summary()["doubts"] == {
        "no rim: …% of the events lie near": 3, "too few events in the window": 1,
    }  # fmt: skip


def test_the_summary_is_valid_json_even_of_rows_that_know_little() -> None:
    found = result(row(0), row(1, omega_sigma_rad_s=math.inf))
    numbers = json.loads(json.dumps(found.summary(), allow_nan=False))
    assert numbers["median"] == {"center_px": [80.0, 60.0], "omega_rad_s": 13.0, "sharpness": None}
    assert numbers["updates_per_second"] == 8.0


def test_the_pace_is_that_after_the_first_confident_row(markers: Events, scripted: Any) -> None:
    rows = [row(1_000, confident=False), row(30_000), row(60_000), row(95_000)]
    found = estimate_stream([markers], scripted(rows[:3]))
    assert found.begun == (3, found.seconds)
    assert found.updates_per_second is None
    assert "to compile and begin" in found.text()
    paced = EstimationResult(estimates=tuple(rows), events=9, duration_s=0.1, seconds=0.75, fault=None, begun=(2, 0.25))
    assert paced.updates_per_second == pytest.approx(4.0)
    assert paced.summary()["updates_per_second"] == pytest.approx(4.0)
    assert "4 updates/s, after 0.25 s to compile and begin" in paced.text()


def test_a_stream_too_short_for_a_row_says_what_to_do(markers: Events, scripted: Any) -> None:
    assert "too short for a row: --step-us" in estimate_stream([markers], scripted([])).text()
