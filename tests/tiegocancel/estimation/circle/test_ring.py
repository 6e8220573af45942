"""Smooth circles over time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tiegocancel.estimation.circle.ring import Ring

RING = Ring(center_px=(50.0, 40.0), radius_px=20.0, reach_px=25.0, sigma_px=1.0, mean_sigma_px=1.0, fitted_us=0)


def test_smoothing_goes_its_share_of_the_way_once_the_circle_is_known():
    known = replace(RING, mean_sigma_px=0.1)
    followed = known.followed_by(replace(RING, center_px=(60.0, 40.0), radius_px=30.0, fitted_us=9), 0.2)
    assert followed.center_px == pytest.approx((52.0, 40.0))
    assert followed.radius_px == pytest.approx(22.0)
    assert followed.fitted_us == 9


def test_circle_known_badly_gives_way_to_a_better_one():
    followed = replace(RING, mean_sigma_px=10.0).followed_by(replace(RING, center_px=(60.0, 40.0)), 0.2)
    assert followed.center_px[0] > 59.8


@pytest.mark.parametrize("sigma", [math.inf, 0.0])
def test_unknown_deviation_leaves_the_share_as_it_is(sigma):
    other = replace(RING, center_px=(60.0, 40.0), sigma_px=sigma)
    assert replace(RING, mean_sigma_px=sigma).followed_by(other, 0.5).center_px == (55.0, 40.0)


def test_step_wider_than_the_band_is_taken_whole():
    other = replace(RING, center_px=(50.0, 66.0))
    assert RING.followed_by(other, 0.2) == other


def test_band_and_its_flanks():
    points = np.array([[70.0, 40.0], [50.0, 62.0], [50.0, 15.0], [50.0, 40.0]])
    ring = replace(RING, reach_px=3.0)
    near, bearings = ring.near(points)
    assert near.tolist() == [True, True, False, False]
    assert bearings == pytest.approx([0.0, math.pi / 2])
    assert ring.beside(points) == pytest.approx(0.5)
    assert ring.beside(points[3:]) == 0.0
