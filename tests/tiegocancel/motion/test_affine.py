"""Check the affine motion against the rotation that it contains, its parts, and the canceller that runs it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import AffineTrajectory, CancelConfig, Canceller, Events, RotationTrajectory
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.motion import Trajectory
from tiegocancel.motion.times import EXTRAPOLATE_US

FAR_US = 1 << 40
CENTER = st.tuples(st.floats(-2000, 3000), st.floats(-2000, 3000))


def events(count, seed=0):
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(FAR_US - 1000, FAR_US + 60_000, count))
    return t, rng.integers(0, 1280, count).astype(np.uint16), rng.integers(0, 720, count).astype(np.uint16)


def pair(center, times, omegas, slopes=None):
    """Return the same motion twice: as a rotation and as an affine field."""
    t_us, omega = np.array(times, np.int64) + FAR_US, np.array(omegas, np.float64)
    causal = slopes is not None
    rotation = RotationTrajectory(
        t_us=t_us,
        center_px=np.tile(np.array(center, np.float64), (len(t_us), 1)),
        omega_rad_s=omega,
        omega_dot_rad_s2=np.array(slopes, np.float64) if causal else None,
        interpolation="causal" if causal else "linear",
    )
    turning = AffineTrajectory.from_parts(center, roll_rad_s=omega, t_us=t_us)
    if causal:
        slope = AffineTrajectory.from_parts(center, roll_rad_s=np.array(slopes, np.float64), t_us=t_us)
        turning = AffineTrajectory(t_us=t_us, rates=turning.rates, rates_dot=slope.rates, interpolation="causal")
    return rotation, turning


def agree(rotation, affine, horizon_us):
    """Compare the float paths but where rounding decides, and the schedules to one unit of 2^-16."""
    t, x, y = events(300)
    cx, cy, theta = rotation.turns(t, horizon_us)
    exact_x = cx + np.cos(theta) * (x - cx) - np.sin(theta) * (y - cy)
    exact_y = cy + np.sin(theta) * (x - cx) + np.cos(theta) * (y - cy)
    for found, exact in zip(affine.predict(t, x, y, horizon_us), (exact_x, exact_y), strict=True):
        assert (np.abs(found - exact) <= 0.5 + 1e-6).all()
    fixed, expected = affine.schedule(horizon_us), rotation.schedule(horizon_us)
    assert np.array_equal(fixed.t_us, expected.t_us)
    assert fixed.horizon_us == expected.horizon_us
    assert np.abs(fixed.coefficients - expected.coefficients).max() <= 1


@given(
    center=CENTER,
    omegas=st.lists(st.floats(-200, 200), min_size=3, max_size=3),
    horizon_us=st.integers(0, 50_000),
)
@settings(max_examples=40)
def test_a_roll_about_a_point_is_the_rotation(center, omegas, horizon_us):
    agree(*pair(center, [0, 5000, 40_000], omegas), horizon_us)


@given(center=CENTER, slopes=st.lists(st.floats(-500, 500), min_size=2, max_size=2), horizon_us=st.integers(0, 50_000))
@settings(max_examples=40)
def test_a_causal_roll_is_the_causal_rotation(center, slopes, horizon_us):
    agree(*pair(center, [0, 5000], [3.0, -20.0], slopes), horizon_us)


@given(rates=st.lists(st.floats(-100, 100), min_size=6, max_size=6), anchor=CENTER)
def test_parts_make_the_rates_and_come_back(rates, anchor):
    motion = AffineTrajectory.constant(rates)
    parts = motion.parts(anchor)
    again = AffineTrajectory.from_parts(
        anchor,
        pan_px_s=parts.pan_px_s,
        roll_rad_s=parts.roll_rad_s,
        zoom_1_s=parts.zoom_1_s,
        shear_1_s=parts.shear_1_s,
    )
    assert again.rates[0] == pytest.approx(motion.rates[0], abs=1e-9)


@pytest.mark.parametrize(
    ("part", "expected"),
    [
        ({"pan_px_s": (10, -20)}, (105.0, 40.0)),
        ({"roll_rad_s": np.pi}, (50.0, 100.0)),
        ({"zoom_1_s": 2 * np.log(3.0)}, (200.0, 50.0)),
        ({"shear_1_s": (2 * np.log(3.0), 0)}, (200.0, 50.0)),
        ({"shear_1_s": (0, 2 * np.arcsinh(0.75))}, (50 + 50 * 1.25, 50 + 50 * 0.75)),
    ],
)
def test_each_part_moves_a_point_as_its_name_says(part, expected):
    motion = AffineTrajectory.from_parts((50, 50), **part)
    a, b, c, d, e, f = motion.displacements(np.zeros(1, np.int64), 500_000)[0]
    assert (100 + a * 100 + b * 50 + c, 50 + d * 100 + e * 50 + f) == pytest.approx(expected, abs=1e-9)


def wandering(interpolation="linear", count=6, seed=1):
    rng = np.random.default_rng(seed)
    scale = np.array([3, 3, 2000, 3, 3, 2000.0])
    return AffineTrajectory(
        t_us=FAR_US + np.arange(count) * 9001,
        rates=rng.normal(size=(count, 6)) * scale,
        rates_dot=rng.normal(size=(count, 6)) * scale * 20,
        interpolation=interpolation,
    )


@pytest.mark.parametrize("motion", [wandering(), wandering("causal"), wandering(count=1)])
def test_prediction_of_an_event_does_not_depend_on_its_chunk(motion):
    t, x, y = events(40 * 41)
    whole = motion.predict(t, x, y, 8000)
    start = 0
    for length in range(1, 41):
        rows = slice(start, start + length)
        part = motion.predict(t[rows], x[rows], y[rows], 8000)
        assert all(np.array_equal(mine, all_of[rows]) for mine, all_of in zip(part, whole, strict=True))
        assert motion.at(t[rows]).tobytes() == motion.at(t)[rows].tobytes()
        start += length


def test_interpolates_linearly_and_holds_the_ends():
    motion = AffineTrajectory(t_us=[10, 20], rates=[[0, 0, 0, 0, 0, 0], [1, 2, 3, 4, 5, 6]])
    assert motion.at(np.array([-5, 10, 15, 20, 99])).tolist() == [
        [0] * 6, [0] * 6, [0.5, 1, 1.5, 2, 2.5, 3], [1, 2, 3, 4, 5, 6], [1, 2, 3, 4, 5, 6],
    ]  # fmt: skip


def test_causal_rows_use_nothing_later_and_stop_extrapolating():
    motion = AffineTrajectory(
        t_us=[0, 10_000], rates=[[0] * 6, [9] * 6], rates_dot=[[100] * 6, [0] * 6], interpolation="causal"
    )
    assert motion.at(np.array([-10, 0, 9_999, 10_000]))[:, 0] == pytest.approx([0, 0, 0.9999, 9])
    alone = AffineTrajectory(t_us=[0], rates=[[0] * 6], rates_dot=[[100] * 6], interpolation="causal")
    late = alone.at(np.array([EXTRAPOLATE_US, 10 * EXTRAPOLATE_US]))[:, 0]
    assert late == pytest.approx([EXTRAPOLATE_US * 1e-4] * 2)


@pytest.mark.parametrize("motion", [wandering(), wandering("causal")])
def test_schedule_and_float_path_agree_at_the_entries(motion):
    schedule = motion.schedule(8000, step_us=500)
    rng = np.random.default_rng(2)
    x, y = (rng.integers(0, side, len(schedule)).astype(np.uint16) for side in (1280, 720))
    exact = motion.predict(schedule.t_us, x, y, 8000)
    for one, other in zip(exact, schedule.predict(schedule.t_us, x, y, 8000), strict=True):
        assert np.abs(one - other).max() <= 1
        assert (one != other).mean() < 0.1


@given(seed=st.integers(0, 1 << 31), count=st.integers(1, 300), step_us=st.integers(100, 5000))
@settings(max_examples=15)
def test_kernel_runs_an_affine_schedule_as_the_plain_model_does(seed, count, step_us):
    rng = np.random.default_rng(seed)
    motion = AffineTrajectory.from_parts(
        (12, 9),
        pan_px_s=rng.normal(size=(4, 2)) * 1000,
        roll_rad_s=rng.normal(size=4) * 30,
        zoom_1_s=rng.normal(size=4) * 30,
        shear_1_s=rng.normal(size=(4, 2)) * 30,
        t_us=np.arange(4) * 4000,
    )
    stream = Events(
        np.sort(rng.integers(0, 15_000, count)),
        rng.integers(0, 24, count),
        rng.integers(0, 18, count),
        rng.integers(0, 2, count),
        24,
        18,
    )
    config = CancelConfig(horizon_us=3000, tolerance_us=1000, tolerance_px=2.0, ring_capacity=64)
    for model in (motion, motion.schedule(3000, step_us=step_us)):
        fast = Canceller(config, model, width=24, height=18)
        plain = OracleCanceller(config, model, width=24, height=18)
        one, other = fast.process(stream), plain.process(stream)
        assert np.array_equal(one.source, other.source)
        assert dict(fast.counters) == dict(plain.counters)


def test_it_is_a_trajectory_with_its_controls():
    motion = wandering("causal")
    assert isinstance(motion, Trajectory)
    assert np.array_equal(motion.reversed().rates, -motion.rates)
    assert np.array_equal(motion.reversed().rates_dot, -motion.rates_dot)
    assert not motion.stopped().schedule(8000).coefficients.any()
    assert (motion.stopped().source, motion.noted("slow").notes) == ("constant, stopped", ("slow",))


def test_mean_is_the_point_at_rest_and_the_roll():
    motion = AffineTrajectory.from_parts((40, 30), roll_rad_s=[1.0, 3.0], zoom_1_s=0.5, t_us=[0, 1000])
    center, roll = motion.mean()
    assert center == pytest.approx((40, 30))
    assert roll == pytest.approx(2.0)
    assert motion.mean(start_us=-5, stop_us=0)[1] == pytest.approx(1.0)
    assert AffineTrajectory.from_parts((0, 0), pan_px_s=(5, 0)).mean() == (None, 0.0)


def test_description_names_what_rests_or_how_it_pans():
    turning = AffineTrajectory.from_parts((40, 30), roll_rad_s=2.0)
    assert turning.described(start_us=0, stop_us=9).startswith("at rest in (40.0, 30.0) px, ω +2.0000 rad/s, zoom")
    panning = AffineTrajectory.from_parts((40, 30), pan_px_s=(5, -7))
    assert panning.described(start_us=0, stop_us=9).startswith("pan (+5.0, -7.0) px/s at (0, 0)")


def test_places_beyond_all_bounds_stay_integers():
    motion = AffineTrajectory.constant([30, 0, 1e13, 0, 30, -1e13])
    x = np.array([7], np.uint16)
    assert [int(place[0]) for place in motion.predict(np.zeros(1, np.int64), x, x, 10**6)] == [1 << 62, -(1 << 62)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"t_us": [5, 5]}, "row 1 has 5 µs after 5 µs"),
        ({"rates": np.zeros((2, 5))}, r"rates must be float64\[2, 6\]"),
        ({"rates": [[0] * 6, [0, 0, np.nan, 0, 0, 0]]}, "rates must be finite.*row 1"),
        ({"rates": [[0, 2e6, 0, 0, 0, 0], [0] * 6]}, r"within ±1e\+06: row 0"),
        ({"rates_dot": np.zeros((1, 6))}, "rates_dot must be float64"),
        ({"rates": [["1"] * 6] * 2}, "numbers"),
        ({"interpolation": "spline"}, "linear or causal, not 'spline'"),
    ],
)
def test_broken_columns_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        AffineTrajectory(**{"t_us": [0, 1], "rates": np.zeros((2, 6)), **change})
