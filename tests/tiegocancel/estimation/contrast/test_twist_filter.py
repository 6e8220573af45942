"""Hold the filter to what its covariance claims, through jumps, straight motions and times out of order."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.twist_filter import FilterConfig, TwistFilter, TwistState

ANCHOR, SCALE_PX = (160.0, 120.0), 100.0
STEP_S = 0.01
NOISE = np.diag([2.0**2, 2.0**2, 0.02**2])
TURN = Twist.about((150.0, 110.0), 5.0, ANCHOR)


def new(**change):
    return TwistFilter(FilterConfig(**change), anchor_px=ANCHOR, scale_px=SCALE_PX)


def fed(twists, *, noise=NOISE, seed=0, anchors=None, **change):
    """Return a filter that has seen noisy measurements of the twists, one a step."""
    rng, held = np.random.default_rng(seed), new(**change)
    for k, twist in enumerate(twists):
        anchor = ANCHOR if anchors is None else anchors[k]
        seen = np.array(twist.seen_from(ANCHOR, anchor)) + rng.multivariate_normal(np.zeros(3), noise)
        held.update(k * STEP_S, Twist(*seen.tolist()), anchor, noise)
    return held


def test_first_measurement_starts_the_filter():
    held = new()
    assert not held.started
    held.update(1.0, TURN, ANCHOR, NOISE)
    assert held.started
    state = held.at(1.0)
    assert state.twist == pytest.approx(TURN)
    assert state.covariance[:3, :3] == pytest.approx(NOISE)
    assert state.mean[3:].tolist() == [0.0, 0.0, 0.0]


@given(anchor=st.tuples(st.floats(-500, 800), st.floats(-500, 700)))
@settings(max_examples=30, deadline=None)
def test_measurements_and_expectations_are_those_of_any_anchor(anchor):
    held = new()
    held.update(0.0, TURN.seen_from(ANCHOR, anchor), anchor, NOISE)
    assert held.at(0.0).twist == pytest.approx(TURN, abs=1e-6)
    assert held.expected(0.0, anchor) == pytest.approx(TURN.seen_from(ANCHOR, anchor), abs=1e-6)
    assert held.expected(0.0, ANCHOR) == pytest.approx(TURN, abs=1e-6)


def test_anchors_that_wander_tell_the_same_motion():
    rng = np.random.default_rng(4)
    held = fed([TURN] * 60, anchors=rng.uniform(0, 300, (60, 2)).tolist())
    assert held.at(0.59).twist.omega_rad_s == pytest.approx(5.0, abs=0.05)
    assert held.at(0.59).twist.center_px(ANCHOR) == pytest.approx((150.0, 110.0), abs=1.0)


def test_errors_are_as_large_as_the_covariance_says():
    """Motions drawn from the filter's own model: white jerk, fading acceleration (normalised squared error of 6)."""
    config, surprise = FilterConfig(), []
    for seed in range(40):
        rng, held = np.random.default_rng(seed), new()
        state = np.array([300.0, -200.0, 5.0, 0.0, 0.0, 0.0])
        for k in range(40):
            seen = state[:3] + rng.multivariate_normal(np.zeros(3), NOISE)
            held.update(k * STEP_S, Twist(*seen.tolist()), ANCHOR, NOISE)
            before = held.at(k * STEP_S)
            if k == 39:
                off = state - before.mean
                surprise.append(off @ np.linalg.solve(before.covariance, off))
            # The same step that the filter takes, with a draw instead of a covariance.
            fade = math.exp(-STEP_S / config.fade_s)
            speed = math.hypot(state[0], state[1], state[2] * SCALE_PX)
            jerk = (config.jerk_share * speed + config.jerk_floor_px_s3) * np.array([1.0, 1.0, 1.0 / SCALE_PX])
            kick = rng.multivariate_normal(
                np.zeros(2), 0.1 * np.array([[STEP_S**3 / 3, STEP_S**2 / 2], [STEP_S**2 / 2, STEP_S]]), 3
            )
            state[:3] += config.fade_s * (1.0 - fade) * state[3:] + jerk * kick[:, 0]
            state[3:] = fade * state[3:] + jerk * kick[:, 1]
    assert 0.5 < np.mean(surprise) / 6.0 < 2.0


def test_noise_is_averaged_while_the_motion_is_steady():
    held = fed([TURN] * 80)
    state = held.at(0.79)
    assert math.sqrt(state.covariance[2, 2]) < 0.8 * 0.02
    assert state.twist.omega_rad_s == pytest.approx(5.0, abs=0.03)


def test_ramp_is_followed_with_its_acceleration():
    held = fed([TURN.scaled(1.0 + k * STEP_S) for k in range(100)])
    state = held.at(0.99)
    assert state.twist.omega_rad_s == pytest.approx(9.95, abs=0.05)
    assert state.mean[5] == pytest.approx(5.0, rel=0.3)
    assert held.at(1.01).twist.omega_rad_s > state.twist.omega_rad_s


