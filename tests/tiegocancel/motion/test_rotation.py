"""Check interpolation, prediction and schedules of a rotation trajectory."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.schedule import MotionSchedule

FAR_US = 1 << 40


def path(t_us, centers, omegas):
    return RotationTrajectory(
        t_us=np.array(t_us, np.int64), center_px=np.array(centers, np.float64), omega_rad_s=np.array(omegas, np.float64)
    )


@pytest.fixture
def bend():
    return path([FAR_US, FAR_US + 1000, FAR_US + 5000], [[600, 300], [610, 320], [600, 310]], [3.0, 4.0, 2.0])


def test_interpolates_linearly_and_holds_the_ends(bend):
    query = np.array([0, FAR_US, FAR_US + 250, FAR_US + 1000, FAR_US + 3000, FAR_US + 5000, 1 << 60])
    cx, cy, omega = bend.at(query)
    assert cx.tolist() == [600, 600, 602.5, 610, 605, 600, 600]
    assert cy.tolist() == [300, 300, 305, 320, 315, 310, 310]
    assert omega.tolist() == [3.0, 3.0, 3.25, 4.0, 3.0, 2.0, 2.0]


@given(offset=st.integers(-(1 << 58), 1 << 58), elapsed=st.integers(-100, 1100))
def test_interpolation_does_not_depend_on_the_origin_of_time(offset, elapsed):
    centers, omegas = [[600.1, 300.7], [611.3, 320.9]], [3.3, 4.7]
    near = path([0, 1000], centers, omegas).at(np.array([elapsed]))
    far = path([offset, offset + 1000], centers, omegas).at(np.array([offset + elapsed]))
    assert [float(value[0]) for value in near] == [float(value[0]) for value in far]


@given(
    times=st.lists(st.integers(0, 1 << 41), min_size=1, max_size=8, unique=True).map(sorted),
    seed=st.integers(0, 1 << 31),
    query=st.integers(-10, 1 << 42),
)
def test_interpolation_stays_between_its_neighbours(times, seed, query):
    omegas = np.random.default_rng(seed).uniform(-200, 200, len(times))
    omega = path(times, np.zeros((len(times), 2)), omegas).at(np.array([query]))[2][0]
    left = max(int(np.searchsorted(times, query, side="right")) - 1, 0)
    pair = omegas[left : left + 2] if query >= times[0] else omegas[:1]
    assert pair.min() - 1e-12 <= omega <= pair.max() + 1e-12


def events(count, seed=0):
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(FAR_US - 1000, FAR_US + 6000, count))
    return t, rng.integers(0, 1280, count).astype(np.uint16), rng.integers(0, 720, count).astype(np.uint16)


def test_prediction_of_an_event_does_not_depend_on_its_chunk(bend):
    t, x, y = events(70 * 71)
    whole = bend.predict(t, x, y, 8000)
    start = 0
    for length in range(1, 71):
        rows = slice(start, start + length)
        part = bend.predict(t[rows], x[rows], y[rows], 8000)
        assert all(np.array_equal(mine, all_of[rows]) for mine, all_of in zip(part, whole, strict=True))
        bits = [column.tobytes() for column in bend.at(t[rows])]
        assert bits == [column[rows].tobytes() for column in bend.at(t)]
        start += length


def test_a_huge_angle_does_not_disturb_its_neighbours():
    wild = path([0, 1], [[5, 5], [5, 5]], [1e6, 3.6])
    t = np.array([0] + [1] * 15)
    x = np.arange(16, dtype=np.uint16)
    whole = wild.predict(t, x, x, 1 << 50)
    alone = wild.predict(t[1:], x[1:], x[1:], 1 << 50)
    assert np.array_equal(whole[0][1:], alone[0])
    assert np.array_equal(whole[1][1:], alone[1])


def test_prediction_follows_equation_3_6_event_by_event(bend):
    t, x, y = events(500)
    ahead_x, ahead_y = bend.predict(t, x, y, 40_000)
    for row, (cx, cy, omega) in enumerate(zip(*bend.at(t), strict=True)):
        theta = omega * 0.04
        exact_x = cx + np.cos(theta) * (int(x[row]) - cx) - np.sin(theta) * (int(y[row]) - cy)
        exact_y = cy + np.sin(theta) * (int(x[row]) - cx) + np.cos(theta) * (int(y[row]) - cy)
        assert abs(ahead_x[row] - exact_x) <= 0.5 + 1e-9
        assert abs(ahead_y[row] - exact_y) <= 0.5 + 1e-9


def test_half_pixels_round_up():
    turn = RotationTrajectory.constant(center_px=(10.25, 10.25), omega_rad_s=np.pi, t_us=0)
    ahead_x, _ = turn.predict(
        np.zeros(2, np.int64), np.array([10, 20], np.uint16), np.array([10, 10], np.uint16), 10**6
    )
    assert ahead_x.tolist() == [11, 1]


def test_no_events_give_no_predictions(bend):
    none = np.zeros(0, np.uint16)
    ahead_x, ahead_y = bend.predict(np.zeros(0, np.int64), none, none, 8000)
    assert (len(ahead_x), len(ahead_y)) == (0, 0)
    assert ahead_x.dtype == np.int64


def test_a_constant_gives_one_entry_the_same_as_the_schedule_of_a_rotation():
    schedule = RotationTrajectory.constant(center_px=(640, 360), omega_rad_s=3.6).schedule(
        8000, start_us=0, stop_us=10**6
    )
    expected = MotionSchedule.rotation(center_px=(640, 360), omega_rad_s=3.6, horizon_us=8000)
    assert np.array_equal(schedule.t_us, expected.t_us)
    assert np.array_equal(schedule.coefficients, expected.coefficients)


def test_schedule_has_an_entry_every_step_with_the_parameters_of_its_time(bend):
    schedule = bend.schedule(8000, step_us=300)
    assert (schedule.t_us - FAR_US).tolist() == [*range(0, 5000, 300), 5000]
    cx, cy, omega = bend.at(schedule.t_us)
    for row in range(len(schedule)):
        one = MotionSchedule.rotation(center_px=(cx[row], cy[row]), omega_rad_s=omega[row], horizon_us=8000)
        assert np.array_equal(schedule.coefficients[row], one.coefficients[0])


@pytest.mark.parametrize(
    ("start", "stop", "expected"),
    [
        (None, None, [0, 1000, 2000, 3000, 4000, 5000]),
        (1500, 3500, [1500, 2500, 3500]),
        (-(10**9), 10**9, [0, 1000, 2000, 3000, 4000, 5000]),
        (-20, -10, [0]),
        (7000, 8000, [5000]),
    ],
)
def test_schedule_is_clipped_to_the_span_because_the_ends_are_held(bend, start, stop, expected):
    bounds = {"start_us": None if start is None else FAR_US + start, "stop_us": None if stop is None else FAR_US + stop}
    assert (bend.schedule(8000, **bounds).t_us - FAR_US).tolist() == expected


@given(omega=st.floats(-20, 20), horizon_us=st.integers(0, 40_000))
@settings(max_examples=30)
def test_float_path_and_integer_path_agree_but_for_rounding(omega, horizon_us):
    constant = RotationTrajectory.constant(center_px=(664.6, 336.9), omega_rad_s=omega)
    t, x, y = events(200)
    exact = constant.predict(t, x, y, horizon_us)
    fixed = constant.schedule(horizon_us).predict(t, x, y, horizon_us)
    for one, other in zip(exact, fixed, strict=True):
        assert np.abs(one - other).max() <= 1
        assert (one != other).mean() < 0.1


def test_controls_turn_the_other_way_or_rest(bend):
    assert bend.reversed().omega_rad_s.tolist() == [-3.0, -4.0, -2.0]
    assert bend.stopped().omega_rad_s.tolist() == [0.0, 0.0, 0.0]
    assert np.array_equal(bend.stopped().center_px, bend.center_px)
    assert not bend.stopped().schedule(8000).coefficients.any()


def test_mean_is_taken_over_time_and_not_over_rows(bend):
    center, omega = bend.mean()
    assert omega == pytest.approx((1000 * 3.5 + 4000 * 3.0) / 5000)
    assert center == pytest.approx((605.0, (1000 * 310 + 4000 * 315) / 5000))


def test_mean_over_a_part_holds_the_ends(bend):
    assert bend.mean(start_us=FAR_US - 100, stop_us=FAR_US - 50) == ((600.0, 300.0), 3.0)
    assert bend.mean(start_us=FAR_US + 250, stop_us=FAR_US + 250) == ((602.5, 305.0), 3.25)
    assert bend.mean(start_us=FAR_US, stop_us=FAR_US + 1000)[1] == pytest.approx(3.5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"t_us": np.array([], np.int64)}, "K ≥ 1"),
        ({"t_us": np.array([0.0, 1.0])}, "integers"),
        ({"t_us": np.array([5, 5])}, "row 1 has 5 µs after 5 µs"),
        ({"t_us": np.array([0, (1 << 60) + 1])}, "t_us must lie within"),
        ({"t_us": np.array([0, 1 << 63], np.uint64)}, "t_us must lie within"),
        ({"center_px": np.zeros((2, 3))}, "center_px must be float64"),
        ({"center_px": np.array([[0, 0], [0, np.nan]])}, "row 1 has"),
        ({"omega_rad_s": np.array([0.0, np.inf])}, "omega_rad_s must be finite.*row 1"),
        ({"omega_rad_s": np.array([0.0, 2e6])}, "within ±1e"),
        ({"omega_rad_s": np.array(["1", "2"])}, "numbers"),
    ],
)
def test_broken_columns_are_refused(change, message):
    columns = {"t_us": np.array([0, 1]), "center_px": np.zeros((2, 2)), "omega_rad_s": np.zeros(2)}
    with pytest.raises(ValueError, match=message):
        RotationTrajectory(**{**columns, **change})


def test_columns_are_copies_and_read_only():
    given_times = np.array([1, 2])
    trajectory = RotationTrajectory(t_us=given_times, center_px=np.zeros((2, 2)), omega_rad_s=np.zeros(2))
    given_times[0] = 99
    assert trajectory.t_us.tolist() == [1, 2]
    with pytest.raises(ValueError, match="read-only"):
        trajectory.omega_rad_s[0] = 1.0


@pytest.mark.parametrize("arguments", [{"horizon_us": -1}, {"horizon_us": 1, "step_us": 0}])
def test_schedules_that_make_no_sense_are_refused(bend, arguments):
    with pytest.raises(ValueError, match="must"):
        bend.schedule(**arguments)


def test_a_schedule_that_ends_before_it_starts_is_refused(bend):
    with pytest.raises(ValueError, match="must not lie before"):
        bend.schedule(8000, start_us=FAR_US + 2000, stop_us=FAR_US + 1000)
