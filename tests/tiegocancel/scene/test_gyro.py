"""Check the simulated gyroscope: truth plus bias and noise, in the words of a MEMS device."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tiegocancel.scene import CameraMotionConfig, CameraSceneConfig, GyroConfig, gyro_samples

EXACT = GyroConfig(noise_rad_s_rthz=0.0, bias_rad_s=(0.0, 0.0, 0.0), bits=32)


def scene(gyro: GyroConfig, **motion: float) -> CameraSceneConfig:
    return CameraSceneConfig(gyro=gyro, motion=CameraMotionConfig(**motion))


def test_without_errors_it_says_the_true_rates() -> None:
    config = scene(EXACT)
    t_us, rate = gyro_samples(config, duration_s=0.5)
    assert t_us.tolist() == list(range(0, 500_001, 1000))
    np.testing.assert_allclose(rate, config.motion.omega_at(t_us * 1e-6), atol=EXACT.step_rad_s)


def test_noise_has_its_density_and_bias_its_value() -> None:
    gyro = GyroConfig(noise_rad_s_rthz=1e-3, bias_rad_s=(0.3, -0.2, 0.1), rate_hz=2000.0, bits=32)
    _, rate = gyro_samples(scene(gyro, rest_s=10.0), duration_s=4.0, seed=3)
    deviation = 1e-3 * math.sqrt(1000.0)
    np.testing.assert_allclose(rate.std(axis=0), deviation, rtol=0.05)
    np.testing.assert_allclose(rate.mean(axis=0), gyro.bias_rad_s, atol=5.0 * deviation / math.sqrt(8000.0))
    # White: neighbours know nothing of each other.
    assert np.abs(np.mean((rate[1:] - rate.mean(0)) * (rate[:-1] - rate.mean(0)), axis=0)).max() < 0.06 * deviation**2


def test_at_rest_the_mean_of_the_default_is_its_bias() -> None:
    config = scene(GyroConfig(), rest_s=0.5)
    t_us, rate = gyro_samples(config, duration_s=0.8)
    rest = t_us <= 500_000
    np.testing.assert_allclose(rate[rest].mean(axis=0), config.gyro.bias_rad_s, atol=1e-3)
    assert rate[~rest].std(axis=0).max() > 0.05


def test_rates_are_whole_counts_within_the_range() -> None:
    gyro = GyroConfig(range_rad_s=math.radians(250.0), bits=8, bias_rad_s=(0.0, 0.0, 0.0))
    _, rate = gyro_samples(scene(gyro, roll_drift_rad_s=20.0, pan_drift_rad_s=-20.0, roll_rad_s=0.0), duration_s=0.1)
    counts = rate / gyro.step_rad_s
    np.testing.assert_allclose(counts, np.rint(counts), atol=1e-9)
    assert counts.max() == pytest.approx(127.0)
    assert counts.min() == pytest.approx(-128.0)
    assert GyroConfig().step_rad_s == pytest.approx(math.radians(1.0 / 16.384))


def test_a_late_clock_moves_the_stamps_only() -> None:
    plain, late = (
        gyro_samples(scene(GyroConfig(time_offset_us=offset)), duration_s=0.1, start_us=7) for offset in (0, -3500)
    )
    np.testing.assert_array_equal(plain[0] - 3500, late[0])
    np.testing.assert_array_equal(plain[1], late[1])
    assert plain[0][0] == 7


def test_one_seed_gives_one_series_and_a_longer_one_begins_with_it() -> None:
    short, long, other = (
        gyro_samples(scene(GyroConfig(rate_hz=833.0)), duration_s=duration_s, seed=seed)
        for duration_s, seed in ((0.1, 4), (0.7, 4), (0.1, 5))
    )
    assert (np.diff(short[0]) > 0).all()
    np.testing.assert_array_equal(short[0], long[0][: len(short[0])])
    np.testing.assert_array_equal(short[1], long[1][: len(short[1])])
    assert (short[1] != other[1]).any()


def test_a_duration_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="duration_s must be from 0"):
        gyro_samples(CameraSceneConfig(), duration_s=-0.1)
