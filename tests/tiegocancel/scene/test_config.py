"""Check the settings: fitted to any sensor, filled from tables, refused with a reason."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.config import fill
from tiegocancel.errors import ConfigError
from tiegocancel.scene import MoverConfig, RigConfig, SceneConfig, SensorConfig


def test_the_defaults_are_the_rig_of_the_thesis():
    rig = SceneConfig().rig
    assert (rig.center_px, rig.radius_px, rig.omega_rad_s) == ((664.6, 336.9), 264.0, 3.6)


@pytest.mark.parametrize(("width", "height", "scale"), [(640, 360, 0.5), (320, 240, 0.25), (2560, 1440, 2.0)])
def test_lengths_left_open_fit_the_sensor(width, height, scale):
    config = SceneConfig.disc(width=width, height=height, omega_rad_s=-2.0, mover=False)
    assert config.rig.radius_px == pytest.approx(264.0 * scale)
    assert config.rig.center_px[0] - width / 2 == pytest.approx(24.6 * scale)
    assert config.rig.center_px[1] - height / 2 == pytest.approx(-23.1 * scale)
    assert config.mover.speed_px_s == pytest.approx(700.0 * scale)
    assert (config.rig.omega_rad_s, config.mover.enabled) == (-2.0, False)


def test_lengths_that_are_given_stay():
    config = SceneConfig(width=320, height=240, rig=RigConfig(center_px=(10.0, 20.0), radius_px=30.0))
    assert (config.rig.center_px, config.rig.radius_px) == ((10.0, 20.0), 30.0)
    assert config.mover.size_px == pytest.approx(27.0)


def test_nothing_is_left_open_once_the_sensor_is_known():
    for part in (SceneConfig(width=5, height=3).rig, SceneConfig(width=5, height=3).mover):
        for name in type(part).__slots__:
            value = getattr(part, name)
            for number in value if isinstance(value, tuple) else (value,):
                assert math.isfinite(number), name


def test_tables_fill_every_part():
    table = {
        "width": 320,
        "height": 240,
        "rig": {"center_px": [100, 90], "omega_rad_s": 5},
        "sensor": {"noise_hz": 1.5},
    }
    config = fill(SceneConfig, table, "[scene]")
    assert config.rig.center_px == (100.0, 90.0)
    assert (config.rig.omega_rad_s, config.sensor.noise_hz) == (5.0, 1.5)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"rig": {"radius_px": -3.0}}, "radius_px must be a finite number above 0"),
        ({"rig": {"center_px": [1.0, float("inf")]}}, "center_px must be two numbers within ±1e6"),
        ({"rig": {"center_px": [1.0, float("nan")]}}, "center_px must be two numbers within ±1e6"),
        ({"rig": {"omega_rad_s": float("nan")}}, "omega_rad_s must be a finite number"),
        ({"sensor": {"threshold_on": 0.0}}, "threshold_on must be a finite number of at least 0.01"),
        ({"sensor": {"noise_on_share": 1.2}}, "at most 1, not 1.2"),
        ({"mover": {"size": 3.0}}, "unknown key 'size'; did you mean 'size_px'"),
        ({"width": 0}, "width must be an integer from 1 to 65536, not 0"),
        ({"width": 65536, "height": 65536}, "at most 2\\^26 pixels"),
        ({"flicker_depth": 1.0}, "flicker_depth must be"),
        ({"rig": {"wobble_px": [-1.0, 2.0]}}, "wobble_px must be two numbers from 0 to 512, not"),
        ({"rig": {"wobble_px": [float("nan"), float("nan")]}}, "wobble_px must be two numbers from 0 to 512, not"),
        ({"rig": {"stop_share": 1.5}}, "stop_share must be a finite number of at least 0 and at most 1, not 1.5"),
        ({"rig": {"stop_go_hz": 20.0, "stop_share": 0.5}}, "stop_share 0.5 of the period must fit into the 0.05 s"),
    ],
)
def test_values_out_of_range_are_one_line_with_key_and_value(table, message):
    with pytest.raises(ConfigError, match=message) as caught:
        fill(SceneConfig, table, "[scene]")
    assert "\n" not in str(caught.value)


def test_parts_of_another_kind_are_refused():
    with pytest.raises(TypeError, match="rig must be a RigConfig, not SensorConfig"):
        SceneConfig(rig=SensorConfig())  # type: ignore[arg-type]


def test_faster_motion_and_flicker_shorten_the_step():
    still = SceneConfig(rig=RigConfig(omega_rad_s=0.0), mover=MoverConfig(enabled=False))
    assert still.step_us() == 1000
    assert SceneConfig().step_us() == pytest.approx(0.5e6 / (3.6 * 264.0), abs=1)
    assert SceneConfig(rig=RigConfig(omega_rad_s=-36.0)).step_us() == pytest.approx(0.5e5 / (3.6 * 264.0), abs=1)
    assert SceneConfig(flicker_depth=0.2, flicker_hz=1000.0).step_us() == 40
    assert SceneConfig(rig=RigConfig(omega_rad_s=1e5)).step_us() == 10


def test_the_step_follows_a_ramp_for_as_long_as_it_lasts():
    ramped = SceneConfig(rig=RigConfig(omega_rad_s=3.6, ramp_rad_s2=2.0))
    steps = [ramped.step_us(start_s) for start_s in (0.0, 1.0, 10.0, 40.0)]
    np.testing.assert_allclose(steps, [0.5e6 / (264.0 * (3.65 + 2.0 * t)) for t in (0, 1, 10, 40)], rtol=0.06)
    assert ramped.step_us(-5.0) == pytest.approx(0.5e6 / (264.0 * 6.4), rel=0.02)


@given(
    omega_rad_s=st.floats(-5.0, 5.0),
    ripple=st.floats(0.0, 1.0),
    ramp_rad_s2=st.floats(-5.0, 5.0),
    wobble_px=st.tuples(st.floats(0.0, 30.0), st.floats(0.0, 30.0)),
    stop_go_hz=st.sampled_from([0.0, 3.0]),
    start_s=st.floats(0.0, 5.0),
)
def test_no_point_of_the_disc_is_faster_than_the_bound(
    omega_rad_s, ripple, ramp_rad_s2, wobble_px, stop_go_hz, start_s
):
    rig = SceneConfig(
        rig=RigConfig(
            omega_rad_s=omega_rad_s,
            ripple=ripple,
            ramp_rad_s2=ramp_rad_s2,
            wobble_px=wobble_px,
            wobble_hz=3.0,
            stop_go_hz=stop_go_hz,
        )
    ).rig
    time_s = np.linspace(start_s, start_s + 0.3, 3001)
    rim = np.linspace(0.0, math.tau, 8, endpoint=False)
    angle = rig.angle_at(time_s)[:, None] + rim
    points = rig.center_at(time_s)[:, None] + rig.radius_px * np.stack([np.cos(angle), np.sin(angle)], -1)
    speed = np.hypot(*np.moveaxis(np.diff(points, axis=0), 2, 0)) / 1e-4
    assert speed.max() <= rig.rim_speed_px_s(start_s, start_s + 0.3) * (1.0 + 1e-6) + 1e-6
