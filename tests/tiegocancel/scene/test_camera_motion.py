"""Check that the camera's rates are those of its attitude, bounded, and at rest when they should be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.config import fill
from tiegocancel.errors import ConfigError
from tiegocancel.scene import CameraMotionConfig, CameraSceneConfig, camera_truth

STILL = {"pan_rad_s": 0.0, "tilt_rad_s": 0.0, "roll_rad_s": 0.0}


def seen(motion, time_s, world):
    """Return the camera directions float64[n, 3] of a world direction."""
    return np.einsum("nji,j->ni", motion.attitude_at(time_s), world)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), rest_s=st.sampled_from([0.0, 0.15]), drift=st.floats(-2.0, 2.0))
def test_a_far_point_moves_at_minus_omega_cross_its_direction(seed: int, rest_s: float, drift: float) -> None:
    motion = CameraMotionConfig(motion_seed=seed, rest_s=rest_s, roll_drift_rad_s=drift, pan_drift_rad_s=-drift)
    time_s = np.linspace(0.0, 0.5, 5001)
    track = seen(motion, time_s, np.array([0.2, -0.1, 0.97]))
    moved = np.gradient(track, time_s, axis=0)
    stated = -np.cross(motion.omega_at(time_s), track)
    np.testing.assert_allclose(moved[1:-1], stated[1:-1], atol=1e-4)


@pytest.mark.parametrize(
    ("drift", "omega", "toward"),
    [
        ({"pan_drift_rad_s": 0.5}, (0.0, 0.5, 0.0), (-1.0, 0.0)),
        ({"tilt_drift_rad_s": 0.5}, (0.5, 0.0, 0.0), (0.0, 1.0)),
        ({"roll_drift_rad_s": 0.5}, (0.0, 0.0, 0.5), (0.0, 0.0)),
    ],
)
def test_a_positive_pan_looks_right_a_positive_tilt_up_a_positive_roll_turns_the_image_back(drift, omega, toward):
    motion = CameraMotionConfig(**STILL, **drift)
    np.testing.assert_allclose(motion.omega_at(np.array([0.0, 0.7])), [omega, omega], atol=1e-12)
    time_s = np.array([0.0, 0.01])
    # Right-handed about y, which points down, looks right: what was ahead moves left.
    ahead = np.diff(seen(motion, time_s, np.array([0.0, 0.0, 1.0])), axis=0)[0] / 0.01
    np.testing.assert_allclose(ahead[:2], 0.5 * np.asarray(toward), atol=5e-3)
    if drift.get("roll_drift_rad_s"):
        right = np.diff(seen(motion, time_s, np.array([0.6, 0.0, 0.8])), axis=0)[0] / 0.01
        np.testing.assert_allclose(right, [0.0, -0.5 * 0.6, 0.0], atol=5e-3)


@given(seed=st.integers(0, 2**32 - 1), tones=st.integers(1, 8))
def test_the_swing_is_smooth_and_never_beyond_its_bound(seed: int, tones: int) -> None:
    motion = CameraMotionConfig(motion_seed=seed, tones=tones, pan_rad_s=0.0, tilt_rad_s=0.0, fastest_hz=5.0)
    omega = motion.omega_at(np.linspace(0.0, 10.0, 5001))
    assert not omega[:, :2].any()
    assert np.abs(omega[:, 2]).max() <= 1.0 + 1e-12
    assert np.abs(omega[:, 2]).max() > 0.3
    # No sine is faster than 5 Hz, so no acceleration is beyond 2π · 5 Hz · 1 rad/s.
    assert np.abs(np.diff(omega[:, 2])).max() / 0.002 <= 2.0 * np.pi * 5.0


def test_the_defaults_roll_by_up_to_one_and_pan_by_a_third_of_a_radian_a_second() -> None:
    peak = np.abs(CameraMotionConfig().omega_at(np.linspace(0.0, 20.0, 20_001))).max(axis=0)
    assert 0.7 < peak[2] <= 1.1
    assert (peak[:2] > 0.2).all()
    assert (peak[:2] < 0.4).all()


def test_a_camera_at_rest_neither_turns_nor_jumps() -> None:
    motion = CameraMotionConfig(rest_s=0.2, start_s=0.05)
    time_s = np.linspace(0.0, 0.4, 401)
    rest = time_s <= 0.2
    assert not motion.omega_at(time_s)[rest].any()
    np.testing.assert_array_equal(motion.attitude_at(time_s)[rest], np.broadcast_to(np.eye(3), (rest.sum(), 3, 3)))
    assert np.abs(motion.omega_at(time_s)[~rest]).max() > 0.3
    assert np.abs(np.diff(motion.omega_at(time_s), axis=0)).max() < 0.05


def test_the_truth_is_stated_every_millisecond_with_both_ends() -> None:
    config = CameraSceneConfig()
    t_us, omega = camera_truth(config, duration_s=0.0305, start_us=-500)
    assert t_us.tolist() == [*range(-500, 30_000, 1000), 30_000]
    np.testing.assert_array_equal(omega, config.motion.omega_at((t_us + 500) * 1e-6))
    with pytest.raises(ValueError, match="duration_s must be at least 0"):
        camera_truth(config, duration_s=float("nan"))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"motion": {"roll_rad": 1.0}}, "unknown key 'roll_rad'; did you mean 'roll_rad_s'"),
        ({"motion": {"slowest_hz": 4.0}}, "fastest_hz 3.0 must be at least slowest_hz 4.0"),
        ({"motion": {"tones": 0}}, "tones must be an integer from 1 to 16, not 0"),
        ({"gyro": {"bias_rad_s": [0.0, 1.0, 1e9]}}, "bias_rad_s must be three numbers within ±100 rad/s"),
        ({"gyro": {"bits": 64}}, "bits must be an integer from 2 to 32, not 64"),
        ({"wall": {"page_pitch_px": 1}}, "page_pitch_px must be a finite number of at least 6"),
        ({"focal_px": 5e4}, "focal_px must be a finite number of at least 10 and at most 2000"),
        ({"width": 0}, "width must be an integer from 1"),
        ({"mover": {"size": 3.0}}, "did you mean 'size_px'"),
    ],
)
def test_values_out_of_range_are_one_line_with_key_and_value(table, message) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        fill(CameraSceneConfig, table, "[camera_scene]")
    assert "\n" not in str(caught.value)


def test_tables_fill_every_part() -> None:
    table = {
        "width": 320,
        "height": 240,
        "motion": {"roll_rad_s": 2, "rest_s": 0.5},
        "gyro": {"bias_rad_s": [0.1, 0, -0.1], "time_offset_us": -2500},
        "wall": {"line_period_px": 15},
        "mover": {"enabled": False},
    }
    config = fill(CameraSceneConfig, table, "[camera_scene]")
    assert (config.motion.roll_rad_s, config.motion.rest_s, config.gyro.time_offset_us) == (2.0, 0.5, -2500)
    assert config.gyro.bias_rad_s == (0.1, 0.0, -0.1)
    assert (config.focal_px, config.principal_px) == (300.0, (159.5, 119.5))
    assert config.mover.size_px == pytest.approx(27.0)


def test_parts_of_another_kind_are_refused() -> None:
    with pytest.raises(TypeError, match="motion must be a CameraMotionConfig, not GyroConfig"):
        CameraSceneConfig(motion=CameraSceneConfig().gyro)  # type: ignore[arg-type]


@given(seed=st.integers(0, 2**32 - 1), start_s=st.floats(0.0, 20.0), x=st.integers(0, 639), y=st.integers(0, 479))
def test_no_point_of_the_image_moves_further_in_a_step_than_allowed(seed: int, start_s: float, x: int, y: int) -> None:
    config = CameraSceneConfig(
        motion=CameraMotionConfig(motion_seed=seed, roll_rad_s=3.0, pan_rad_s=1.0), mover=CameraSceneConfig().mover
    )
    step_s = config.step_us(start_s) * 1e-6
    steps = start_s + step_s * np.arange(26)
    at_start = config.motion.attitude_at(steps[:-1])
    ray = np.array([(x - 319.5) / 600.0, (y - 239.5) / 600.0, 1.0])
    later = np.einsum("nji,nj->ni", config.motion.attitude_at(steps[1:]), at_start @ ray)
    moved = 600.0 * np.hypot(later[:, 0] / later[:, 2] - ray[0], later[:, 1] / later[:, 2] - ray[1])
    assert moved.max() <= 0.5 * 1.02
