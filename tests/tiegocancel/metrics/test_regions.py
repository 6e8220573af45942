"""Regions count pixels exactly, and the disc's radius is found where the world goes quiet."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.metrics import DiscRegion, Tally, estimate_radius_px


@pytest.mark.parametrize("center", [(20.0, 15.0), (-100.0, 15.0), (1e6, -1e6)])
def test_areas_cover_the_sensor_and_rings_hold_their_radii(center: tuple[float, float]) -> None:
    region = DiscRegion(40, 30, center_px=center, radius_px=12.5, ring_px=4.0)
    assert region.areas_px.sum() == 1200
    x, y = np.meshgrid(np.arange(40), np.arange(30))
    radius = np.hypot(x - center[0], y - center[1]).ravel()
    everywhere = Events(np.zeros(1200, int), x.ravel(), y.ravel(), np.ones(1200, int), 40, 30)
    codes = region.codes(everywhere)
    assert ((codes & 1) == (radius <= 12.5)).all()
    assert (radius >= region.ring_edges_px[codes >> 1] - 1e-6).all()
    assert (radius <= region.ring_edges_px[(codes >> 1) + 1] + 1e-6).all()


def test_radius_of_a_busy_disc_on_a_quiet_background_is_found() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.integers(0, 320, 60_000), rng.integers(0, 240, 60_000)
    inside = np.hypot(x - 150, y - 120) <= 80
    keep = inside | (rng.random(60_000) < 0.05)
    n = int(keep.sum())
    events = Events(np.zeros(n, int), x[keep], y[keep], np.ones(n, int), 320, 240)
    radius_px, edge_seen = estimate_radius_px(events, (150.0, 120.0))
    assert radius_px == pytest.approx(80, abs=4)
    assert edge_seen


@pytest.mark.parametrize("center", [(150.0, 120.0), (-500.0, 120.0)])
def test_without_an_edge_the_circle_holds_nearly_all_events(center: tuple[float, float]) -> None:
    rng = np.random.default_rng(0)
    x, y = rng.integers(0, 320, 20_000), rng.integers(0, 240, 20_000)
    events = Events(np.zeros(20_000, int), x, y, np.ones(20_000, int), 320, 240)
    radius_px, edge_seen = estimate_radius_px(events, center)
    assert not edge_seen
    assert (np.hypot(x - center[0], y - center[1]) <= radius_px).mean() == pytest.approx(0.99, abs=0.01)
    assert estimate_radius_px(events[:0], center)[1] is False


def test_signal_to_noise_is_that_of_densities_and_open_without_background() -> None:
    region = DiscRegion(10, 10, center_px=(2.0, 2.0), radius_px=1.0)
    tally = Tally(region, counted_from_us=0)
    events = Events(np.zeros(11, int), np.array([2] * 10 + [9]), np.array([2] * 10 + [9]), np.ones(11, int), 10, 10)
    suppressed = np.array([True] * 8 + [False] * 3)
    tally.add(events, suppressed)
    assert tally.signal_to_noise() == {
        "before": pytest.approx((10 / 5 - 1 / 95) / (1 / 95)),
        "after": pytest.approx((2 / 5 - 1 / 95) / (1 / 95)),
    }
    quiet = Tally(region, counted_from_us=0)
    quiet.add(events[:10], suppressed[:10])
    assert quiet.signal_to_noise() == {"before": None, "after": None}
    area, before, after = tally.radial()
    assert (area.sum(), before.sum(), after.sum()) == (100, 11, 3)
