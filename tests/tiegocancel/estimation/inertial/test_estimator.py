"""Estimate the rotation from a gyroscope alone: causally, with the bias taken off, about a centre that is given."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.estimate import trajectory_of
from tiegocancel.estimation.inertial.bias import estimate_bias
from tiegocancel.estimation.inertial.estimator import GyroEstimator
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.events import Events

CENTER = (120.0, 90.0)
BIAS = np.array([0.01, -0.02, 0.03])


def spun(seconds=2.0, *, seed=0, noise=0.002):
    """Rest for a second, then turn the camera at 2 rad/s about its axis: 1 kHz."""
    t_us = np.arange(int(seconds * 1000)) * 1000 + 7
    rate = BIAS + np.random.default_rng(seed).normal(scale=noise, size=(len(t_us), 3))
    rate[t_us >= 1_000_000, 2] += 2.0
    return GyroSamples(t_us=t_us, rate_rad_s=rate)


def ticks(times):
    zeros = np.zeros(len(times), np.int64)
    return Events(np.asarray(times, np.int64), zeros, zeros, zeros, 4, 4)


def test_image_turns_against_the_camera_without_the_bias():
    gyro = spun()
    rows = GyroEstimator(gyro, CENTER, bias=estimate_bias(gyro)).process(ticks([0, 3_000_000]))
    assert [each.t_us for each in rows] == gyro.t_us.tolist()
    omega = np.array([each.omega_rad_s for each in rows])
    assert omega[:1000].mean() == pytest.approx(0.0, abs=2e-4)
    assert omega[1000:].mean() == pytest.approx(-2.0, abs=3e-4)
    assert rows[0].omega_sigma_rad_s == pytest.approx(0.002, rel=0.1)
    assert rows[0].center_px == CENTER
    assert rows[0].doubt == ""


def test_bias_is_followed_causally_and_doubted_until_known():
    rows = GyroEstimator(spun(), CENTER, bias="causal").process(ticks([3_000_000]))
    assert rows[0].doubt == "the bias is unknown: no rest so far"
    assert rows[0].omega_sigma_rad_s > 0.1
    assert rows[300].doubt == ""
    assert rows[300].omega_sigma_rad_s < 0.01
    assert np.mean([each.omega_rad_s for each in rows[1000:]]) == pytest.approx(-2.0, abs=1e-3)


def test_bias_that_was_not_found_is_doubted():
    gyro = spun().between(1_000_000, 2_000_000)
    rows = GyroEstimator(gyro, CENTER, bias=estimate_bias(gyro)).process(ticks([3_000_000]))
    assert rows[-1].doubt == "the bias is unknown: no rest"
    assert rows[-1].omega_sigma_rad_s > 0.1


def test_rows_stand_at_the_last_sample_of_a_batch_with_its_mean():
    gyro = spun(noise=0.1)
    rows = GyroEstimator(gyro, CENTER, row_us=8000, noise_rad_s=0.1).process(ticks([3_000_000]))
    assert len(rows) == 250
    assert rows[3].t_us == gyro.t_us[31]
    assert rows[3].omega_rad_s == pytest.approx(-gyro.rate_rad_s[24:32, 2].mean())
    assert rows[3].omega_sigma_rad_s == pytest.approx(0.1 / 8**0.5)


def test_no_row_lies_after_the_last_event():
    estimator = GyroEstimator(spun(), CENTER)
    assert estimator.process(ticks([])) == []
    assert [each.t_us for each in estimator.process(ticks([0, 2007]))] == [7, 1007, 2007]
    assert estimator.process(ticks([2500])) == []
    assert [each.t_us for each in estimator.until(3500)] == [3007]


@given(cuts=st.lists(st.integers(0, 300), max_size=6), row_us=st.sampled_from([1000, 2500, 7000]))
def test_borders_of_chunks_change_nothing(cuts, row_us):
    events = ticks(np.sort(np.random.default_rng(1).integers(0, 500_000, 300)))
    gyro = spun(0.6)
    whole = GyroEstimator(gyro, CENTER, bias="causal", row_us=row_us).process(events)
    estimator = GyroEstimator(gyro, CENTER, bias="causal", row_us=row_us)
    edges = [0, *sorted(cuts), len(events)]
    parts = []
    for first, stop in pairwise(edges):
        parts += estimator.process(events[first:stop])
    assert [(each.t_us, each.omega_rad_s) for each in parts] == [(each.t_us, each.omega_rad_s) for each in whole]


def test_rows_make_a_causal_trajectory():
    trajectory = trajectory_of(GyroEstimator(spun(), CENTER).until(2_000_000), source="gyro")
    assert trajectory.interpolation == "causal"
    # The row is kept until the next: nothing of the turn is known before it begins.
    _, _, omega = trajectory.at(np.array([1_000_006, 1_000_007]))
    assert abs(omega[0]) < 0.1
    assert omega[1] == pytest.approx(-2.0, abs=0.1)


@pytest.mark.parametrize(
    ("center_px", "more", "message"),
    [
        ((float("nan"), 0.0), {}, "center_px must be finite"),
        (CENTER, {"row_us": 0}, "row_us must be at least 1 µs, not 0"),
        (CENTER, {"noise_rad_s": 0.0}, "noise_rad_s must be positive"),
    ],
)
def test_arguments_are_checked(center_px, more, message):
    with pytest.raises(ValueError, match=message):
        GyroEstimator(spun(0.1), center_px, **more)