@pytest.mark.parametrize("jump", [Twist(0.0, 0.0, 0.0), TURN.scaled(-1.0), TURN.scaled(3.0), Twist(900.0, 0.0, 0.0)])
def test_jump_is_followed_within_two_updates(jump):
    held = fed([TURN] * 40 + [jump] * 2)
    off = np.abs(np.subtract(held.at(0.41).twist, jump))
    assert (off < 5.0 * np.sqrt(np.diag(NOISE))).all()


def test_acceleration_before_a_jump_does_not_outlive_it():
    held = fed([TURN.scaled(1.0 + 2.0 * k * STEP_S) for k in range(60)] + [Twist(0.0, 0.0, 0.0)] * 3)
    assert abs(held.at(0.63).twist.omega_rad_s) < 0.2


def test_outlier_of_a_wide_measurement_hardly_matters():
    held = fed([TURN] * 40)
    held.update(0.40, TURN.scaled(1.5), ANCHOR, 1e6 * NOISE)
    assert held.at(0.40).twist.omega_rad_s == pytest.approx(5.0, abs=0.05)


def test_straight_motion_and_rest_have_no_centre():
    assert fed([Twist(400.0, 0.0, 0.0)] * 30).at(0.29).center_sigma_px() == math.inf
    assert fed([Twist(0.0, 0.0, 0.0)] * 30).at(0.29).center_sigma_px() == math.inf
    zero = TwistState(np.zeros(6), np.zeros((6, 6)))
    assert zero.center_sigma_px() == math.inf


def test_sigma_of_the_centre_is_that_of_the_propagated_errors():
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = [[4.0, 0.5, 0.0], [0.5, 3.0, 0.01], [0.0, 0.01, 4e-4]]
    state = TwistState(np.array([-50.0, 50.0, 5.0, 0.0, 0.0, 0.0]), covariance)
    draws = np.random.default_rng(0).multivariate_normal(state.mean[:3], covariance[:3, :3], 20_000)
    centers = np.array([Twist(*draw).center_px(ANCHOR) for draw in draws.tolist()])
    worst = math.sqrt(float(np.linalg.eigvalsh(np.cov(centers.T))[-1]))
    assert state.center_sigma_px() == pytest.approx(worst, rel=0.05)


def test_uncertainty_grows_without_measurements_and_the_state_is_not_kept():
    held = fed([TURN] * 20)
    before = held.at(0.19).covariance[2, 2]
    spread = [held.at(0.19 + ahead).covariance[2, 2] for ahead in (0.01, 0.1, 1.0, 100.0)]
    assert spread == sorted(spread)
    assert before < spread[0]
    assert held.at(0.19).covariance[2, 2] == before
    # An acceleration fades: far ahead the motion stands still at some value, and does not run away.
    assert held.at(1e6).twist.omega_rad_s == pytest.approx(held.at(1e3).twist.omega_rad_s)


def test_measurement_of_an_earlier_time_does_not_turn_time_back():
    held = fed([TURN] * 20)
    held.update(0.10, TURN, ANCHOR, NOISE)
    assert held.at(0.10).mean.tolist() == held.at(0.19).mean.tolist()
    assert held.at(0.25).covariance[2, 2] > held.at(0.19).covariance[2, 2]


@given(
    seed=st.integers(0, 2**31),
    scales=st.lists(st.sampled_from([0.1, 1.0, 1e2, 1e4]), min_size=3, max_size=30),
)
@settings(max_examples=40, deadline=None)
def test_covariance_stays_symmetric_and_positive_whatever_is_measured(seed, scales):
    rng, held, time_s = np.random.default_rng(seed), new(), 0.0
    for scale in scales:
        time_s += float(rng.choice([0.0, 1e-4, 0.01, 10.0]))
        spread = rng.normal(size=(3, 3))
        noise = scale * (spread @ spread.T + 1e-3 * np.eye(3))
        held.update(time_s, Twist(*(scale * rng.normal(size=3)).tolist()), tuple(rng.uniform(0, 300, 2)), noise)
        state = held.at(time_s + 0.01)
        assert np.isfinite(state.mean).all()
        assert np.array_equal(state.covariance, state.covariance.T) or np.allclose(
            state.covariance, state.covariance.T, rtol=1e-9
        )
        value = np.linalg.eigvalsh(state.covariance)
        assert value[0] >= -1e-9 * value[-1]
        assert state.center_sigma_px() >= 0.0


@pytest.mark.parametrize(
    "setting",
    [
        {"jerk_share": -1.0},
        {"jerk_share": math.nan},
        {"jerk_floor_px_s3": math.inf},
        {"jerk_floor_px_s3": -0.1},
        {"fade_s": 0.0},
        {"fade_s": math.nan},
        {"fade_s": math.inf},
    ],
)
def test_settings_out_of_range_are_refused(setting):
    with pytest.raises(ValueError, match=next(iter(setting))):
        FilterConfig(**setting)
