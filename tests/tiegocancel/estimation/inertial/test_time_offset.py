"""Find the offset between the clocks of gyroscope and events; refuse where the series cannot tell it."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.estimation.inertial.time_offset import OffsetConfig, find_time_offset, offset_of_estimates

SINCE_1970_US = 1_589_163_147_369_190


def swing(t_us):
    """A hand-held motion: a few tones that share no period."""
    t = np.asarray(t_us) * 1e-6
    return 1.5 * np.sin(2 * np.pi * 1.1 * t) + 0.8 * np.sin(2 * np.pi * 2.7 * t + 1) + 0.3 * np.sin(7.3 * 2 * np.pi * t)


def series(offset_us, *, motion=swing, seed=0, seconds=4.0, noise=(0.05, 0.003), gain=1.0, bias=0.04, start_us=0):
    """Return events' series at 100 Hz and the gyro's at 1 kHz, whose clock reads ``offset_us`` less."""
    rng = np.random.default_rng(seed)
    t_us = np.arange(200_000, int(seconds * 1e6) - 200_000, 10_000)
    gyro_t_us = np.arange(0, int(seconds * 1e6), 1000)
    omega = motion(t_us) + rng.normal(scale=noise[0], size=len(t_us))
    gyro = gain * motion(gyro_t_us + offset_us) + bias + rng.normal(scale=noise[1], size=len(gyro_t_us))
    return t_us + start_us, omega, gyro_t_us + start_us, gyro


@pytest.mark.parametrize("offset_us", [-63_210.0, -1_500.0, 0.0, 333.0, 40_777.0])
@pytest.mark.parametrize("start_us", [0, SINCE_1970_US])
def test_offset_is_found_to_a_part_of_a_sample(offset_us, start_us):
    found = find_time_offset(*series(offset_us, start_us=start_us))
    assert found.confident
    # The events come every 10 ms and the gyro every ms.
    assert found.offset_us == pytest.approx(offset_us, abs=800)
    assert found.bias_rad_s == pytest.approx(0.04, abs=0.02)
    assert found.gain == pytest.approx(1.0, abs=0.03)


def test_offset_is_within_its_deviation_of_the_truth():
    found = [find_time_offset(*series(12_345.0, seed=seed)) for seed in range(40)]
    away = np.array([(each.offset_us - 12_345.0) / each.sigma_us for each in found])
    assert all(each.confident and each.sigma_us < 500 for each in found)
    # Mean square of 40 values of unit variance; the parabola adds a little.
    assert 0.4 < np.mean(away**2) < 2.2
    assert abs(away.mean()) < 0.7


def test_shifting_the_samples_by_the_offset_takes_it_away():
    t_us, omega, gyro_t_us, gyro = series(-25_000.0)
    samples = GyroSamples(t_us=gyro_t_us, rate_rad_s=np.stack([0 * gyro, 0 * gyro, -gyro], axis=1))
    rows = [
        MotionEstimate(t_us=int(time), center_px=(0, 0), omega_rad_s=float(value))
        for time, value in zip(t_us, omega, strict=True)
    ]
    found = offset_of_estimates(rows, samples)
    assert found.offset_us == pytest.approx(-25_000.0, abs=800)
    assert "µs to the event clock" in found.text
    again = offset_of_estimates(rows, samples.shifted(found.offset_us))
    assert again.offset_us == pytest.approx(0.0, abs=100)


def test_delay_of_the_estimates_is_not_taken_for_an_offset():
    t_us, omega, gyro_t_us, gyro = series(5_000.0)
    late = [
        MotionEstimate(t_us=int(time) + 12_500, center_px=(0, 0), omega_rad_s=float(value))
        for time, value in zip(t_us, omega, strict=True)
    ]
    samples = GyroSamples(t_us=gyro_t_us, rate_rad_s=np.stack([0 * gyro, 0 * gyro, -gyro], axis=1))
    assert offset_of_estimates(late, samples).offset_us == pytest.approx(17_500, abs=800)
    assert offset_of_estimates(late, samples, delay_us=12_500).offset_us == pytest.approx(5_000, abs=800)


def test_what_windows_say_is_compared_and_not_what_a_filter_made_of_it():
    t_us, omega, gyro_t_us, gyro = series(5_000.0)
    lagging = [
        MotionEstimate(t_us=int(time) + 12_500, center_px=(0, 0), omega_rad_s=0.0, window=(int(time), float(value)))
        for time, value in zip(t_us, omega, strict=True)
    ]
    samples = GyroSamples(t_us=gyro_t_us, rate_rad_s=np.stack([0 * gyro, 0 * gyro, -gyro], axis=1))
    assert offset_of_estimates(lagging, samples).offset_us == pytest.approx(5_000, abs=800)


def test_doubtful_estimates_play_no_part():
    t_us, omega, gyro_t_us, gyro = series(5_000.0)
    rng = np.random.default_rng(3)
    rows = [
        MotionEstimate(t_us=int(time), center_px=(0, 0), omega_rad_s=50 * float(rng.normal()), confident=False)
        if index % 3 == 0
        else MotionEstimate(t_us=int(time), center_px=(0, 0), omega_rad_s=float(value))
        for index, (time, value) in enumerate(zip(t_us, omega, strict=True))
    ]
    samples = GyroSamples(t_us=gyro_t_us, rate_rad_s=np.stack([0 * gyro, 0 * gyro, -gyro], axis=1))
    assert offset_of_estimates(rows, samples).offset_us == pytest.approx(5_000, abs=800)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (series(0.0, motion=lambda t: 3.6 + 0.0 * t), "ω of the gyro series varies by"),
        (series(0.0, motion=lambda t: 1e-6 * t), "known to|bound of the search|almost alike"),  # a ramp
        (series(0.0, motion=lambda t: np.sin(2 * np.pi * 25e-6 * t)), "almost alike"),
        (series(0.0, gain=-1.0), "opposite"),
        (series(0.0, noise=(20.0, 0.003)), "do not match"),
        (series(150_000.0, motion=lambda t: np.sin(2 * np.pi * 0.7e-6 * t)), "bound of the search"),
        (series(0.0, seconds=0.5), "the gyro covers|estimates and"),
        (([], [], [], []), "0 estimates and 0 gyro samples"),
    ],
)
def test_a_series_that_cannot_tell_is_refused_with_the_reason(made, words):
    found = find_time_offset(*(np.asarray(column, np.float64) for column in made))
    assert not found.confident
    assert re.search(words, found.doubt)
    assert "unknown" in found.text


def test_independent_series_are_never_trusted():
    def wander(seed):
        steps = np.random.default_rng(seed).normal(size=4001)
        walk = np.convolve(np.cumsum(steps), np.ones(50) / 50, "same") * 0.05
        return lambda t: np.interp(t, np.arange(4001) * 1000, walk)

    trusted = 0
    for seed in range(30):
        t_us, omega, _, _ = series(0.0, motion=wander(seed))
        _, _, gyro_t_us, gyro = series(0.0, motion=wander(seed + 1000))
        trusted += find_time_offset(t_us, omega, gyro_t_us, gyro).confident
    assert trusted <= 3


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("step_us", 0),
        ("max_offset_us", 10),
        ("least_variation_rad_s", 0.0),
        ("least_correlation", 1.0),
        ("max_sigma_us", 0.0),
    ],
)
def test_config_names_a_wrong_field(field, value):
    with pytest.raises(ValueError, match=f"{field} must .* not {value}"):
        OffsetConfig(**{field: value})


def test_columns_of_unequal_length_are_a_mistake_of_the_caller():
    with pytest.raises(ValueError, match="one length"):
        find_time_offset(np.zeros(3), np.zeros(2), np.zeros(4), np.zeros(4))
