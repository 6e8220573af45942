"""Check the closed exponential against SciPy's and against exact cases at the edge of singularity."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from tiegocancel.motion.generator import displacement, fixed_point_of

# SciPy 1.17 loses the displacement altogether for triangular fields with a rate near 1e-300: they are left out here.
RATE = st.sampled_from([0.0, 1e-9, -1e-9]) | st.floats(-40, 40).filter(lambda rate: abs(rate) > 1e-12)
PAN = st.floats(-1e5, 1e5)


@given(a=RATE, b=RATE, c=PAN, d=RATE, e=RATE, f=PAN, horizon_s=st.floats(0, 0.2))
def test_displacement_is_the_matrix_exponential(a, b, c, d, e, f, horizon_s):
    rates = np.array([a, b, c, d, e, f])
    found = displacement(rates, horizon_s)
    whole = expm(np.array([[a, b, c], [d, e, f], [0, 0, 0]]) * horizon_s) - np.eye(3)
    expected = np.array([*whole[0], *whole[1]])
    scale = np.array([1, 1, abs(c) + abs(f) + 1] * 2) * np.abs(whole[:2, :2] + np.eye(2)).max() * 10
    assert (np.abs(found - expected) <= 1e-12 * np.maximum(scale, 1)).all()


@given(omega=st.floats(-1e4, 1e4), horizon_s=st.floats(0, 0.1))
def test_a_roll_turns(omega, horizon_s):
    theta = omega * horizon_s
    a, b, _, d, e, _ = displacement(np.array([0, -omega, 0, omega, 0, 0.0]), horizon_s)
    tolerance = 1e-14 * (1 + abs(theta))
    assert (a, e) == pytest.approx((np.cos(theta) - 1,) * 2, abs=tolerance)
    assert (-b, d) == pytest.approx((np.sin(theta),) * 2, abs=tolerance)


def test_small_motion_keeps_its_digits():
    # Written as cos θ − 1, this would be zero.
    a = displacement(np.array([0, -1e-9, 0, 1e-9, 0, 0]), 1.0)[0]
    assert a == pytest.approx(-0.5e-18, rel=1e-12)


def test_rates_that_are_all_but_zero_are_zero():
    almost = displacement(np.array([35.0, 0, 0, 0, 1e-301, 1.0]), 0.125)
    assert almost == pytest.approx([np.expm1(35 / 8), 0, 0, 0, 0, 0.125], rel=1e-12, abs=1e-12)


def test_pan_alone_and_pure_shear_are_exact():
    assert displacement(np.array([0, 0, 30.0, 0, 0, -70.0]), 0.5).tolist() == [0, 0, 15, 0, 0, -35]
    # dx/dt = 8y, dy/dt = 2: y gains 1, x gains 8·(y·½ + ½·2·½²) = 4y + 2.
    assert displacement(np.array([0, 8.0, 0, 0, 0, 2.0]), 0.5).tolist() == [0, 4, 2, 0, 0, 1]


def test_shrinking_to_a_point_does_not_lose_the_point():
    shift = displacement(np.array([-1e6, 0, 3e8, 0, -1e6, 1e8]), 1.0)
    assert shift == pytest.approx([-1, 0, 300, 0, -1, 100], rel=1e-9)


def test_elements_do_not_depend_on_their_neighbours():
    rates = np.random.default_rng(0).normal(size=(257, 6)) * np.logspace(-6, 3, 257)[:, None]
    whole = displacement(rates, 0.01)
    for first, last in ((0, 1), (1, 8), (8, 29), (29, 257)):
        assert displacement(rates[first:last], 0.01).tobytes() == whole[first:last].tobytes()


def test_growth_beyond_all_sense_is_refused():
    with pytest.raises(ValueError, match=r"grows by e\^100"):
        displacement(np.array([100.0, 0, 0, 0, 0, 0]), 1.0)


@pytest.mark.parametrize(
    ("rates", "expected"),
    [
        ([0, -2, 2 * 30, 2, 0, -2 * 40], (40.0, 30.0)),
        ([1e-9, 0, -4e-8, 0, 1e-9, -3e-8], (40.0, 30.0)),
        ([0, 0, 1, 0, 0, 1], None),
        ([0, 5, 1, 0, 0, 0], None),
        ([0, 0, 0, 0, 0, 0], None),
        ([1, 1, 5, 1, 1 + 1e-15, 2], None),
        ([1e-6, 0, 1e3, 0, 1e-6, 1e3], None),
    ],
)
def test_point_at_rest(rates, expected):
    found = fixed_point_of(np.array(rates, np.float64), 1e7)
    assert found == (None if expected is None else pytest.approx(expected))
