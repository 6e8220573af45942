"""Check the fixed-point schedule against exact rational arithmetic and the rotation it stands for."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.motion.schedule import MAX_COEFFICIENT, MotionSchedule, rotation_coefficients

COEFFICIENT = st.integers(-MAX_COEFFICIENT, MAX_COEFFICIENT)
PIXEL = st.integers(0, 65_535)


@given(row=st.lists(COEFFICIENT, min_size=6, max_size=6), x=PIXEL, y=PIXEL)
def test_prediction_is_the_exact_affine_map_rounded_half_up(row, x, y):
    schedule = MotionSchedule(np.zeros(1, np.int64), np.array([row], np.int64))
    ahead_x, ahead_y = schedule.predict(np.zeros(1, np.int64), np.array([x], np.uint16), np.array([y], np.uint16))
    a, b, c, d, e, f = (Fraction(value, 1 << 16) for value in row)
    half = Fraction(1, 2)
    assert int(ahead_x[0]) == (x + a * x + b * y + c + half).__floor__()
    assert int(ahead_y[0]) == (y + d * x + e * y + f + half).__floor__()


@given(
    cx=st.floats(-2000, 3000),
    cy=st.floats(-2000, 3000),
    omega=st.floats(-200, 200),
    horizon_us=st.integers(0, 50_000),
    x=st.integers(0, 1279),
    y=st.integers(0, 719),
)
def test_rotation_lands_within_rounding_of_the_true_place(cx, cy, omega, horizon_us, x, y):
    schedule = MotionSchedule.rotation(center_px=(cx, cy), omega_rad_s=omega, horizon_us=horizon_us)
    ahead_x, ahead_y = schedule.predict(np.zeros(1, np.int64), np.array([x], np.uint16), np.array([y], np.uint16))
    theta = omega * horizon_us * 1e-6
    exact_x = cx + np.cos(theta) * (x - cx) - np.sin(theta) * (y - cy)
    exact_y = cy + np.sin(theta) * (x - cx) + np.cos(theta) * (y - cy)
    # Half a pixel of rounding, and half of 2^-16 on each coefficient.
    assert abs(ahead_x[0] - exact_x) <= 0.5 + (x + y + 1) / 2**17 + 1e-6
    assert abs(ahead_y[0] - exact_y) <= 0.5 + (x + y + 1) / 2**17 + 1e-6


def test_positive_omega_turns_x_towards_y():
    schedule = MotionSchedule.rotation(center_px=(100, 100), omega_rad_s=np.pi / 2, horizon_us=1_000_000)
    ahead_x, ahead_y = schedule.predict(np.zeros(1, np.int64), np.array([150], np.uint16), np.array([100], np.uint16))
    assert (ahead_x[0], ahead_y[0]) == (100, 150)


def test_still_predicts_the_same_place():
    x, y = np.array([0, 7, 65_535], np.uint16), np.array([9, 0, 65_535], np.uint16)
    ahead_x, ahead_y = MotionSchedule.still().predict(np.array([-5, 0, 1 << 40]), x, y)
    assert ahead_x.tolist() == x.tolist()
    assert ahead_y.tolist() == y.tolist()


def test_zero_omega_has_zero_coefficients():
    assert not rotation_coefficients(640.5, 360.25, 0.0, 40_000).any()


@given(
    t_us=st.lists(st.integers(-(1 << 41), 1 << 41), min_size=1, max_size=20).map(sorted),
    query=st.lists(st.integers(-(1 << 42), 1 << 42), min_size=1, max_size=20),
)
def test_event_uses_the_last_entry_not_after_it_and_the_first_before_that(t_us, query):
    schedule = MotionSchedule(np.array(t_us, np.int64), np.zeros((len(t_us), 6), np.int64))
    for time, row in zip(query, schedule.entry_at(np.array(query, np.int64)).tolist(), strict=True):
        earlier = [index for index, start in enumerate(t_us) if start <= time]
        assert row == (earlier[-1] if earlier else 0)


def test_an_array_of_centres_gives_a_row_each():
    rows = rotation_coefficients([10.0, 20.0], [30.0, 40.0], 3.0, 8000)
    assert rows.shape == (2, 6)
    assert rows[1].tolist() == rotation_coefficients(20.0, 40.0, 3.0, 8000).tolist()


def test_columns_are_read_only():
    schedule = MotionSchedule.still()
    with pytest.raises(ValueError, match="read-only"):
        schedule.coefficients[0, 0] = 1


@pytest.mark.parametrize(
    ("t_us", "coefficients", "message"),
    [
        ([], np.zeros((0, 6), np.int64), "K ≥ 1"),
        ([0, 1], np.zeros((1, 6), np.int64), r"int64\[2, 6\]"),
        ([5, 4], np.zeros((2, 6), np.int64), "row 1 has 4 µs after 5 µs"),
        ([0], np.full((1, 6), MAX_COEFFICIENT + 1), "±2\\^44: row 0"),
        ([0], np.full((1, 6), 0.5), "whole numbers"),
        ([0], np.full((1, 6), np.nan), "whole numbers"),
        (["0"], np.zeros((1, 6), np.int64), "integers"),
    ],
)
def test_broken_tables_are_refused(t_us, coefficients, message):
    with pytest.raises(ValueError, match=message):
        MotionSchedule(np.array(t_us), coefficients)


@pytest.mark.parametrize(("center", "omega"), [((np.nan, 0.0), 1.0), ((0.0, np.inf), 1.0), ((0.0, 0.0), np.nan)])
def test_rotations_that_are_not_finite_are_refused(center, omega):
    with pytest.raises(ValueError, match="finite"):
        MotionSchedule.rotation(center_px=center, omega_rad_s=omega, horizon_us=1000)


def test_a_centre_too_far_for_the_format_is_refused():
    with pytest.raises(ValueError, match="too far away"):
        MotionSchedule.rotation(center_px=(1e12, 0.0), omega_rad_s=3.0, horizon_us=8000)


@pytest.mark.parametrize("value", [-(2**63), 2**44 + 1, -(2**44) - 1])
def test_a_coefficient_beyond_the_bound_is_refused(value: int) -> None:
    with pytest.raises(ValueError, match="within"):
        MotionSchedule(np.zeros(1, np.int64), np.array([[0, 0, value, 0, 0, 0]]))


def test_unsigned_values_beyond_64_bits_with_a_sign_are_not_wrapped() -> None:
    huge = np.array([2**64 - 5], np.uint64)
    with pytest.raises(ValueError, match="must fit 64 bits with a sign"):
        MotionSchedule(huge, np.zeros((1, 6), np.int64))
