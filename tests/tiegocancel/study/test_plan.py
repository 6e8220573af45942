"""A search on a small turning disc finds what tells ego from mover, says what it is worth, and repeats itself."""

from __future__ import annotations

import signal
from dataclasses import replace

import numpy as np
import pytest

from tiegocancel import CancelConfig, Events, RotationTrajectory
from tiegocancel.errors import ConfigError
from tiegocancel.events import EGO, MOVER
from tiegocancel.scene import SceneConfig, simulate
from tiegocancel.study.feed import FixedMotion
from tiegocancel.study.plan import PlanConfig, plan_stream, search
from tiegocancel.study.plan_result import PlanLimits, PlanResult
from tiegocancel.study.plan_stretch import Ground, lay_out, rim_speed_px_s
from tiegocancel.study.plan_trial import Bound, Course
from tiegocancel.study.settings import MotionSettings, Settings

SIZE = {"width": 320, "height": 180}
SCENE = SceneConfig.disc(**SIZE, omega_rad_s=14.4)
SETTINGS = Settings(motion=MotionSettings(source=",".join(map(str, (*SCENE.rig.center_px, SCENE.rig.omega_rad_s)))))
CONFIG = CancelConfig(
    horizon_us=10_240,
    tolerance_us=2560,
    tolerance_px=1.0,
    carry=3,
    need=3,
    uses=0,
    tick_bits=9,
    least_shift_px=1.0,
)


@pytest.fixture(scope="module")
def events() -> Events:
    return Events.concatenate(list(simulate(SCENE, duration_s=0.2, seed=1)))


@pytest.fixture(scope="module")
def ground(events: Events) -> Ground:
    laid = lay_out(lambda: [events], SETTINGS, **SIZE)
    assert laid is not None
    return laid


@pytest.fixture(scope="module")
def result(ground: Ground) -> PlanResult:
    return search(ground, PlanConfig(budget=8))


def test_the_speed_is_that_of_the_rim(events: Events, ground: Ground) -> None:
    rim_px_s = SCENE.rig.omega_rad_s * SCENE.rig.radius_px
    assert 0.75 * rim_px_s < 1e6 / ground.pace.us_per_px < 1.05 * rim_px_s
    assert not ground.injected


def test_the_choice_keeps_the_mover_where_the_thesis_loses_it(result: PlanResult) -> None:
    chosen, thesis = result.chosen, result.references[0]
    assert chosen is not None
    assert thesis.name.startswith("thesis")
    assert chosen.score > 0.6
    assert chosen.score > thesis.score + 0.3
    assert chosen.kib < thesis.kib


def test_the_ring_of_the_choice_holds_what_was_pending_and_a_quarter_more(events: Events, result: PlanResult) -> None:
    chosen = result.chosen
    assert chosen is not None
    assert chosen.config.ring_capacity == int(np.ceil(1.25 * chosen.high_water))
    assert 0 < chosen.high_water < len(events)


def test_the_same_budget_and_seed_give_the_same_result(ground: Ground, result: PlanResult) -> None:
    again = search(ground, PlanConfig(budget=8))
    assert again.trials == result.trials
    assert again.dropped == result.dropped


def test_no_more_than_the_budget_is_tried(result: PlanResult) -> None:
    assert len(result.trials) + result.dropped == 8


def test_an_interrupted_search_keeps_what_it_has(ground: Ground) -> None:
    ended = search(ground, PlanConfig(budget=8), progress=lambda events: signal.raise_signal(signal.SIGINT))
    assert ended.interrupted
    assert len(ended.trials) == 1
    assert ended.chosen is ended.trials[0]


def test_limits_that_nothing_keeps_leave_no_choice(ground: Ground) -> None:
    none = search(ground, PlanConfig(budget=2, limits=PlanLimits(max_kib=0.5)))
    assert none.chosen is None
    assert none.smallest is None
    assert none.trials


def test_zero_motion_is_measured_by_the_gates_though_its_predictions_would_not_be_made(ground: Ground) -> None:
    wide = replace(CONFIG, horizon_us=3072, tolerance_px=3.0)
    trial = ground.course.run("wide", wide)
    assert trial is not None
    assert trial.zero > 0.3


