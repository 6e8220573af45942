"""Find the bias of a gyroscope at rest, never elsewhere, at once and along a stream."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.inertial.bias import RestConfig, RestingBias, Rests, estimate_bias
from tiegocancel.estimation.inertial.files import read_gyro
from tiegocancel.estimation.inertial.gyro import GyroSamples

BIAS = np.array([0.013, -0.008, 0.002])


def made(moving, *, seed=0, noise=0.002, seconds=4.0, bias=BIAS):
    """Return 1 kHz samples; ``moving(t)`` is the rate about z in rad/s at times in s."""
    t = np.arange(int(seconds * 1000)) * 1000 + 123
    rate = bias + np.random.default_rng(seed).normal(scale=noise, size=(len(t), 3))
    rate[:, 2] += moving(t * 1e-6)
    return GyroSamples(t_us=t, rate_rad_s=rate)


def shaken(t):
    """Swing from 1 s to 3 s, rest before and after."""
    return np.where((t > 1.0) & (t < 3.0), 2.0 * np.sin(2 * np.pi * 1.3 * (t - 1.0)), 0.0)


def test_bias_is_within_its_deviation_of_the_truth():
    away = []
    for seed in range(40):
        found = estimate_bias(made(shaken, seed=seed))
        assert found.found
        away.append((found.bias_rad_s - BIAS) / found.sigma_rad_s)
    # 120 values of unit variance: their mean square lies within 1 ± 4·√(2/120).
    assert np.mean(np.square(away)) == pytest.approx(1.0, abs=0.52)


def test_rests_are_where_nothing_moves():
    found = estimate_bias(made(shaken))
    assert len(found.rests_us) == 2
    (_, first_stop), (second_start, _) = found.rests_us
    assert 0.9e6 <= first_stop <= 1.05e6
    assert 2.95e6 <= second_start <= 3.1e6
    assert "2 rest(s)" in found.text


def test_filtered_noise_widens_the_deviation():
    white = made(lambda t: 0 * t, seconds=8)
    kernel = np.ones(10) / 10
    smooth = np.stack([np.convolve(white.rate_rad_s[:, axis], kernel, "valid") for axis in range(3)], axis=1)
    filtered = GyroSamples(t_us=white.t_us[: len(smooth)], rate_rad_s=smooth)
    # A moving mean changes the scatter of one sample by √10 and that of the mean not at all.
    assert estimate_bias(filtered).noise_rad_s == pytest.approx(estimate_bias(white).noise_rad_s / 10**0.5, rel=0.1)
    assert estimate_bias(filtered).sigma_rad_s == pytest.approx(estimate_bias(white).sigma_rad_s, rel=0.4)


def test_a_knock_at_rest_does_not_move_the_bias():
    still = made(lambda t: 0 * t)
    rate = still.rate_rad_s.copy()
    rate[2000:2003] += 0.05
    knocked = estimate_bias(GyroSamples(t_us=still.t_us, rate_rad_s=rate))
    assert knocked.bias_rad_s == pytest.approx(estimate_bias(still).bias_rad_s, abs=1e-5)


@pytest.mark.parametrize(
    ("moving", "words"),
    [
        (lambda t: 0.5 * np.sin(2 * np.pi * 3 * t), "no rest was found: the calmest 0.2 s vary by"),
        (lambda t: 3.6 + 0 * t, "about 3.6 rad/s"),  # a steady turn is no rest
        (lambda t: 0.5 * (t - 2), "no rest was found"),
    ],
)
def test_no_rest_is_said_and_the_bias_unknown(moving, words):
    found = estimate_bias(made(moving))
    assert not found.found
    assert words in found.text
    assert found.bias_rad_s.tolist() == [0.0, 0.0, 0.0]
    assert np.isinf(found.sigma_rad_s).all()


def test_too_few_samples_or_a_gap_are_no_rest():
    still = made(lambda t: 0 * t)
    assert not estimate_bias(still.between(0, 100_000)).found
    sparse = GyroSamples(t_us=still.t_us[::100], rate_rad_s=still.rate_rad_s[::100])
    found = estimate_bias(sparse)
    assert not found.found
    assert "without a gap" in found.text


@given(cuts=st.lists(st.integers(0, 4000), max_size=8))
def test_borders_of_chunks_change_nothing(cuts):
    whole = made(shaken)
    at_once = RestingBias().process(whole.t_us, whole.rate_rad_s)
    follower = RestingBias()
    edges = [0, *sorted(cuts), len(whole)]
    parts = [follower.process(whole.t_us[a:b], whole.rate_rad_s[a:b]) for a, b in pairwise(edges)]
    assert np.array_equal(np.concatenate(parts), at_once)


def test_what_is_known_at_a_time_depends_on_nothing_later():
    whole = made(shaken)
    known = RestingBias().process(whole.t_us, whole.rate_rad_s)
    other = whole.rate_rad_s.copy()
    other[2500:] = 9.0
    assert np.array_equal(RestingBias().process(whole.t_us, other)[:2501], known[:2501])


def test_follower_learns_at_rest_and_holds_while_moving():
    whole = made(shaken)
    follower = RestingBias()
    known = follower.process(whole.t_us, whole.rate_rad_s)
    assert not known[:150].any()
    assert known[300] == pytest.approx(BIAS, abs=1e-3)
    # From 1.2 s to 3.1 s there is no rest, and nothing changes.
    assert np.array_equal(known[1250], known[3050])
    assert follower.bias_rad_s == pytest.approx(BIAS, abs=4e-4)
    assert np.abs(follower.bias_rad_s - BIAS).max() < 4 * follower.sigma_rad_s.max()


def test_rests_of_a_recording_tell_the_bias_of_the_image_with_nothing_later():
    samples = made(shaken)
    rests = Rests().process(samples.t_us, samples.rate_rad_s)
    times = np.array(sorted(rests))
    assert ((times < 1.05e6) | (times > 3.0e6)).all()
    assert len(times) == pytest.approx(2.0e6 / RestConfig().part_us, abs=8)
    for t_us, rest in rests.items():
        assert rest.image_bias_rad_s == pytest.approx(-BIAS[2], abs=1e-3)  # the image turns the other way
        assert rest.image_sigma_rad_s >= 0.002
        assert rest.t_us == t_us
    stop = int(np.searchsorted(samples.t_us, times[3], side="right"))
    early = Rests().process(samples.t_us[:stop], samples.rate_rad_s[:stop])
    assert early == {int(t_us): rests[int(t_us)] for t_us in times[:4]}
    cut = Rests()
    parts = [cut.process(samples.t_us[a : a + 37], samples.rate_rad_s[a : a + 37]) for a in range(0, len(samples), 37)]
    assert {t_us: rest for part in parts for t_us, rest in part.items()} == rests


def test_follower_follows_a_drift():
    drifting = made(lambda t: 0.0005 * t, seconds=40, bias=np.zeros(3))
    follower = RestingBias(RestConfig(memory_us=2_000_000))
    known = follower.process(drifting.t_us, drifting.rate_rad_s)
    truth = 0.0005 * drifting.t_us * 1e-6
    # A running mean over 2 s trails a ramp by about that.
    assert np.abs(known[10_000:, 2] - truth[10_000:]).max() < 0.0005 * 2.5 + 3e-4


@pytest.mark.parametrize(
    ("field", "value"),
    [("window_us", 3), ("max_sigma_rad_s", 0.0), ("max_bias_rad_s", np.inf), ("least_samples", 1), ("memory_us", 10)],
)
def test_config_names_a_wrong_field(field, value):
    with pytest.raises(ValueError, match=f"{field} must be .* not {value}"):
        RestConfig(**{field: value})


def test_real_gyroscope_at_rest(recording):
    """A static DAVIS346: its whole recording is one rest."""
    pytest.importorskip("lz4")
    samples = read_gyro(recording("davis346_imu.aedat4"))
    found = estimate_bias(samples)
    assert len(found.rests_us) == 1
    assert found.bias_rad_s == pytest.approx(-np.radians([0.739, 0.493, 0.114]), abs=2e-4)
    assert found.noise_rad_s == pytest.approx([0.0018] * 3, rel=0.1)
