"""Gyro samples: their checks, their axes, and which way the image turns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.inertial.gyro import GyroSamples, axes_matrix, image_omega

SINCE_1970_US = 1_589_163_147_369_190


def samples(t_us=(0, 10, 30), rate=((0.0, 1.0, 2.0), (1.0, 1.0, 4.0), (2.0, 1.0, 0.0)), **more):
    return GyroSamples(t_us=np.array(t_us, np.int64), rate_rad_s=np.array(rate, np.float64), **more)


@pytest.mark.parametrize(
    ("t_us", "rate", "message"),
    [
        ([0, 0], np.zeros((2, 3)), "t_us must increase strictly: row 1"),
        ([5, 3], np.zeros((2, 3)), "t_us must increase strictly: row 1 has 3 µs after 5 µs"),
        ([0, 1], np.zeros((2, 2)), r"rate_rad_s must be float64\[2, 3\]"),
        ([0, 1], [[0, 0, 0], [0, np.nan, 0]], "row 1 has nan about y"),
        ([0, 1], [[0, 0, 2e6], [0, 0, 0]], "row 0 has 2000000.0 about z"),
        ([], np.zeros((0, 3)), "K ≥ 1"),
    ],
)
def test_broken_columns_are_refused_by_name_and_row(t_us, rate, message):
    with pytest.raises(ValueError, match=message):
        GyroSamples(t_us=np.array(t_us, np.int64), rate_rad_s=np.array(rate, np.float64))


def test_columns_are_read_only_copies():
    rate = np.zeros((2, 3))
    held = GyroSamples(t_us=np.array([0, 1]), rate_rad_s=rate)
    rate[0, 0] = 5.0
    assert held.rate_rad_s[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        held.rate_rad_s[0, 0] = 1.0


def test_times_since_1970_lose_no_fraction_when_interpolated():
    held = samples(t_us=np.array([0, 10, 30]) + SINCE_1970_US)
    assert held.at(np.array([SINCE_1970_US + 5]))[0].tolist() == [0.5, 1.0, 3.0]
    assert held.resampled(np.array([SINCE_1970_US + 20])).rate_rad_s[0].tolist() == [1.5, 1.0, 2.0]


def test_rates_are_held_beyond_the_ends():
    assert samples().at(np.array([-100, 100])).tolist() == [[0.0, 1.0, 2.0], [2.0, 1.0, 0.0]]


@given(
    steps=st.lists(st.integers(1, 5000), min_size=1, max_size=20),
    ends=st.tuples(st.integers(-3000, 60_000), st.integers(0, 60_000)),
    seed=st.integers(0, 1000),
)
def test_mean_over_an_interval_is_that_of_a_fine_resampling(steps, ends, seed):
    times = np.cumsum(steps)
    held = samples(times, np.random.default_rng(seed).normal(size=(len(times), 3)))
    start, stop = ends[0], ends[0] + ends[1]
    # The middle of each of so many slices: exact for straight lines up to the slices that hold a knot.
    middle = start + (np.arange(6000) + 0.5) * (stop - start) / 6000
    assert held.mean(start, stop) == pytest.approx(held.at(middle).mean(axis=0), abs=2e-3)


def test_bias_and_offset_are_taken_off_and_put_on():
    held = samples().minus([0.5, 0.0, -1.0]).shifted(-7.4)
    assert held.t_us.tolist() == [-7, 3, 23]
    assert held.rate_rad_s[1].tolist() == [0.5, 1.0, 5.0]


@pytest.mark.parametrize(
    ("axes", "expected"),
    [("x,y,z", [1, 2, 3]), ("-x,y,-z", [-1, 2, -3]), ("y, -x, z", [2, -1, 3]), ("Z,+X,y", [3, 1, 2])],
)
def test_axis_map_says_what_each_axis_of_the_camera_reads(axes, expected):
    assert samples([0], [[1.0, 2.0, 3.0]]).rotated(axes).rate_rad_s[0].tolist() == expected


@pytest.mark.parametrize("axes", ["x,y", "x,x,z", "x,y,w", "", "x,y,z,z", "--x,y,z"])
def test_a_text_that_is_no_axis_map_is_refused(axes):
    with pytest.raises(ValueError, match="axes must name each of x, y, z once"):
        axes_matrix(axes)


def test_a_matrix_must_be_orthonormal():
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert samples([0], [[1.0, 2.0, 3.0]]).rotated(turned).rate_rad_s[0].tolist() == [-2.0, 1.0, 3.0]
    for wrong in (2.0 * turned, np.full((3, 3), np.nan), np.eye(2)):
        with pytest.raises(ValueError, match="orthonormal"):
            samples().rotated(wrong)


def test_unsorted_rows_are_sorted_and_those_of_one_instant_averaged():
    held = GyroSamples.from_unsorted([20, 10, 20], [[1, 0, 0], [5, 0, 0], [3, 0, 0]], source="s", notes=["n"])
    assert held.t_us.tolist() == [10, 20]
    assert held.rate_rad_s[:, 0].tolist() == [5.0, 2.0]
    assert held.notes[0] == "n"
    assert "1 of 3 moved" in held.notes[1]
    assert "3 rows at 2 instants" in held.notes[2]


def test_stretches_between_times_join_to_the_whole():
    held = samples(source="a")
    joined = GyroSamples.concatenate([held.between(0, 30), held.between(30, 31)])
    assert joined.t_us.tolist() == held.t_us.tolist()
    assert joined.source == "a"
    with pytest.raises(ValueError, match="no gyro sample from 11 to 29"):
        held.between(11, 29)


def test_image_turns_against_the_camera():
    """Turn a camera with the right-hand rule about z, look at a static point, and measure how its image turns."""
    rate, step_s = 0.7, 1e-4
    angle = rate * step_s
    # Columns: the camera's x and y after the turn, in the frame before (x right, y down, z forward).
    turned = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    point = np.array([0.3, -0.2, 2.0])
    x, y, z = turned.T @ point
    seen = np.arctan2(y / z, x / z) - np.arctan2(point[1], point[0])
    omega = image_omega(samples([0], [[0.0, 0.0, rate]]))[0]
    assert seen / step_s == pytest.approx(omega)
    assert omega == -rate
