"""Check what a turning camera sees: the same world, moved as its rates say, and the events of that."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.events import EGO, MOVER, NOISE, Events
from tiegocancel.scene import (
    CameraMotionConfig,
    CameraSceneConfig,
    MoverConfig,
    SensorConfig,
    WallConfig,
    photograph,
    simulate_camera,
)
from tiegocancel.scene.wall import paint_wall
from tiegocancel.scene.world_stage import WorldStage

ALONE = MoverConfig(enabled=False)
QUIET = SensorConfig(noise_hz=0.0)


def small(**settings):
    """A scene of 160×120 px, quick to paint and to simulate."""
    return CameraSceneConfig(width=160, height=120, focal_px=300.0, **settings)


def recorded(config, duration_s=0.1, **options):
    parts = [Events.empty(config.width, config.height, labelled=True)]
    return Events.concatenate([*parts, *simulate_camera(config, duration_s=duration_s, **options)])


def columns(events):
    return np.stack([events.t, events.x, events.y, events.p, events.label]).astype(np.int64)


def moved(config, x, y, omega, delay_s):
    """Return where pixels are seen after the camera has turned by small constant rates."""
    cx, cy = config.principal_px
    ray = np.stack([(x - cx) / config.focal_px, (y - cy) / config.focal_px, np.ones(len(x))], -1)
    angle = np.linalg.norm(omega) * delay_s
    axis = np.asarray(omega) / np.linalg.norm(omega)
    # Rodrigues, of the inverse turn: the world turns against the camera.
    turned = (
        ray * np.cos(angle) - np.cross(axis, ray) * np.sin(angle) + np.outer(ray @ axis, axis) * (1.0 - np.cos(angle))
    )
    return config.focal_px * turned[:, 0] / turned[:, 2] + cx, config.focal_px * turned[:, 1] / turned[:, 2] + cy


def test_the_image_moves_as_the_rates_say():
    from scipy.ndimage import map_coordinates

    config = small(mover=ALONE, motion=CameraMotionConfig(roll_drift_rad_s=1.0))
    omega = config.motion.omega_at(np.array([0.21]))[0]
    before, after = photograph(config, time_s=0.2), photograph(config, time_s=0.22)
    y, x = (grid.reshape(-1) for grid in np.mgrid[10:110, 10:150])
    ahead_x, ahead_y = moved(config, x, y, omega, 0.02)
    assert np.hypot(ahead_x - x, ahead_y - y).max() > 2.0
    places = {"true": (ahead_x, ahead_y), "none": (x, y), "back": (2 * x - ahead_x, 2 * y - ahead_y)}
    error = {
        name: np.std(map_coordinates(after, [place_y, place_x], order=3) - before[y, x])
        for name, (place_x, place_y) in places.items()
    }
    assert error["true"] < 0.005
    assert error["none"] > 4.0 * error["true"]
    assert error["back"] > error["none"]


def test_a_full_turn_shows_the_first_image_again_and_no_wall_has_a_seam():
    config = small(
        mover=ALONE, motion=CameraMotionConfig(pan_rad_s=0.0, tilt_rad_s=0.0, roll_rad_s=0.0, pan_drift_rad_s=1.0)
    )
    first, again = photograph(config), photograph(config, time_s=2.0 * np.pi)
    np.testing.assert_allclose(again, first, atol=2e-3)
    corner = photograph(config, time_s=0.25 * np.pi)
    # Two walls meet in the middle, at 79.5 px.
    assert np.abs(np.diff(corner[:, 78:82], axis=1)).max() < 0.02
    assert np.isfinite(corner).all()
    assert corner.std() > 0.03


@pytest.mark.parametrize("drift", [{"pan_drift_rad_s": 1.0}, {"tilt_drift_rad_s": -1.0}, {"roll_drift_rad_s": 2.0}])
def test_the_image_never_jumps_on_its_way_around(drift):
    motion = CameraMotionConfig(pan_rad_s=0.0, tilt_rad_s=0.0, roll_rad_s=0.0, **drift)
    stage = WorldStage(small(mover=ALONE, motion=motion))
    pixels = np.arange(0, 160 * 120, 97, dtype=np.int32)
    # A two-thousandth of a radian is 0.6 px in the middle and no more than 1.2 px anywhere.
    levels = stage.look(pixels, np.linspace(0.0, 6.3, 3151)).levels
    assert np.abs(np.diff(levels, axis=1)).max() < 0.5
    assert np.mean(np.ptp(levels, axis=1) > 0.3) > 0.8


def test_the_wall_is_rich_in_edges_and_soft():
    wall = np.exp(paint_wall(WallConfig(), 300.0))
    assert wall.shape[0] == wall.shape[1]
    slope = np.hypot(*np.gradient(wall)) * 2.0
    assert np.mean(slope > 0.03) > 0.2
    # The lens's blur bounds the slope: a step of (paper − ink) over √(2π) deviations of it, in px.
    assert slope.max() < (0.9 - 0.36) / (np.sqrt(2.0 * np.pi) * 0.8) * 1.3
    border = np.concatenate([wall[0], wall[-1], wall[:, 0], wall[:, -1]])
    assert np.ptp(border) < 0.02


def test_one_seed_hangs_one_set_of_pages():
    first, again = (paint_wall(WallConfig(), 100.0) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    assert (first != paint_wall(WallConfig(pattern_seed=4), 100.0)).any()


def test_events_are_sorted_labelled_and_repeatable():
    first, again, other = (recorded(small(), seed=seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(columns(first), columns(again))
    assert first.t.size != other.t.size or (columns(first) != columns(other)).any()
    t, x, y, p, label = columns(first)
    assert (np.lexsort((label, p, x, y, t)) == np.arange(len(t))).all()
    assert (t[0] >= 0, t[-1] < 100_000) == (True, True)
    assert set(label.tolist()) == {EGO, MOVER, NOISE}


def test_a_longer_recording_begins_with_the_shorter_one():
    config = small(motion=CameraMotionConfig(roll_rad_s=20.0, fastest_hz=8.0))
    assert len({config.step_us(start_s) for start_s in np.linspace(0.0, 0.2, 9)}) > 3
    long = recorded(config, 0.2, seed=1, start_us=500)
    for duration_s in (0.0004, 0.0632, 0.15):
        short = recorded(config, duration_s, seed=1, start_us=500)
        np.testing.assert_array_equal(columns(short), columns(long.between(500, 500 + round(duration_s * 1e6))))


def test_a_camera_at_rest_sees_the_mover_only():
    config = small(sensor=QUIET, motion=CameraMotionConfig(rest_s=0.1))
    events = recorded(config, 0.2)
    rest = events.t < 100_000
    assert set(events.label[rest].tolist()) == {MOVER}
    assert np.mean(events.label[~rest] == EGO) > 0.5
    assert len(recorded(small(sensor=QUIET, mover=ALONE, motion=CameraMotionConfig(rest_s=0.1)), 0.1)) == 0


def test_every_pixel_that_changes_is_listed():
    for rest_s in (0.0, 10.0):
        stage = WorldStage(small(motion=CameraMotionConfig(rest_s=rest_s)))
        time_s = np.linspace(0.3, 0.32, 11)
        view = stage.look(np.arange(160 * 120, dtype=np.int32), time_s)
        changed = np.flatnonzero((np.ptp(view.levels, axis=1) > 0) | view.covered.any(axis=1))
        listed = stage.changing(time_s)
        assert len(changed) > 100
        assert set(changed.tolist()) <= set(listed.tolist())
        assert (len(listed) < 160 * 120) == (rest_s > 0.0)


def test_the_true_motion_gathers_events_on_their_edges():
    config = small(mover=ALONE, sensor=QUIET, motion=CameraMotionConfig(roll_drift_rad_s=4.0))
    events = recorded(config, 0.03)
    omega = config.motion.omega_at(np.array([0.015]))[0]
    assert len(events) > 2000

    def sharpness(factor):
        """Sum of squares of the image of events that were moved to the end."""
        delay_s = (30_000 - events.t) * 1e-6
        x, y = np.empty(len(events)), np.empty(len(events))
        for part in np.array_split(np.arange(len(events)), 60):
            x[part], y[part] = moved(config, events.x[part], events.y[part], factor * omega, delay_s[part].mean())
        inside = (x > 0) & (x < 159) & (y > 0) & (y < 119)
        sign = np.where(events.p > 0, 1.0, -1.0)
        image = np.histogram2d(y[inside], x[inside], bins=(60, 80), range=((0, 120), (0, 160)), weights=sign[inside])[0]
        return np.sum(image**2) / inside.sum()

    assert sharpness(1.0) > 1.5 * sharpness(0.01)
    assert sharpness(1.0) > 2.0 * sharpness(-1.0)


def test_no_time_gives_no_events_and_bad_spans_are_refused():
    assert list(simulate_camera(small(), duration_s=0.0)) == []
    with pytest.raises(ValueError, match="duration_s must be from 0"):
        simulate_camera(small(), duration_s=float("inf"))
    with pytest.raises(ValueError, match="seed must be from 0"):
        simulate_camera(small(), duration_s=0.1, seed=-1)


@pytest.mark.slow
def test_the_default_rate_is_that_of_a_hand_held_camera():
    events = recorded(CameraSceneConfig(), 1.0)
    shares = np.bincount(events.label, minlength=3) / len(events)
    assert 1e6 < len(events) < 8e6
    assert 0.4 < events.p.mean() < 0.6
    assert 0.005 < shares[MOVER] < 0.1
