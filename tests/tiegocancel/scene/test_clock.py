"""Check the clocks that stop: exact integrals of a smooth pace."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.scene.clock import delayed_time, halting_pace, halting_time, starting_pace

STOP = {"period_s": 0.1, "rest_s": 0.03, "ramp_s": 0.01}


@given(
    period_s=st.floats(0.05, 2.0),
    rest=st.floats(0.0, 0.6),
    ramp=st.floats(0.01, 0.2),
    start_s=st.floats(-1.0, 3.0),
)
def test_the_time_is_the_integral_of_the_pace(period_s: float, rest: float, ramp: float, start_s: float) -> None:
    stop = {"period_s": period_s, "rest_s": rest * period_s, "ramp_s": ramp * period_s}
    time_s = np.linspace(start_s, start_s + 1.3 * period_s, 4001)
    own = halting_time(time_s, **stop)
    pace = halting_pace(time_s, **stop)
    steps = np.diff(time_s)
    np.testing.assert_allclose(np.diff(own), 0.5 * (pace[1:] + pace[:-1]) * steps, atol=1e-6 * period_s)
    assert pace.min() >= 0.0
    assert pace.max() <= 1.0
    slope = np.abs(np.diff(pace)) / steps
    assert slope.max() <= math.pi / (2.0 * stop["ramp_s"]) * 1.001


def test_a_period_goes_slows_rests_and_starts() -> None:
    pace = halting_pace(np.array([0.0, 0.0499, 0.055, 0.061, 0.0899, 0.095, 0.1, 0.155, 0.175]), **STOP)
    np.testing.assert_allclose(pace, [1.0, 1.0, 0.5, 0.0, 0.0, 0.5, 1.0, 0.5, 0.0], atol=1e-3)
    assert halting_time(np.array([0.0, 0.1, 1.0]), **STOP) == pytest.approx([0.0, 0.06, 0.6])
    assert halting_time(np.array([0.061]), **STOP) == halting_time(np.array([0.089]), **STOP)


def test_a_late_start_is_smooth_and_then_runs_on_time() -> None:
    time_s = np.linspace(0.0, 0.5, 50_001)
    own = delayed_time(time_s, rest_s=0.2, ramp_s=0.1)
    pace = starting_pace(time_s, rest_s=0.2, ramp_s=0.1)
    assert not own[time_s <= 0.2].any()
    assert own[-1] == pytest.approx(0.5 - 0.2 - 0.05)
    np.testing.assert_allclose(np.gradient(own, time_s), pace, atol=1e-3)
    assert np.abs(np.diff(pace)).max() < 1e-3
