"""Check the turning camera against a cloud of far points, and what its affine schedule costs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tiegocancel import CameraIntrinsics, CameraTrajectory, RotationTrajectory
from tiegocancel.motion import Trajectory
from tiegocancel.motion.camera import OUTSIDE_PX
from tiegocancel.motion.turning import rotation_matrix

WIDTH, HEIGHT = 346, 260
PINHOLE = CameraIntrinsics(fx=250.0, fy=248.0, cx=170.5, cy=131.0, width=WIDTH, height=HEIGHT)
BARREL = CameraIntrinsics(
    fx=250.0, fy=248.0, cx=170.5, cy=131.0, distortion=(-0.35, 0.12, 1e-3, -2e-3), width=WIDTH, height=HEIGHT
)
FISHEYE = CameraIntrinsics(
    fx=120.0, fy=119.0, cx=170.5, cy=131.0, model="equidistant", distortion=(-0.01, 0.002), width=WIDTH, height=HEIGHT
)
OMEGA = st.lists(st.floats(-6, 6), min_size=3, max_size=3)


def pixels(count, seed=0):
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(0, 50_000, count))
    return t, rng.integers(0, WIDTH, count).astype(np.uint16), rng.integers(0, HEIGHT, count).astype(np.uint16)


@given(vector=st.lists(st.floats(-50, 50), min_size=3, max_size=3))
def test_rotation_matrices_are_those_of_scipy(vector):
    found = rotation_matrix(np.array([vector]))[0]
    assert found == pytest.approx(Rotation.from_rotvec(vector).as_matrix(), abs=1e-13)


def test_a_point_cloud_around_a_turning_camera_moves_as_predicted():
    # The world stands still; the camera's attitude turns by Ω about its own axes in a thousand small steps.
    omega, horizon_s, steps = np.array([0.7, -1.1, 2.3]), 0.05, 1000
    world = np.random.default_rng(1).normal(size=(60, 3)) * 3 + [0, 0, 10]
    before = Rotation.from_euler("xyz", [0.3, -0.2, 0.5])
    after = before
    for _ in range(steps):
        after = after * Rotation.from_rotvec(omega * horizon_s / steps)
    seen, later = before.inv().apply(world), after.inv().apply(world)
    front = (seen[:, 2] > 1) & (later[:, 2] > 1)
    assert front.sum() > 20
    seen, later = seen[front], later[front]
    x, y = PINHOLE.pixels(seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2])
    expected = PINHOLE.pixels(later[:, 0] / later[:, 2], later[:, 1] / later[:, 2])
    camera = CameraTrajectory.constant(omega, intrinsics=PINHOLE)
    found = camera.places(np.zeros(len(x), np.int64), x, y, 50_000)
    assert np.allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("omega", "direction"), [((0, 1, 0), (-1, 0)), ((1, 0, 0), (0, 1)), ((0, -1, 0), (1, 0)), ((-1, 0, 0), (0, -1))]
)
def test_looking_right_moves_the_image_left_and_looking_down_moves_it_up(omega, direction):
    # About the axis that points down, a right-handed turn takes z towards x: the camera looks right. About the axis
    # that points right it takes y towards z, and so z towards −y: the camera looks up, and the image goes down.
    camera = CameraTrajectory.constant(omega, intrinsics=PINHOLE)
    x, y = camera.places(np.zeros(1, np.int64), [PINHOLE.cx], [PINHOLE.cy], 1000)
    moved = np.array([x[0] - PINHOLE.cx, y[0] - PINHOLE.cy])
    assert moved == pytest.approx(np.array(direction) * [0.25, 0.248], abs=1e-6)


@given(spin=st.floats(-50, 50, allow_subnormal=False), horizon_us=st.integers(0, 40_000))
@settings(max_examples=30)
def test_turning_about_the_optical_axis_is_the_rotation_with_the_other_sign(spin, horizon_us):
    square = CameraIntrinsics(fx=250.0, fy=250.0, cx=170.5, cy=131.0, width=WIDTH, height=HEIGHT)
    camera = CameraTrajectory.constant((0, 0, spin), intrinsics=square)
    rotation = RotationTrajectory.constant(center_px=(170.5, 131.0), omega_rad_s=-spin)
    assert camera.mean() == (pytest.approx((170.5, 131.0)), -spin) or spin == 0
    t, x, y = pixels(50)
    theta = -spin * horizon_us * 1e-6
    exact = 170.5 + np.cos(theta) * (x - 170.5) - np.sin(theta) * (y - 131.0)
    assert (np.abs(camera.predict(t, x, y, horizon_us)[0] - exact) <= 0.5 + 1e-6).all()
    units = camera.schedule(horizon_us).coefficients - rotation.schedule(horizon_us).coefficients
    assert np.abs(units).max() <= 1


@given(omega=OMEGA, horizon_us=st.integers(0, 30_000), lens=st.sampled_from([PINHOLE, BARREL, FISHEYE]))
@settings(max_examples=40)
def test_schedule_stays_within_its_stated_error(omega, horizon_us, lens):
    camera = CameraTrajectory.constant(omega, intrinsics=lens)
    worst, rms = camera.approximation_error(horizon_us)
    assert rms <= worst
    t, x, y = pixels(400)
    exact_x, exact_y = camera.places(t, x, y, horizon_us)
    ahead_x, ahead_y = camera.schedule(horizon_us).predict(t, x, y)
    miss = np.hypot(ahead_x - exact_x, ahead_y - exact_y)
    # Rounding to whole pixels comes on top, and the true maximum may lie between the places that were measured.
    assert np.nanmax(miss) <= 1.01 * worst + np.sqrt(0.5) + 1e-6


def test_changing_motion_stays_within_its_stated_error_between_entries():
    rng = np.random.default_rng(4)
    camera = CameraTrajectory(t_us=np.arange(6) * 10_000, omega_rad_s=rng.normal(size=(6, 3)) * 3, intrinsics=BARREL)
    worst, _ = camera.approximation_error(10_000, step_us=2000)
    held, _ = camera.approximation_error(10_000, step_us=100)
    assert held < worst
    t, x, y = pixels(5000)
    exact_x, exact_y = camera.places(t, x, y, 10_000)
    ahead_x, ahead_y = camera.schedule(10_000, step_us=2000).predict(t, x, y)
    assert np.nanmax(np.hypot(ahead_x - exact_x, ahead_y - exact_y)) <= 1.01 * worst + np.sqrt(0.5)


@given(omega=OMEGA)
@settings(max_examples=20)
def test_no_other_affine_map_nearby_is_better(omega):
    assume(max(map(abs, omega)) > 0.1)
    camera = CameraTrajectory.constant(omega, intrinsics=PINHOLE)
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0, WIDTH - 1, 15), np.linspace(0, HEIGHT - 1, 15)))
    exact = camera.places(np.zeros(len(x), np.int64), x, y, 20_000)
    best = camera.schedule(20_000).coefficients[0] / 65_536

    def cost(row):
        a, b, c, d, e, f = row
        return np.sum(np.square(x + a * x + b * y + c - exact[0]) + np.square(y + d * x + e * y + f - exact[1]))

    steps = np.array([1e-3, 1e-3, 0.1] * 2)
    for index in range(6):
        for sign in (-1, 1):
            other = best.copy()
            other[index] += sign * steps[index]
            assert cost(best) < cost(other)


@pytest.mark.parametrize("lens", [PINHOLE, BARREL, FISHEYE])
@pytest.mark.parametrize("interpolation", ["linear", "causal"])
def test_prediction_of_an_event_does_not_depend_on_its_chunk(lens, interpolation):
    rng = np.random.default_rng(2)
    camera = CameraTrajectory(
        t_us=np.arange(5) * 10_000,
        omega_rad_s=rng.normal(size=(5, 3)) * 5,
        omega_dot_rad_s2=rng.normal(size=(5, 3)) * 50,
        intrinsics=lens,
        interpolation=interpolation,
    )
    t, x, y = pixels(30 * 31)
    whole = camera.predict(t, x, y, 8000)
    start = 0
    for length in range(1, 31):
        rows = slice(start, start + length)
        part = camera.predict(t[rows], x[rows], y[rows], 8000)
        assert all(np.array_equal(mine, all_of[rows]) for mine, all_of in zip(part, whole, strict=True))
        start += length


def test_what_turns_out_of_sight_is_outside_every_sensor():
    camera = CameraTrajectory.constant((0, np.pi, 0), intrinsics=PINHOLE)
    x = np.array([10, 170], np.uint16)
    ahead_x, ahead_y = camera.predict(np.zeros(2, np.int64), x, x, 1_000_000)
    assert ahead_x.tolist() == ahead_y.tolist() == [OUTSIDE_PX] * 2
    with pytest.raises(ValueError, match="too little of the sensor"):
        camera.schedule(1_000_000)


def test_corners_beyond_the_lens_are_left_out_of_the_fit():
    # The field of this lens ends at a radius of 124 px, inside the corners.
    lens = CameraIntrinsics(fx=250.0, fy=250.0, cx=173.0, cy=130.0, distortion=(-0.9,), width=WIDTH, height=HEIGHT)
    camera = CameraTrajectory.constant((0.5, 0.5, 1), intrinsics=lens)
    corner = np.zeros(1, np.uint16)
    assert camera.predict(np.zeros(1, np.int64), corner, corner, 10_000)[0].tolist() == [OUTSIDE_PX]
    worst, rms = camera.approximation_error(10_000)
    assert 0 < rms < worst < 20


def test_error_grows_with_the_horizon_and_is_written_into_a_note():
    camera = CameraTrajectory.constant((1, 1, 0), intrinsics=PINHOLE)
    short, long = camera.approximation_error(2000), camera.approximation_error(20_000)
    assert short.max_px < long.max_px
    small = camera.approximation_error(20_000, 100, 80)
    assert small.max_px != long.max_px
    note = camera.reported(20_000).notes[-1]
    assert f"at most {long.max_px:.2f} px off, rms {long.rms_px:.2f} px, over 346 × 260 px" in note


def test_it_is_a_trajectory_with_its_controls():
    camera = CameraTrajectory(t_us=[0, 1000], omega_rad_s=[[1, 2, 3], [3, 2, 1]], intrinsics=PINHOLE)
    assert isinstance(camera, Trajectory)
    assert np.array_equal(camera.reversed().omega_rad_s, -camera.omega_rad_s)
    assert not camera.stopped().schedule(8000).coefficients.any()
    assert camera.described(start_us=0, stop_us=1000).startswith("camera turns (+2.0000, +2.0000, +2.0000) rad/s")
    center, omega = camera.mean()
    assert (center, omega) == (pytest.approx((170.5 + 250, 131.0 + 248)), pytest.approx(-2.0))
    pan = CameraTrajectory.constant((0, 1, 0), intrinsics=PINHOLE)
    assert pan.mean() == (None, 0.0)


def test_the_axis_stays_where_the_mean_says():
    camera = CameraTrajectory.constant((0.4, -0.3, 2), intrinsics=BARREL)
    center, _ = camera.mean()
    x, y = camera.places(np.zeros(1, np.int64), [center[0]], [center[1]], 40_000)
    assert (x[0], y[0]) == pytest.approx(center, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"omega_rad_s": np.zeros((2, 3))}, "omega_rad_s must be float64"),
        ({"omega_rad_s": [[0, np.inf, 0]]}, "omega_rad_s must be finite.*row 0"),
        ({"omega_dot_rad_s2": [[0, 0]]}, "omega_dot_rad_s2 must be"),
        ({"interpolation": "spline"}, "linear or causal, not 'spline'"),
        ({"intrinsics": CameraIntrinsics(fx=1.0, fy=1.0, cx=0.0, cy=0.0)}, "width must be at least 1 px"),
    ],
)
def test_broken_columns_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        CameraTrajectory(**{"t_us": [0], "omega_rad_s": np.zeros((1, 3)), "intrinsics": PINHOLE, **change})