def test_a_trial_is_given_up_when_it_is_hopeless(ground: Ground) -> None:
    bounds: list[Bound] = []
    assert ground.course.run("x", CONFIG, hopeless=lambda bound: bool(bounds.append(bound)) or bound.whole) is None
    assert [bound.whole for bound in bounds] == [False, True]
    assert bounds[0].kib <= bounds[1].kib
    trial = ground.course.run("x", CONFIG)
    assert trial is not None
    assert trial.score <= bounds[1].margin == pytest.approx(trial.selectivity)


def test_events_before_the_count_begins_change_no_share(events: Events, ground: Ground) -> None:
    assert ground.course.serves(CONFIG)
    assert not ground.course.serves(replace(CONFIG, horizon_us=102_400))
    assert ground.course.counted(EGO) < int((events.label == EGO).sum())


def test_an_unlabelled_stream_gets_a_mover_and_says_so(events: Events) -> None:
    bare = Events(events.t, events.x, events.y, events.p, **SIZE)
    laid = lay_out(lambda: [bare], SETTINGS, **SIZE)
    assert laid is not None
    assert laid.injected
    assert laid.course.counted(MOVER) > 100
    assert any("no mover is labelled" in note for note in laid.notes)


def test_events_beyond_the_disc_do_not_count_where_nothing_is_labelled(events: Events) -> None:
    bare = Events(events.t, events.x, events.y, events.p, **SIZE)
    half = replace(SETTINGS, report=replace(SETTINGS.report, disc_radius_px=SCENE.rig.radius_px / 2))
    laid = [lay_out(lambda: [bare], settings, **SIZE) for settings in (SETTINGS, half)]
    assert laid[0] is not None
    assert laid[1] is not None
    assert laid[1].course.counted(EGO) < 0.6 * laid[0].course.counted(EGO)
    assert laid[1].pace.us_per_px > 1.5 * laid[0].pace.us_per_px


def test_rest_is_refused(events: Events) -> None:
    rest = Settings(motion=MotionSettings(source="160,90,0"))
    with pytest.raises(ConfigError, match=r"edges move at 0\.0 px/s"):
        lay_out(lambda: [events], rest, **SIZE)


def test_a_stream_without_events_has_no_plan() -> None:
    assert plan_stream(lambda: [Events.empty(**SIZE)], SETTINGS, PlanConfig(budget=1), **SIZE) is None


def test_a_motion_found_on_the_way_is_planned_with(events: Events) -> None:
    tracked = Settings(motion=MotionSettings(source="track"))
    laid = lay_out(lambda: [events[:90_000], events[90_000:]], tracked, **SIZE)
    assert laid is not None
    trial = laid.course.run("x", CONFIG)
    assert trial is not None
    assert trial.ego > 0.5


def test_unlabelled_events_are_no_course(events: Events) -> None:
    bare = Events(events.t, events.x, events.y, events.p, **SIZE)
    truth = RotationTrajectory.constant(center_px=SCENE.rig.center_px, omega_rad_s=SCENE.rig.omega_rad_s)
    feed = FixedMotion(truth)
    assert rim_speed_px_s(bare, feed, step_us=1000) > 0
    with pytest.raises(ValueError, match="must carry labels"):
        Course(bare, feed, counted_from_us=0, step_us=1000)


@pytest.mark.parametrize("values", [{"budget": 0}, {"seed": -1}])
def test_a_search_without_bounds_is_refused(values: dict[str, int]) -> None:
    with pytest.raises(ValueError, match=f"{next(iter(values))} must"):
        PlanConfig(**values)  # type: ignore[arg-type]


def test_the_rings_of_a_choice_are_as_large_as_each_was_filled(ground: Ground) -> None:
    two = replace(CONFIG, horizon_us=5120, more_horizons_us=(10_240,), choose_px=3.0)
    trial = ground.course.run("two", two)
    assert trial is not None
    assert len(trial.config.ring_capacities) == 2
    assert sum(trial.config.ring_capacities) >= trial.high_water > max(trial.config.ring_capacities) / 1.25
    again = ground.course.run("again", trial.config)
    assert again is not None
    assert (again.ego, again.mover, again.kib) == (trial.ego, trial.mover, trial.kib)
