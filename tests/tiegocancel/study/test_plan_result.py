"""The front rises, the knee lies on it, the choice keeps within its limits."""

from __future__ import annotations

import itertools
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import CancelConfig
from tiegocancel.study.plan_candidates import Pace
from tiegocancel.study.plan_result import PlanLimits, PlanResult, front_of, knee_of
from tiegocancel.study.plan_trial import Trial


def trial(name: str, *, kib: float, ego: float, mover: float = 0.0, zero: float = 0.0, reads: int = 3) -> Trial:
    config = CancelConfig(horizon_us=10_000)
    return Trial(
        name=name, config=config, ego=ego, mover=mover, zero=zero, reversed=0.0, high_water=9, kib=kib, reads=reads
    )


def result(*trials: Trial, limits: PlanLimits | None = None) -> PlanResult:
    pace = Pace(us_per_px=1000.0, rate_hz=1e6)
    return PlanResult(
        trials=trials, references=(), limits=limits or PlanLimits(), pace=pace, dropped=0, cold=0, injected=False
    )


SMALL = trial("small", kib=50.0, ego=0.90, reads=1)
MIDDLE = trial("middle", kib=100.0, ego=0.97, mover=0.01)
LARGE = trial("large", kib=1000.0, ego=0.98, mover=0.004, reads=9)


def test_the_score_takes_off_the_worst_of_what_must_not_be_suppressed() -> None:
    assert trial("t", kib=1.0, ego=0.9, mover=0.1, zero=0.3).score == pytest.approx(0.6)
    assert trial("t", kib=1.0, ego=0.9, mover=0.1, zero=0.3).selectivity == pytest.approx(0.8)


@given(st.lists(st.tuples(st.floats(1, 1e4), st.floats(0, 1)), min_size=1, max_size=30))
def test_nothing_is_smaller_and_better_than_the_front(points: list[tuple[float, float]]) -> None:
    trials = [trial(str(n), kib=kib, ego=ego) for n, (kib, ego) in enumerate(points)]
    front = front_of(trials)
    for one in trials:
        assert any(other.kib <= one.kib and other.score >= one.score for other in front)
    assert all(a.kib < b.kib and a.score < b.score for a, b in itertools.pairwise(front))
    assert knee_of(front) in front


def test_the_tighter_bound_of_memory_counts() -> None:
    assert PlanLimits().most_kib is None
    assert PlanLimits(max_kib=100.0, target_kib=264.0).most_kib == 100.0
    both = PlanLimits(max_kib=500.0, target="a part", target_kib=60.0)
    assert result(SMALL, MIDDLE, limits=both).chosen is SMALL


def test_the_knee_is_where_more_memory_stops_paying() -> None:
    assert knee_of(front_of([trial("bare", kib=40.0, ego=0.3), SMALL, MIDDLE, LARGE])) is SMALL


@pytest.mark.parametrize(
    ("limits", "chosen"),
    [
        (PlanLimits(), LARGE),
        (PlanLimits(max_kib=500.0), MIDDLE),
        (PlanLimits(max_reads=1), SMALL),
        (PlanLimits(max_loss=0.001), SMALL),
        (PlanLimits(max_kib=10.0), None),
    ],
)
def test_the_choice_is_the_best_within_the_limits(limits: PlanLimits, chosen: Trial | None) -> None:
    assert result(SMALL, MIDDLE, LARGE, limits=limits).chosen is chosen


def test_the_smallest_is_near_the_choice_and_within_the_limits() -> None:
    assert result(SMALL, MIDDLE, LARGE).smallest is MIDDLE
    assert result(SMALL, MIDDLE, LARGE, limits=PlanLimits(max_loss=0.005)).smallest is LARGE


def test_a_gate_that_holds_a_period_of_lamps_is_told() -> None:
    note = result(MIDDLE).flicker_note()
    assert note is not None
    assert "the horizon of 10 ms holds 10.0 ms" in note


def test_the_result_is_json() -> None:
    numbers = json.loads(json.dumps(result(SMALL, LARGE).to_json()))
    assert numbers["chosen"]["name"] == "large"
    assert numbers["front"] == ["small", "large"]


@pytest.mark.parametrize(
    ("values", "message"),
    [({"max_kib": 0.0}, "max_kib must be positive"), ({"max_loss": 1.5}, "max_loss must be from 0 to 1, not 1.5")],
)
def test_limits_that_allow_nothing_are_refused(values: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        PlanLimits(**values)  # type: ignore[arg-type]
