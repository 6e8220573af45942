"""Fit circles to points whose circle is known, and refuse points that have none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.circle.fit import CircleFit, NoCircle, arc_rad, fit_circle

METHODS = pytest.mark.parametrize("method", ["pratt", "taubin"])


def on_circle(center, radius, bearings, noise=0.0, seed=0):
    bearings = np.asarray(bearings)
    points = np.array(center) + radius * np.column_stack([np.cos(bearings), np.sin(bearings)])
    return points + noise * np.random.default_rng(seed).normal(size=points.shape)


@METHODS
@given(
    center=st.tuples(st.floats(-5000, 5000), st.floats(-5000, 5000)),
    radius=st.floats(0.5, 5000),
    start=st.floats(-math.pi, math.pi),
    arc=st.floats(0.3, 2 * math.pi),
    count=st.integers(3, 60),
)
def test_points_on_a_circle_give_that_circle(method, center, radius, start, arc, count):
    fit = fit_circle(on_circle(center, radius, start + arc * np.arange(count) / count), method=method)
    assert isinstance(fit, CircleFit)
    slack = 1e-6 * (radius + np.abs(center).max())
    assert fit.center_px == pytest.approx(center, abs=slack)
    assert fit.radius_px == pytest.approx(radius, abs=slack)
    assert fit.rms_px <= slack
    assert fit.inlier_share == 1.0


@METHODS
@given(
    turn=st.floats(-math.pi, math.pi),
    shift=st.tuples(st.floats(-900, 900), st.floats(-900, 900)),
    seed=st.integers(0, 99),
)
def test_fit_moves_and_turns_with_the_points(method, turn, shift, seed):
    points = on_circle((3, -2), 40, np.linspace(0, 2, 50), noise=1.0, seed=seed)
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    one, other = fit_circle(points, method=method), fit_circle(points @ rotation.T + shift, method=method)
    assert isinstance(one, CircleFit)
    assert isinstance(other, CircleFit)
    assert other.center_px == pytest.approx(tuple(rotation @ one.center_px + shift), abs=1e-5)
    assert other.radius_px == pytest.approx(one.radius_px, abs=1e-5)


@METHODS
def test_short_noisy_arcs_are_not_pulled_to_small_circles(method):
    """Kåsa's fit, the plain linear one, loses a fifth of the radius on such arcs."""
    radii = [
        fit_circle(on_circle((0, 0), 100, np.linspace(-0.5, 0.5, 200), noise=4.0, seed=seed), method=method).radius_px
        for seed in range(60)
    ]
    assert np.median(radii) == pytest.approx(100, rel=0.05)


@METHODS
@pytest.mark.parametrize("arc", [2.0, 2 * math.pi])
def test_covariance_foretells_the_scatter_of_the_centre(method, arc):
    fits = [
        fit_circle(on_circle((9, 7), 50, arc * np.arange(150) / 150, noise=1.0, seed=seed), method=method)
        for seed in range(300)
    ]
    scatter = np.cov(np.array([fit.center_px for fit in fits]).T)
    foretold = np.mean([fit.covariance_px2 for fit in fits], axis=0)
    assert foretold == pytest.approx(scatter, rel=0.3, abs=0.15 * np.abs(scatter).max())
    assert fits[0].center_sigma_px == pytest.approx(math.sqrt(np.linalg.eigvalsh(scatter)[-1]), rel=0.3)


def test_residual_is_that_of_the_distances():
    fit = fit_circle(on_circle((0, 0), 30, np.linspace(0, 6, 400), noise=2.0))
    distance = np.hypot(*(on_circle((0, 0), 30, np.linspace(0, 6, 400), noise=2.0) - fit.center_px).T)
    assert fit.rms_px == pytest.approx(np.sqrt(np.mean((distance - fit.radius_px) ** 2)))
    assert fit.worst_px == pytest.approx(np.abs(distance - fit.radius_px).max())


def test_three_points_leave_the_centre_without_a_deviation():
    fit = fit_circle(np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]))
    assert fit.center_px == pytest.approx((1, 1))
    assert fit.center_sigma_px == math.inf


LINE = np.column_stack([np.arange(20.0), 3.0 * np.arange(20.0) + 1000.0])


@METHODS
@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (np.zeros((0, 2)), "0 points determine no circle"),
        (LINE[:2], "2 points determine no circle"),
        (np.full((9, 2), 77.0), "all points coincide"),
        (np.repeat(LINE[:2], 5, axis=0), "fewer than three distinct points|on a line"),
        (LINE, "on a line"),
        (LINE + 1e-6 * np.random.default_rng(0).normal(size=LINE.shape), "on a line"),
    ],
)
def test_points_without_a_circle_say_so(method, points, reason):
    fit = fit_circle(points, method=method)
    assert isinstance(fit, NoCircle)
    assert any(part in fit.reason for part in reason.split("|"))


@pytest.mark.parametrize("points", [np.zeros(6), np.zeros((3, 3)), np.array([[0, 1], [2, np.nan], [3, 4.0]])])
def test_malformed_points_are_refused(points):
    with pytest.raises(ValueError, match="points_px must be"):
        fit_circle(points)


def test_unknown_method_is_refused():
    with pytest.raises(ValueError, match="method must be pratt or taubin, not 'kasa'"):
        fit_circle(LINE, method="kasa")


BIN = 2 * math.pi / 64


@pytest.mark.parametrize(
    ("bearings", "arc"),
    [
        (np.linspace(-math.pi, math.pi, 1000), 2 * math.pi),
        (np.linspace(-0.5, 0.7, 1000), 1.2),
        (np.linspace(math.pi - 0.5, math.pi + 0.5, 1000), 1.0),
        (np.append(np.linspace(0, 1, 2000), [2.0, 3.0, -2.0]), 1.0),
        (np.array([]), 0.0),
    ],
)
def test_arc_is_the_circle_less_its_widest_gap(bearings, arc):
    wrapped = (bearings + math.pi) % (2 * math.pi) - math.pi
    assert arc_rad(wrapped) == pytest.approx(arc, abs=2 * BIN)
