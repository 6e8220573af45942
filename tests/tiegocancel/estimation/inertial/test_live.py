"""A gyroscope that comes line by line gives what the same samples give from a file."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.estimation.estimate import Estimator, MotionEstimate
from tiegocancel.estimation.inertial.estimator import GyroEstimator
from tiegocancel.estimation.inertial.fusion import FusedEstimator, KalmanFusion
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.estimation.inertial.live import LiveFusedEstimator, LiveGyro, LiveGyroEstimator

PERIOD_US, SAMPLES = 8000, 120


def line_of(rate_rad_s: np.ndarray) -> str:
    counts = np.round(np.degrees(rate_rad_s) * 65536).astype(int)
    return "-S10 " + " ".join(f"{count & 0xFFFFFFFF:08X}" for count in counts)


def rates() -> np.ndarray:
    """At rest for half a second, with a bias, then a turn about the optical axis."""
    turning = np.zeros((SAMPLES, 3))
    turning[SAMPLES // 2 :, 2] = 1.5
    return turning + np.array([0.02, -0.01, 0.03])


def ticks(first: int, last: int) -> Events:
    t = np.arange(first, last, 100)
    return Events(t, np.full(len(t), 5), np.full(len(t), 5), np.zeros(len(t), int), 32, 32)


def live_rows(estimator: Estimator, gyro: LiveGyro, step_us: int) -> list[tuple[int, float]]:
    rows = []
    for first in range(0, PERIOD_US * SAMPLES + step_us, step_us):
        due = [k for k in range(SAMPLES) if first <= k * PERIOD_US < first + step_us]
        gyro.add((k * PERIOD_US, line_of(rates()[k])) for k in due)
        rows += estimator.process(ticks(first, first + step_us))
    return rows


def from_file() -> GyroSamples:
    return GyroSamples(t_us=np.arange(SAMPLES) * PERIOD_US, rate_rad_s=rates())


def assert_same(found: list[MotionEstimate], wanted: list[MotionEstimate]) -> None:
    assert [(row.t_us, row.doubt) for row in found] == [(row.t_us, row.doubt) for row in wanted]
    # Half a count of the wire's 2^-16 degrees, for sample and bias.
    close = math.radians(2.0 / 65536)
    assert [row.omega_rad_s for row in found] == pytest.approx([row.omega_rad_s for row in wanted], abs=close)
    assert [row.omega_sigma_rad_s for row in found] == pytest.approx(
        [row.omega_sigma_rad_s for row in wanted], rel=1e-3
    )


@pytest.mark.parametrize("step_us", [1000, 5000, 50_000])
def test_a_live_gyroscope_alone_equals_one_from_a_file(step_us: int) -> None:
    gyro = LiveGyro()
    found = live_rows(LiveGyroEstimator(gyro, (16.0, 16.0)), gyro, step_us)
    whole = GyroEstimator(from_file(), (16.0, 16.0), bias="causal", row_us=1)
    assert_same(found, whole.process(ticks(0, PERIOD_US * SAMPLES)))
    assert found[0].doubt
    assert found[-1].omega_rad_s == pytest.approx(-1.5, abs=0.01)


class NoEvents:
    def process(self, events: Events) -> list[MotionEstimate]:
        return []


def test_fusion_with_a_live_gyroscope_equals_that_with_a_file() -> None:
    gyro = LiveGyro()
    found = live_rows(LiveFusedEstimator(NoEvents(), gyro, KalmanFusion()), gyro, 5000)
    whole = FusedEstimator(NoEvents(), from_file(), KalmanFusion(), row_us=0)
    assert_same(found, whole.process(ticks(0, PERIOD_US * SAMPLES)))


def test_lines_are_merged_turned_and_counted() -> None:
    gyro = LiveGyro(axes="x,y,-z", offset_us=10)
    gyro.add([(100, "-S10 0 0 10000"), (100, "-S10 0 0 30000"), (200, "-S10 0 0"), (200, "hello"), (300, "-S10 0 0 0")])
    times, rate = gyro.take(200)
    assert times.tolist() == [110]
    assert rate[0].tolist() == pytest.approx([0.0, 0.0, -math.radians(2.0)])
    assert gyro.take(311)[0].tolist() == [310]
    assert gyro.take(10_000)[0].tolist() == []
    assert (gyro.lines, gyro.malformed, gyro.samples) == (5, 1, 2)
