"""Settings build the estimator they name, and what they cannot mean is refused in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiegocancel import ConfigError, Events
from tiegocancel.estimation.circle.estimator import CircleEstimator
from tiegocancel.estimation.contrast.track import RotationTracker
from tiegocancel.estimation.inertial.estimator import GyroEstimator
from tiegocancel.estimation.inertial.files import write_gyro
from tiegocancel.estimation.inertial.fusion import FusedEstimator
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.study.estimators import build_estimator, camera_motion, gyro_of
from tiegocancel.study.settings import EstimateSettings

BIAS = np.array([0.02, -0.01, 0.03])


def samples(rest_us: int = 0) -> GyroSamples:
    """A camera that rests and then rolls at −3 rad/s for half a second, with a bias."""
    t = np.arange(0, rest_us + 500_000, 1000)
    rates = np.where(t[:, None] < rest_us, 0.0, [[0.0, 0.0, -3.0]])
    return GyroSamples(t_us=t, rate_rad_s=rates + BIAS + 1e-4 * np.random.default_rng(1).standard_normal(rates.shape))


def ticks(stop_us: int) -> Events:
    """Events that say nothing but what time it is."""
    t = np.arange(0, stop_us, 5_000)
    return Events(t, np.zeros(len(t), int), np.zeros(len(t), int), np.zeros(len(t), int), 64, 48)


def build(gyro: GyroSamples | None = None, **given: Any) -> Any:
    return build_estimator(EstimateSettings(**given), width=64, height=48, gyro=gyro)


def test_the_method_names_the_estimator_and_a_gyroscope_fuses_it() -> None:
    assert isinstance(build(), RotationTracker)
    assert isinstance(build(method="circle"), CircleEstimator)
    assert isinstance(build(samples(), method="gyro"), GyroEstimator)
    for fusion in ("kalman", "exponential"):
        assert isinstance(build(samples(), fusion=fusion), FusedEstimator)
    assert isinstance(build(samples(), method="circle"), FusedEstimator)


def test_numbers_reach_the_estimator_and_0_leaves_them_to_it() -> None:
    config = build(step_us=7_000, window_us=15_000, max_events=5_000, max_omega_rad_s=9.0, seed=4).config
    assert (config.step_us, config.window_us, config.longest_window_us) == (7_000, 15_000, 60_000)
    assert (config.max_events, config.max_omega_rad_s, config.seed) == (5_000, 9.0, 4)
    assert (build().config.step_us, build().config.window_us) == (10_000, 20_000)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"window_us": 7}, r"\[estimate\] window_us"),
        ({"step_us": 11}, r"\[estimate\] step_us must be from 100"),
        ({"max_events": 5}, r"\[estimate\] .*max_events"),
        ({"max_omega_rad_s": -3.0}, r"\[estimate\] max_omega_rad_s .* not -3"),
        ({"max_omega_rad_s": float("nan")}, r"\[estimate\] max_omega_rad_s .* not nan"),
        ({"method": "circle", "window_us": 1}, r"\[estimate\] "),
        ({"method": "gyro"}, r"--method gyro: no gyroscope is given; name its file with --gyro"),
    ],
)
def test_numbers_out_of_range_are_refused_with_their_table(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        build(**given)


@pytest.mark.parametrize("alpha", [2.0, 0.0, -1.0, float("nan")])
def test_a_weight_beyond_its_range_is_refused(alpha: float) -> None:
    with pytest.raises(ValueError, match=r"alpha must lie in \(0, 1\]"):
        EstimateSettings(alpha=alpha)


def test_the_gyroscope_is_read_onto_the_events_clock_and_the_cameras_axes(tmp_path: Path) -> None:
    path = tmp_path / "gyro.csv"
    write_gyro(GyroSamples(t_us=np.array([0, 1000]), rate_rad_s=np.array([[1.0, 2.0, 3.0]] * 2)), path)
    read = gyro_of(EstimateSettings(gyro=str(path), gyro_axes="-y,x,z", gyro_offset_us=-250))
    assert read is not None
    assert read.t_us.tolist() == [-250, 750]
    assert read.rate_rad_s[0].tolist() == [-2.0, 1.0, 3.0]
    assert gyro_of(EstimateSettings()) is None
    with pytest.raises(ConfigError, match=r"--gyro-axes: .*'x,y'"):
        gyro_of(EstimateSettings(gyro=str(path), gyro_axes="x,y"))


def test_a_bias_at_rest_is_taken_off_unless_there_is_none() -> None:
    gyro = samples(rest_us=500_000)
    for bias, expected in (("rest", 3.0), ("none", 3.0 - BIAS[2])):
        rows = build(gyro, method="gyro", gyro_bias=bias).process(ticks(1_000_000))
        assert rows[-1].omega_rad_s == pytest.approx(expected, abs=2e-3)
        assert rows[-1].doubt == ""
    unsure = build(samples(), method="gyro").process(ticks(500_000))
    assert "no rest" in unsure[-1].doubt


def test_exponential_fusion_weighs_a_new_value_by_alpha() -> None:
    gyro = GyroSamples(t_us=np.array([0, 1000, 2000]), rate_rad_s=np.array([[0, 0, 0.0], [0, 0, -1.0], [0, 0, -1.0]]))
    fused = build(gyro, fusion="exponential", alpha=0.25, gyro_bias="none").process(ticks(10_000))
    assert [row.omega_rad_s for row in fused if row.t_us <= 2000] == pytest.approx([0.0, 0.25, 0.4375])


def test_gyroscope_and_calibration_give_a_camera_that_uses_samples_before_each_time(tmp_path: Path) -> None:
    lens = tmp_path / "lens.toml"
    lens.write_text("fx = 60.0\nfy = 60.0\ncx = 30.0\ncy = 20.0\nwidth = 64\nheight = 48\n", encoding="utf-8")
    wanted = EstimateSettings(calibration=str(lens))
    camera = camera_motion(wanted, samples(rest_us=500_000), width=64, height=48)
    assert camera.interpolation == "causal"
    assert camera.at(np.array([900_000]))[0] == pytest.approx([0.0, 0.0, -3.0], abs=2e-3)
    assert any("bias of the gyroscope at rest" in note for note in camera.notes)
    assert any("unknown" in note for note in camera_motion(wanted, samples(), width=64, height=48).notes)
    row = build(samples(), method="gyro", calibration=str(lens)).process(ticks(9_000))[-1]
    assert row.center_px == (30.0, 20.0)
    with pytest.raises(ConfigError, match=r"lens\.toml: height is 48 px, that of the events 50 px"):
        camera_motion(wanted, samples(), width=64, height=50)


def test_the_lens_plays_no_part_where_events_are_undistorted(tmp_path: Path) -> None:
    lens = tmp_path / "lens.toml"
    lens.write_text(
        "fx = 60.0\nfy = 60.0\ncx = 30.0\ncy = 20.0\nwidth = 64\nheight = 48\ndistortion = [-0.3, 0.1, 0, 0]\n",
        encoding="utf-8",
    )
    wanted = EstimateSettings(calibration=str(lens))
    assert not camera_motion(wanted, samples(), width=64, height=48).intrinsics.is_pinhole
    bare = camera_motion(wanted, samples(), width=64, height=48, undistorted=True)
    assert bare.intrinsics.is_pinhole
    assert bare.intrinsics.fx == 60.0
