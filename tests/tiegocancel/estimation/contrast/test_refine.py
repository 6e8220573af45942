"""Refine one window's rotation from a rough start to its peak."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tiegocancel.estimation.contrast.refine import refine
from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.events import Events

ANCHOR = (160.0, 120.0)
TRUE = Twist.about((150.0, 110.0), 5.0, ANCHOR)


@pytest.mark.parametrize("factor", [0.9, 1.1])
@pytest.mark.parametrize("signed", [True, False])
def test_peak_is_reached_from_a_tenth_off(turning, factor, signed):
    fit = refine(turning(), TRUE.scaled(factor), anchor_px=ANCHOR, signed=signed)
    assert fit.converged
    assert fit.twist.omega_rad_s == pytest.approx(5.0, rel=0.005)
    assert fit.twist.center_px(ANCHOR) == pytest.approx((150.0, 110.0), abs=0.5)
    assert fit.contrast_gain > 1.5
    assert fit.correlation > 0.5


def test_result_says_which_events_it_rests_on(turning):
    events = turning(start_us=7_000_000)
    fit = refine(events, TRUE, anchor_px=ANCHOR, signed=True)
    assert (fit.start_us, fit.stop_us) == (int(events.t[0]), int(events.t[-1]) + 1)
    assert fit.events_used == len(events)
    assert 0.0 < fit.kept_share <= 1.0


@pytest.mark.parametrize("anchor", [(0.0, 0.0), (319.0, 239.0), (-500.0, 900.0)])
def test_any_anchor_names_the_same_motion(turning, anchor):
    events = turning()
    here = refine(events, TRUE.scaled(1.05), anchor_px=ANCHOR, signed=True)
    there = refine(events, TRUE.scaled(1.05).seen_from(ANCHOR, anchor), anchor_px=anchor, signed=True)
    assert there.twist.seen_from(anchor, ANCHOR) == pytest.approx(here.twist, abs=1e-6)


def test_sigma_of_omega_is_about_its_error(turning):
    fits = [refine(turning(seed=seed, count=8_000), TRUE, anchor_px=ANCHOR, signed=True) for seed in range(12)]
    errors = [fit.twist.omega_rad_s - 5.0 for fit in fits]
    claimed = math.sqrt(float(np.mean([fit.omega_sigma_rad_s**2 for fit in fits])))
    assert 0.4 < float(np.sqrt(np.mean(np.square(errors)))) / claimed < 2.0


@pytest.mark.parametrize("count", [1, 2, 5])
def test_hardly_any_events_do_not_crash(count):
    events = Events(list(range(count)), [9] * count, [9] * count, [1] * count, 16, 16)
    fit = refine(events, TRUE, anchor_px=(8.0, 8.0), signed=True)
    assert not fit.converged
    assert fit.events_used == count


def test_noise_alone_hardly_gains(turning):
    fit = refine(turning(noise=1.0), TRUE, anchor_px=ANCHOR, signed=True)
    assert fit.contrast_gain < 1.05
    assert fit.correlation < 0.15


def test_large_sensors_are_climbed_from_coarser_cells(turning):
    center = (640.0, 360.0)
    events = turning(center, 5.0, width=1280, height=720, points=600, reach=0.0)
    start = Twist.about((646.0, 356.0), 5.0, center)
    fit = refine(events, start, anchor_px=center, signed=True)
    assert fit.twist.center_px(center) == pytest.approx(center, abs=0.5)


@pytest.mark.parametrize("shift_us", [(1 << 60) - 100_000, -(1 << 60)])
def test_times_far_from_zero_change_no_bit(turning, shift_us):
    near = turning(count=4_000)
    far = Events(near.t + shift_us, near.x, near.y, near.p, near.width, near.height)
    one, other = (refine(events, TRUE, anchor_px=ANCHOR, signed=True) for events in (near, far))
    assert one.twist == other.twist
    assert other.start_us - one.start_us == shift_us
