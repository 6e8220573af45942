"""Check the library of scenes: every name makes a labelled recording with the motion that it states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tiegocancel.errors import ConfigError
from tiegocancel.events import EGO, MOVER, NOISE, Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.scene import SCENES, CameraSceneConfig, SceneConfig, scene_named, simulate, true_motion

SMALL = {"disc": {"width": 320, "height": 180}, "camera": {"width": 160, "height": 120, "focal_px": 300.0}}


def small(name, **table):
    return scene_named(name, {**SMALL[SCENES[name].kind], **table})


def recorded(config, duration_s, **options):
    parts = [Events.empty(config.width, config.height, labelled=True)]
    return Events.concatenate([*parts, *simulate(config, duration_s=duration_s, **options)])


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_has_all_three_labels_and_a_line_of_description(name):
    events = recorded(small(name), 0.1, seed=1)
    assert set(events.label.tolist()) == {EGO, MOVER, NOISE}
    assert 20 < len(SCENES[name].about) < 110
    assert "\n" not in SCENES[name].about


@pytest.mark.parametrize("name", ["disc", "fine", "ramp", "stop-and-go", "pan"])
def test_the_stated_motion_cancels_more_of_the_scene_than_none(name):
    config = small(name, mover={"enabled": False})
    duration_s, horizon_us = 0.2, 20_000
    events = recorded(config, duration_s, seed=1)
    motion = true_motion(config, duration_s=duration_s)
    setting = CancelConfig(horizon_us=horizon_us, tolerance_us=3000, ring_capacity=1 << 17)
    late = (events.t > 30_000) & (events.label == EGO)
    shares = []
    for trajectory in (motion, motion.stopped()):
        schedule = trajectory.schedule(horizon_us, start_us=0, stop_us=200_000)
        canceller = Canceller(setting, schedule, width=config.width, height=config.height)
        shares.append(canceller.process(events).suppressed[late].mean())
    assert shares[0] > 0.55
    assert shares[0] > shares[1] + 0.15


def test_the_stated_motion_of_a_ramp_has_its_acceleration_and_a_steady_one_none():
    ramp, steady = (true_motion(scene_named(name), duration_s=0.05, start_us=7) for name in ("ramp", "disc"))
    np.testing.assert_allclose(ramp.omega_dot_rad_s2, 10.0, rtol=1e-6)
    assert (ramp.interpolation, steady.interpolation, len(steady.t_us)) == ("causal", "linear", 2)
    assert ramp.t_us[0] == 7


def test_the_two_first_scenes_are_the_defaults():
    assert scene_named("disc") == SceneConfig()
    assert scene_named("camera") == CameraSceneConfig()


def test_settings_lie_on_top_of_the_scenes_own_and_leave_the_rest():
    config = scene_named("noisy", {"width": 320, "height": 180, "sensor": {"noise_hz": 3.0}, "rig": {"omega_rad_s": 9}})
    assert isinstance(config, SceneConfig)
    assert (config.width, config.sensor.noise_hz, config.sensor.hot_pixels) == (320, 3.0, 200)
    assert (config.rig.omega_rad_s, config.rig.ink_reflectance) == (9.0, 0.64)
    assert scene_named("noisy") == scene_named("noisy", {})


def test_markers_alone_make_few_events_at_a_few_places():
    events = recorded(scene_named("markers", {"mover": {"enabled": False}, "sensor": {"noise_hz": 0.0}}), 0.05, seed=1)
    rig = SceneConfig().rig
    away = np.hypot(events.x - rig.center_px[0], events.y - rig.center_px[1])
    assert len(events) > 1000
    ring = np.abs(away - 0.8 * rig.radius_px) < 0.05 * rig.radius_px
    assert np.mean(ring | (away < 0.05 * rig.radius_px)) > 0.99


def test_a_longer_scene_with_two_movers_begins_with_the_shorter_one():
    config = small("two-movers")
    long, short = recorded(config, 0.08, seed=2), recorded(config, 0.0301, seed=2)
    early = long.between(0, 30_100)
    for name in ("t", "x", "y", "p", "label"):
        np.testing.assert_array_equal(getattr(short, name), getattr(early, name))


def test_a_companion_that_moves_with_the_disc_is_suppressed_with_it_and_a_faster_one_is_not():
    shares = []
    for relative_px_s in (0.0, 400.0):
        table = {
            "companion": {"relative_px_s": relative_px_s},
            "mover": {"enabled": False},
            "sensor": {"noise_hz": 0.0},
        }
        config = replace(scene_named("two-movers", table), width=1280)
        events = recorded(config, 0.1, seed=1)
        schedule = true_motion(config, duration_s=0.1).schedule(20_000)
        setting = CancelConfig(horizon_us=20_000, ring_capacity=1 << 18)
        hit = Canceller(setting, schedule, width=1280, height=720).process(events).suppressed
        shares.append(hit[(events.t > 30_000) & (events.label == MOVER)].mean())
    assert shares[0] > 0.7
    assert shares[1] < 0.3


@pytest.mark.parametrize(
    ("name", "table", "message"),
    [
        ("discs", {}, "scene must be one of 'disc', .*, not 'discs'; did you mean 'disc'"),
        ("fine", {"rig": {"omega": 3}}, "scene fine \\[rig\\]: unknown key 'omega'; did you mean 'omega_rad_s'"),
        ("fine", {"rig": 3}, "rig must be RigConfig, not 3"),
        ("pan", {"rig": {}}, "unknown key 'rig'"),
        ("two-movers", {"companion": {"radius_px": 0}}, "radius_px must be a finite number above 0"),
        ("two-movers", {"companion": {"relative_px_s": 1e9}}, "relative_px_s must be a finite number"),
    ],
)
def test_unknown_names_and_wrong_settings_are_one_line(name, table, message):
    with pytest.raises(ConfigError, match=message) as caught:
        scene_named(name, table)
    assert "\n" not in str(caught.value)
