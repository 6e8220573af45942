"""Fuse events and gyroscope: causal, consistent with its own deviation, and steady while the events are in doubt."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.estimate import MotionEstimate, trajectory_of
from tiegocancel.estimation.inertial.bias import RestConfig
from tiegocancel.estimation.inertial.fusion import (
    ExponentialConfig,
    ExponentialFusion,
    FusedEstimator,
    KalmanConfig,
    KalmanFusion,
    fuse,
)
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.events import Events

CENTER = (100.0, 80.0)


def row(t_us, omega, sigma=0.05, **more):
    return MotionEstimate(
        t_us=int(t_us), center_px=CENTER, omega_rad_s=float(omega), omega_sigma_rad_s=sigma, center_sigma_px=1.0, **more
    )


def simulated(config, *, seed, seconds=2.0, event_us=10_000, sigma=0.05, delay_us=0):
    """Draw ω, bias and both sensors from the very model of the filter: 1 kHz gyro; return truth at the gyro's times."""
    rng = np.random.default_rng(seed)
    count = int(seconds * 1000)
    t_us = np.arange(1, count + 1) * 1000
    step = math.sqrt(1e-3)
    omega = 3.0 + np.cumsum(rng.normal(scale=config.omega_walk * step, size=count))
    bias = rng.normal(scale=config.initial_bias_sigma_rad_s) + np.cumsum(
        rng.normal(scale=config.bias_walk * step, size=count)
    )
    gyro = omega + bias + rng.normal(scale=config.gyro_sigma_rad_s, size=count)
    late = delay_us // 1000
    places = np.arange(event_us // 1000 - 1, count, event_us // 1000)
    places = places[places >= late]
    rows = [row(t_us[k], omega[k - late] + rng.normal(scale=sigma), sigma) for k in places]
    return t_us, omega, bias, gyro, rows


def steps(t_us, value=1.0):
    return np.where(np.asarray(t_us) >= 500_000, value, 0.0)


@pytest.mark.parametrize(("delay_us", "omega_walk"), [(0, 5.0), (0, 0.2), (25_000, 0.2), (25_000, 5.0)])
def test_errors_are_as_large_as_the_filter_says(delay_us, omega_walk):
    """NEES of ω and of the bias over 150 runs of data drawn from the model: 1, within 4 deviations of the mean."""
    config = KalmanConfig(omega_walk=omega_walk, bias_walk=0.01, gyro_sigma_rad_s=0.01, event_delay_us=delay_us)
    omega_nees, bias_nees = [], []
    for seed in range(150):
        t_us, omega, bias, gyro, rows = simulated(config, seed=seed, seconds=0.4, delay_us=delay_us)
        fusion = KalmanFusion(config)
        fused = fuse(fusion, rows, t_us, gyro)
        assert len(fused) == len(t_us)
        omega_nees.append(((fused[-1].omega_rad_s - omega[-1]) / fused[-1].omega_sigma_rad_s) ** 2)
        bias_nees.append(((fusion.bias_rad_s - bias[-1]) / fusion.bias_sigma_rad_s) ** 2)
    for nees in (omega_nees, bias_nees):
        assert np.mean(nees) == pytest.approx(1.0, abs=4 * math.sqrt(2 / 150))


def test_fused_omega_beats_both_sensors():
    config = KalmanConfig(omega_walk=0.5, gyro_sigma_rad_s=0.01, initial_bias_sigma_rad_s=0.3)
    t_us, omega, _, gyro, rows = simulated(config, seed=1, sigma=0.05)
    fused = fuse(KalmanFusion(config), rows, t_us, gyro)
    late = slice(len(t_us) // 2, None)
    error = np.array([each.omega_rad_s for each in fused])[late] - omega[late]
    held = np.interp(t_us, [each.t_us for each in rows], [each.omega_rad_s for each in rows])
    assert np.sqrt(np.mean(error**2)) < 0.015
    assert np.sqrt(np.mean(error**2)) < 0.5 * np.sqrt(np.mean((held - omega)[late] ** 2))
    assert np.sqrt(np.mean(error**2)) < 0.5 * np.sqrt(np.mean((gyro - omega)[late] ** 2))


def test_delayed_estimates_are_taken_at_their_own_time():
    """A swing of ω and estimates 50 ms late: told of the delay, the filter does not take the lag for a bias."""
    t_us = np.arange(1, 1500) * 1000
    omega = 2.0 * np.sin(2 * np.pi * 2 * t_us * 1e-6)
    rows = [row(time, 2.0 * np.sin(2 * np.pi * 2 * (time - 50_000) * 1e-6), 0.02) for time in t_us[99::10]]
    errors = {}
    for delay_us in (0, 50_000):
        config = KalmanConfig(event_delay_us=delay_us, gate_sigma=1e6)
        fused = fuse(KalmanFusion(config), rows, t_us, omega + 0.05)
        errors[delay_us] = np.abs(np.array([each.omega_rad_s for each in fused]) - omega)[700:].max()
    assert errors[50_000] < 0.01
    assert errors[0] > 0.1


def test_replay_of_a_late_estimate_equals_the_measurements_in_order():
    config = KalmanConfig(event_delay_us=4_500)
    t_us = np.arange(1, 21) * 1000
    gyro = np.random.default_rng(0).normal(size=20)
    late = KalmanFusion(config)
    for index in range(20):
        late.gyro(int(t_us[index]), float(gyro[index]))
        if index == 14:
            late.event(row(15_000, 0.3))
    ordered = KalmanFusion(KalmanConfig())
    for index in range(20):
        if index == 10:
            ordered.event(row(10_500, 0.3))
        ordered.gyro(int(t_us[index]), float(gyro[index]))
    assert late.bias_rad_s == pytest.approx(ordered.bias_rad_s, rel=1e-12)
    assert late.bias_sigma_rad_s == pytest.approx(ordered.bias_sigma_rad_s, rel=1e-12)
    assert late.gyro(21_000, 0.1).omega_rad_s == pytest.approx(ordered.gyro(21_000, 0.1).omega_rad_s, rel=1e-12)


def test_an_estimate_older_than_the_memory_is_taken_at_its_end():
    fusion = KalmanFusion(KalmanConfig(memory_us=5_000))
    for time in range(1, 50):
        fusion.gyro(time * 1000, 1.0)
    before = fusion.bias_sigma_rad_s
    result = fusion.event(row(10_000, 1.0))
    assert fusion.bias_sigma_rad_s < before
    assert result.omega_rad_s == pytest.approx(1.0, abs=1e-3)


def test_coasts_on_the_gyroscope_while_the_events_are_in_doubt():
    config = KalmanConfig(coast_us=100_000, bias_walk=0.01)
    t_us = np.arange(1, 2000) * 1000
    omega = 1.0 + steps(t_us)
    rows = [
        row(time, 1.0 + steps(time), 0.02)
        if time <= 400_000
        else row(time, -40.0, 0.02, confident=False, doubt="too few events")
        for time in t_us[9::10]
    ]
    fused = fuse(KalmanFusion(config), rows, t_us, omega + 0.07)
    error = np.abs(np.array([each.omega_rad_s for each in fused]) - omega)
    assert error[300:].max() < 0.03
    coasting = [each for each in fused if "on the gyroscope alone" in each.doubt]
    assert coasting[0].t_us == pytest.approx(501_000, abs=2000)
    assert all(each.confident for each in coasting)
    sigma = [each.omega_sigma_rad_s for each in fused]
    assert sigma[-1] > 1.2 * sigma[395]
    assert any("too few events" in each.doubt for each in fused)


def test_a_short_hijack_of_the_events_is_left_out():
    t_us = np.arange(1, 1000) * 1000
    rows = [row(time, 3.0 if 500_000 < time < 560_000 else 1.0, 0.02) for time in t_us[9::10]]
    fused = fuse(KalmanFusion(), rows, t_us, np.full(len(t_us), 1.05))
    assert np.abs(np.array([each.omega_rad_s for each in fused])[200:] - 1.0).max() < 0.02
    assert any("σ away" in each.doubt for each in fused)


def test_a_lasting_jump_of_the_bias_is_learnt():
    t_us = np.arange(1, 2000) * 1000
    fused = fuse(KalmanFusion(), [row(time, 1.0, 0.02) for time in t_us[9::10]], t_us, 1.0 + steps(t_us, 0.15))
    error = np.abs(np.array([each.omega_rad_s for each in fused]) - 1.0)
    assert error[490] < 0.01
    assert error[550] > 0.1
    assert error[800:].max() < 0.02


@pytest.mark.parametrize("wrong", [0.5, -4.0])
def test_what_no_bias_explains_is_never_believed_of_the_events(wrong):
    """A mover that fills the view: the gyroscope carries on, and the rows of the events say that they were left out."""
    t_us = np.arange(1, 2000) * 1000
    fused = fuse(
        KalmanFusion(), [row(time, 1.0 + steps(time, wrong), 0.02) for time in t_us[9::10]], t_us, 1.05 + 0 * t_us
    )
    assert np.abs(np.array([each.omega_rad_s for each in fused])[200:] - 1.0).max() < 0.02
    assert sum("σ away" in each.doubt for each in fused) == sum(time >= 500_000 for time in t_us[9::10])


def resting(t_us, bias=0.1, *, seed=0):
    rates = np.random.default_rng(seed).normal(scale=0.002, size=(len(t_us), 3)) - [0.0, 0.0, bias]
    return GyroSamples(t_us=t_us, rate_rad_s=rates, source="resting")


def ticks(stop_us):
    t = np.arange(0, stop_us, 500)
    zeros = np.zeros(len(t), np.int64)
    return Events(t, zeros, zeros, zeros, 4, 4)


class Scripted:
    """An estimator that says what it was told to, at most the rows before the last event."""

    def __init__(self, rows):
        self.rows = list(rows)

    def process(self, events):
        due = [each for each in self.rows if each.t_us <= int(events.t[-1])]
        self.rows = self.rows[len(due) :]
        return due


@pytest.mark.parametrize("make", [ExponentialFusion, KalmanFusion])
def test_a_gyroscope_at_rest_tells_its_bias(make):
    t_us = np.arange(1, 2000) * 1000
    rows = FusedEstimator(Scripted([]), resting(t_us), make(), rest=RestConfig()).process(ticks(2_000_000))
    omega = np.array([each.omega_rad_s for each in rows])
    assert abs(omega[150]) > 0.02  # not known yet
    assert np.abs(omega[400:]).max() < 0.01


def test_events_that_disagree_with_a_gyroscope_at_rest_are_left_out():
    """A static camera before traffic: within what a bias may be, and still not believed while it rests."""
    t_us = np.arange(1, 2000) * 1000
    events = [row(time, 0.15, 0.01) for time in t_us[499::10]]
    rows = FusedEstimator(Scripted(events), resting(t_us), KalmanFusion(), rest=RestConfig()).process(ticks(2_000_000))
    between = np.array([each.omega_rad_s for each in rows if each.t_us > 500_000 and each.t_us % 10_000])
    assert np.abs(between).max() < 0.03
    believed = FusedEstimator(Scripted(events), resting(t_us), KalmanFusion()).process(ticks(2_000_000))
    assert believed[-2].omega_rad_s == pytest.approx(0.15, abs=0.02)  # without the rest the events are right


def test_bias_from_rest_makes_the_gyroscope_absolute():
    config = KalmanConfig(initial_bias_rad_s=0.3, initial_bias_sigma_rad_s=1e-4)
    fused = fuse(KalmanFusion(config, center_px=CENTER), [], np.arange(1, 100) * 1000, np.full(99, 2.3))
    assert fused[-1].omega_rad_s == pytest.approx(2.0, abs=1e-3)
    assert fused[-1].omega_sigma_rad_s < 0.01
    assert fused[-1].center_px == CENTER
    assert fused[-1].confident


def test_events_alone_are_smoothed_and_grow_uncertain_when_they_stop():
    fusion = KalmanFusion(KalmanConfig(omega_walk=0.1))
    for time in range(1, 100):
        last = fusion.event(row(time * 10_000, 2.0 + 0.1 * (-1) ** time, 0.1))
    assert last.omega_rad_s == pytest.approx(2.0, abs=0.05)
    assert last.omega_sigma_rad_s < 0.06
    doubtful = fusion.event(row(3_000_000, 9.0, math.inf))
    assert doubtful.omega_sigma_rad_s > 0.1
    assert not fusion.event(row(60_000_000, 9.0, math.inf)).confident


@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_exponential_fusion_is_the_thesis_formula(alpha):
    fusion = ExponentialFusion(ExponentialConfig(alpha=alpha, event_alpha=alpha))
    values = np.random.default_rng(0).normal(size=30)
    expected = values[0]
    for index, value in enumerate(values):
        result = fusion.gyro(index, value) if index % 2 else fusion.event(row(index, value))
        expected = (1 - alpha) * expected + alpha * value
        assert result.omega_rad_s == pytest.approx(expected)


def test_exponential_deviation_is_that_of_the_noise():
    rng = np.random.default_rng(0)
    config = ExponentialConfig(alpha=0.1, gyro_sigma_rad_s=0.5)
    away = []
    for _ in range(400):
        fusion = ExponentialFusion(config)
        for time, value in enumerate(rng.normal(scale=0.5, size=60)):
            result = fusion.gyro(time, value)
        away.append(result.omega_rad_s / result.omega_sigma_rad_s)
    assert np.mean(np.square(away)) == pytest.approx(1.0, abs=4 * math.sqrt(2 / 400))


@pytest.mark.parametrize("make", [ExponentialFusion, KalmanFusion])
def test_doubtful_estimates_change_no_omega_and_say_so(make):
    fusion = make()
    fusion.gyro(0, 1.0)
    for wrong in (row(1000, 50.0, 0.01, confident=False, doubt="blurred"), row(2000, 50.0, math.inf)):
        result = fusion.event(wrong)
        assert result.omega_rad_s == pytest.approx(1.0, abs=1e-3)
        assert result.doubt.startswith("event estimate left out")
    assert fusion.event(row(3000, 1.0)).doubt == ""


def test_before_any_measurement_nothing_is_confident():
    result = ExponentialFusion().event(row(0, 1.0, math.inf))
    assert (result.confident, result.doubt) == (False, "no ω was measured yet")
    assert not KalmanFusion().event(row(0, 1.0, math.inf)).confident


@pytest.mark.parametrize("make", [ExponentialFusion, KalmanFusion])
def test_last_confident_centre_is_held(make):
    fusion = make()
    assert not fusion.gyro(0, 1.0).has_center
    first = MotionEstimate(t_us=1, center_px=(1.0, 2.0), omega_rad_s=1.0, omega_sigma_rad_s=0.1, confident=False)
    assert fusion.event(first).center_px == (1.0, 2.0)
    assert fusion.event(row(2, 1.0)).center_px == CENTER
    lost = MotionEstimate(t_us=3, center_px=(9.0, 9.0), omega_rad_s=1.0, omega_sigma_rad_s=0.1, confident=False)
    assert fusion.event(lost).center_px == CENTER
    assert fusion.gyro(4, 1.0).center_sigma_px == 1.0


def test_rows_are_one_an_instant_and_thinned():
    t_us = np.arange(0, 100_000, 1000)
    rows = [row(time, 1.0) for time in range(5_000, 100_000, 10_500)]
    fused = fuse(KalmanFusion(), rows, t_us, np.ones(len(t_us)))
    times = [each.t_us for each in fused]
    assert times == sorted({*t_us.tolist(), *(each.t_us for each in rows)})
    thinned = [each.t_us for each in fuse(KalmanFusion(), rows, t_us, np.ones(len(t_us)), row_us=4000)]
    assert {each.t_us for each in rows} <= set(thinned)
    assert len(thinned) < 0.5 * len(times)
    assert trajectory_of(fused, source="fused").interpolation == "causal"


class Metronome:
    """Answer every 10 ms of events, as an estimator would: the share of ON events since the last answer."""

    def __init__(self):
        self.next_us, self.seen = 10_000, []

    def process(self, events):
        due = []
        for time, polarity in zip(events.t.tolist(), events.p.tolist(), strict=True):
            while time >= self.next_us:
                due.append(row(self.next_us, np.mean(self.seen) if self.seen else 0.0, 0.1))
                self.next_us, self.seen = self.next_us + 10_000, []
            self.seen.append(polarity)
        return due


def stream(seed=0, count=400):
    rng = np.random.default_rng(seed)
    # Coarse times, so that many events and gyro samples share one.
    t = np.sort(rng.integers(0, 200, count)) * 500
    zeros = np.zeros(count, np.int64)
    return Events(t, zeros, zeros, rng.integers(0, 2, count), 4, 4)


def gyroscope():
    t_us = np.arange(0, 120_000, 1000)
    return GyroSamples(t_us=t_us, rate_rad_s=np.random.default_rng(5).normal(size=(len(t_us), 3)))


@pytest.mark.parametrize("make", [ExponentialFusion, KalmanFusion])
@given(cuts=st.lists(st.integers(0, 400), max_size=8))
def test_borders_of_chunks_change_nothing(make, cuts):
    events = stream()
    whole = FusedEstimator(Metronome(), gyroscope(), make(), row_us=3000).process(events)
    fused = FusedEstimator(Metronome(), gyroscope(), make(), row_us=3000)
    parts = []
    edges = [0, *sorted(cuts), len(events)]
    for first, stop in pairwise(edges):
        parts += fused.process(events[first:stop])
    assert [(each.t_us, each.omega_rad_s) for each in parts] == [(each.t_us, each.omega_rad_s) for each in whole]
    assert len(whole) > 20


@pytest.mark.parametrize("make", [ExponentialFusion, KalmanFusion])
def test_rows_depend_on_nothing_later(make):
    events, gyro = stream(), gyroscope()
    whole = FusedEstimator(Metronome(), gyro, make()).process(events)
    rate = gyro.rate_rad_s.copy()
    rate[gyro.t_us > 50_000] = 7.0
    later = Events(events.t, events.x, events.y, np.where(events.t >= 50_000, 1, events.p), 4, 4)
    other = FusedEstimator(Metronome(), GyroSamples(t_us=gyro.t_us, rate_rad_s=rate), make()).process(later)
    before = [each.omega_rad_s for each in whole if each.t_us <= 50_000]
    assert before == [each.omega_rad_s for each in other if each.t_us <= 50_000]
    assert [each.omega_rad_s for each in whole] != [each.omega_rad_s for each in other]


@pytest.mark.parametrize(
    ("make", "field", "value"),
    [
        (KalmanConfig, "omega_walk", 0.0),
        (KalmanConfig, "gate_sigma", math.nan),
        (KalmanConfig, "initial_bias_rad_s", math.inf),
        (KalmanConfig, "most_rejected", 0),
        (KalmanConfig, "event_delay_us", -1),
        (KalmanConfig, "event_delay_us", 300_000),
        (KalmanConfig, "coast_us", -1),
        (ExponentialConfig, "alpha", 0.0),
        (ExponentialConfig, "event_alpha", 1.5),
        (ExponentialConfig, "gyro_sigma_rad_s", -1.0),
    ],
)
def test_config_names_a_wrong_field(make, field, value):
    with pytest.raises(ValueError, match=f"{field} must .*not {value}"):
        make(**{field: value})
