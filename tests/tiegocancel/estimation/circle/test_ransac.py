"""Find the circle among outliers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.estimation.circle.fit import CircleFit, NoCircle
from tiegocancel.estimation.circle.ransac import RansacConfig, fit_circle_among


def cloud(rng, *, center=(300.0, 200.0), radius=90.0, arc=2 * math.pi, band=1.0, outliers=0.4, count=2000):
    """Return points of a band about a circle, and of a background on 640 × 480 px."""
    bearings = rng.uniform(0, arc, count)
    away = radius + rng.uniform(-band, band, count)
    points = np.array(center) + away[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    stray = rng.random(count) < outliers
    points[stray] = rng.uniform((0, 0), (640, 480), (int(stray.sum()), 2))
    return points, ~stray


@settings(max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    center=st.tuples(st.floats(150, 490), st.floats(100, 380)),
    radius=st.floats(40, 150),
    arc=st.floats(2.5, 2 * math.pi),
    method=st.sampled_from(["pratt", "taubin"]),
)
def test_forty_percent_outliers_hardly_move_the_circle(seed, center, radius, arc, method):
    rng = np.random.default_rng(seed)
    points, true = cloud(rng, center=center, radius=radius, arc=arc)
    fit = fit_circle_among(points, rng=rng, method=method)
    assert isinstance(fit, CircleFit)
    assert fit.center_px == pytest.approx(center, abs=1.0)
    assert fit.radius_px == pytest.approx(radius, abs=1.0)
    assert (fit.inliers & true).sum() >= 0.99 * true.sum()


def test_band_wider_than_the_tolerance_is_taken_whole():
    points, true = cloud(np.random.default_rng(1), band=12.0, arc=2.5, outliers=0.1)
    fit = fit_circle_among(points, rng=np.random.default_rng(2), config=RansacConfig(tolerance_px=3.0))
    assert (fit.inliers & true).sum() >= 0.98 * true.sum()
    assert fit.center_px == pytest.approx((300, 200), abs=5 * fit.center_sigma_px)
    assert fit.center_sigma_px < 1.0
    assert fit.rms_px == pytest.approx(12 / math.sqrt(3), rel=0.1)


def test_same_points_and_seed_give_the_same_circle():
    points, _ = cloud(np.random.default_rng(1))
    one, other = (fit_circle_among(points, rng=np.random.default_rng(5)) for _ in range(2))
    assert one.center_px == other.center_px
    assert np.array_equal(one.inliers, other.inliers)


def test_background_alone_has_few_events_on_any_circle():
    points, _ = cloud(np.random.default_rng(1), outliers=1.0)
    fit = fit_circle_among(points, rng=np.random.default_rng(2), config=RansacConfig(widest_share=0.2))
    assert isinstance(fit, NoCircle) or fit.inlier_share < 0.5


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (np.zeros((2, 2)), "2 points"),
        (np.full((50, 2), 3.0), "no three points"),
        (np.column_stack([np.arange(50.0), np.arange(50.0)]), "no three points"),
    ],
)
def test_points_without_a_circle_say_so(points, reason):
    fit = fit_circle_among(points, rng=np.random.default_rng(0))
    assert isinstance(fit, NoCircle)
    assert reason in fit.reason


@pytest.mark.parametrize(
    "setting",
    [{"tolerance_px": 0.0}, {"tolerance_px": math.nan}, {"confidence": 1.0}, {"max_draws": 0}, {"widest_share": 1.0}],
)
def test_settings_out_of_range_are_refused(setting):
    with pytest.raises(ValueError, match=next(iter(setting))):
        RansacConfig(**setting)
