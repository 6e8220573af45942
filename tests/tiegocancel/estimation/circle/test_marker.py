"""Difference the bearings of markers, and refuse what has no direction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.circle.marker import MarkerTurn, NoTurn, turn_of_events, turn_of_marker


def bearings(omega_rad_s, *, width_rad=0.1, count=4000, span_us=10_000, start_us=0, seed=0, spread=0.0):
    """Return times and bearings of a marker, a share ``spread`` of them anywhere on the circle."""
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(0, span_us, count))
    angle = 1.0 + omega_rad_s * t * 1e-6 + rng.normal(0, width_rad, count)
    stray = rng.random(count) < spread
    angle[stray] = rng.uniform(-math.pi, math.pi, int(stray.sum()))
    return t + start_us, (angle + math.pi) % (2 * math.pi) - math.pi


def turn(t_us, bearing_rad, **change):
    return turn_of_marker(
        t_us, bearing_rad, **{"slot_us": 500, "least_resultant": 0.7, "max_omega_rad_s": 3000.0, **change}
    )


@given(omega=st.floats(-2500, 2500), start_us=st.integers(-(10**15), 10**15), seed=st.integers(0, 99))
def test_marker_gives_omega_through_any_number_of_turns(omega, start_us, seed):
    found = turn(*bearings(omega, start_us=start_us, seed=seed))
    assert isinstance(found, MarkerTurn)
    assert abs(found.omega_rad_s - omega) < max(6 * found.omega_sigma_rad_s, 1.0)
    assert found.omega_sigma_rad_s < 5.0


def test_strays_on_the_circle_widen_the_deviation_only():
    clean, strayed = turn(*bearings(120.0)), turn(*bearings(120.0, spread=0.2))
    assert strayed.omega_rad_s == pytest.approx(120.0, abs=4 * strayed.omega_sigma_rad_s)
    assert strayed.omega_sigma_rad_s > clean.omega_sigma_rad_s


def test_events_all_round_have_no_direction():
    found = turn(*bearings(100.0, spread=1.0))
    assert isinstance(found, NoTurn)
    assert "bearings spread over the circle" in found.reason


def test_two_markers_that_take_turns_are_not_unwrapped():
    t, angle = bearings(0.0)
    found = turn(t, np.where((t // 500) % 2, angle, angle - 2.5))
    assert isinstance(found, NoTurn)
    assert "leaps" in found.reason


def test_gap_in_which_the_marker_might_turn_half_is_refused():
    t, angle = bearings(10.0)
    kept = (t < 3000) | (t > 6000)
    assert "too rarely" in turn(t[kept], angle[kept], max_omega_rad_s=1500.0).reason
    assert turn(t[kept], angle[kept], max_omega_rad_s=300.0).omega_rad_s == pytest.approx(10.0, abs=2.0)


def test_turn_beyond_the_bound_is_refused():
    assert "beyond 100" in turn(*bearings(300.0), max_omega_rad_s=100.0).reason


@pytest.mark.parametrize("t", [[0], [7, 7, 7, 7], [0, 5000, 9999]])
def test_few_events_tell_nothing(t):
    found = turn(np.array(t), np.zeros(len(t)))
    assert isinstance(found, NoTurn)
    assert "too few events" in found.reason


def test_consecutive_events_of_a_single_pixel_marker_give_omega():
    t = np.arange(0, 1_000_000, 500)
    found = turn_of_events(t, np.angle(np.exp(1j * 30e-6 * t)), max_omega_rad_s=1000.0)
    assert found.omega_rad_s == pytest.approx(30.0, rel=1e-6)


def test_consecutive_events_of_a_broad_marker_give_a_deviation_that_says_so():
    found = turn_of_events(*bearings(120.0), max_omega_rad_s=1e6)
    assert found.omega_sigma_rad_s > 200.0
    assert isinstance(turn_of_events(*bearings(120.0), max_omega_rad_s=abs(found.omega_rad_s) / 2), NoTurn)


def test_events_at_one_time_have_no_quotient():
    assert isinstance(turn_of_events(np.full(50, 9), np.linspace(0, 1, 50), max_omega_rad_s=100.0), NoTurn)
