"""Estimate markers that turn, and refuse scenes without one."""

from __future__ import annotations

import math
from dataclasses import asdict
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.estimation.circle.estimator import CircleConfig, CircleEstimator
from tiegocancel.estimation.estimate import trajectory_of
from tiegocancel.events import Events
from tiegocancel.scene import SceneConfig, simulate

CENTER, RADIUS = (160.0, 120.0), 70.0


def marker(
    omega_rad_s=30.0, *, span_us=150_000, rate_mev_s=0.3, blob_px=4.0, background=0.2, start_us=0, rim=False, seed=0
):
    """Return events of a round blob (or all of a rim) on a circle, and of a background, on 320 × 240 px."""
    rng = np.random.default_rng(seed)
    count = int(span_us * rate_mev_s)
    t = np.sort(rng.integers(0, span_us, count))
    bearing = rng.uniform(-math.pi, math.pi, count) if rim else omega_rad_s * t * 1e-6
    place = np.array(CENTER) + RADIUS * np.column_stack([np.cos(bearing), np.sin(bearing)])
    place += rng.normal(0, blob_px / 2, (count, 2))
    stray = rng.random(count) < background
    place[stray] = rng.uniform((0, 0), (319, 239), (int(stray.sum()), 2))
    x, y = np.clip(np.floor(place + 0.5), 0, (319, 239)).astype(np.int64).T
    return Events(t + start_us, x, y, rng.integers(0, 2, count), 320, 240)


def estimates(events, *, start_us=None, seed=0, **setting):
    config = CircleConfig(**setting)
    return CircleEstimator(config, width=events.width, height=events.height, start_us=start_us, seed=seed).process(
        events
    )


def confident(rows):
    return [row for row in rows if row.confident]


@pytest.mark.parametrize("omega", [30.0, -60.0, 121.8, -900.0])
@pytest.mark.parametrize("setting", [{"method": "pratt"}, {"method": "taubin"}])
def test_marker_in_background_gives_centre_and_omega(omega, setting):
    rows = estimates(marker(omega), **setting)
    found = confident(rows)
    assert len(found) > 20
    assert all(abs(row.omega_rad_s - omega) < max(1.0, 0.01 * abs(omega)) for row in found)
    assert all(math.dist(row.center_px, CENTER) < 2.0 for row in found)
    assert all(0 < row.omega_sigma_rad_s < 0.1 * abs(omega) for row in found)
    assert all(row.events_used <= row.events_seen for row in rows)


def test_forty_percent_background_is_borne():
    found = confident(estimates(marker(60.0, background=0.4)))
    assert len(found) > 20
    assert all(abs(row.omega_rad_s - 60.0) < 2.0 for row in found)
    assert found[-1].omega_rad_s == pytest.approx(60.0, abs=1.0)


def test_deviations_cover_the_errors():
    errors = [
        (row.omega_rad_s - 60.0) / row.omega_sigma_rad_s
        for seed in range(3)
        for row in confident(estimates(marker(60.0, seed=seed), omega_smoothing=1.0))
    ]
    assert 0.2 < np.sqrt(np.mean(np.square(errors))) < 1.5


def test_slow_marker_gathers_its_arc_over_many_windows():
    rows = estimates(
        marker(3.6, span_us=1_200_000, rate_mev_s=0.04),
        window_us=50_000,
        step_us=20_000,
        slot_us=2000,
        max_omega_rad_s=100.0,
    )
    first = next(index for index, row in enumerate(rows) if row.confident)
    assert rows[first].t_us > 2.3 / 3.6 * 1e6
    assert "arc too short" in rows[first - 1].doubt
    assert rows[first - 1].omega_rad_s == 0.0
    assert not rows[first - 1].has_center
    assert rows[-1].omega_rad_s == pytest.approx(3.6, abs=0.4)


def test_fit_without_ransac_works_on_clean_events_and_refuses_outliers():
    clean = confident(estimates(marker(60.0, background=0.0), ransac=False))
    assert clean[-1].omega_rad_s == pytest.approx(60.0, abs=0.5)
    assert not confident(estimates(marker(60.0, background=0.02), ransac=False))
    assert not confident(estimates(marker(60.0, background=0.2), ransac=False))


def test_differencing_consecutive_events_of_a_broad_marker_is_refused_with_its_deviation():
    rows = estimates(marker(60.0), differencing="events")
    assert not confident(rows)
    assert any("differences of consecutive events" in row.doubt or "not constrained" in row.doubt for row in rows)


def test_differencing_consecutive_events_serves_a_marker_of_one_pixel_at_a_low_rate():
    events = marker(30.0, span_us=1_000_000, rate_mev_s=0.002, blob_px=0.0, background=0.0)
    slots = {"window_us": 100_000, "step_us": 20_000, "slot_us": 5000, "max_omega_rad_s": 300.0}
    found = confident(estimates(events, differencing="events", **slots))
    assert found[-1].omega_rad_s == pytest.approx(30.0, abs=5.0)
    assert found[-1].omega_sigma_rad_s > 20 * confident(estimates(events, **slots))[-1].omega_sigma_rad_s


def test_rim_without_a_marker_tells_the_centre_but_no_omega():
    rows = estimates(marker(rim=True))
    assert not confident(rows)
    assert all("a rim tells the centre, no ω" in row.doubt for row in rows)
    assert rows[-1].center_px == pytest.approx(CENTER, abs=1.0)
    assert rows[-1].center_sigma_px < 1.0
    assert (rows[-1].omega_rad_s, rows[-1].omega_sigma_rad_s) == (0.0, math.inf)


@pytest.mark.parametrize(("change", "reason"), [({"omega_rad_s": 0.0}, "no rim"), ({"background": 1.0}, "no rim")])
def test_blob_at_rest_and_noise_are_refused(change, reason):
    rows = estimates(marker(**change, span_us=80_000))
    assert rows
    assert not any(row.confident or row.has_center for row in rows)
    assert all(reason in row.doubt for row in rows)


def test_marker_that_stops_is_followed_about_the_centre_held():
    turning = marker(60.0, background=0.05)
    still = marker(0.0, span_us=300_000, start_us=150_000, background=0.05)
    rows = estimates(Events.concatenate([turning, still]))
    held = [row for row in rows if row.doubt.startswith("centre held")]
    assert held
    assert all(row.confident and row.center_sigma_px == math.inf for row in held)
    assert all(math.dist(row.center_px, CENTER) < 2.0 for row in held)
    assert held[-1].omega_rad_s == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("pause_us", [0, 3_000_000])
def test_marker_that_goes_on_elsewhere_is_found_again(pause_us):
    here = marker(60.0, span_us=100_000)
    there = marker(-60.0, span_us=150_000, start_us=100_000 + pause_us, background=0.0)
    there = Events(there.t, there.x // 2, there.y // 2, there.p, 320, 240)
    last = confident(estimates(Events.concatenate([here, there])))[-1]
    assert last.t_us > 240_000 + pause_us
    assert last.center_px == pytest.approx((79.75, 59.75), abs=1.0)
    assert last.omega_rad_s == pytest.approx(-60.0, abs=1.0)


def test_stretch_without_events_gets_one_row_and_the_last_values():
    early, late = marker(60.0, span_us=100_000), marker(60.0, span_us=100_000, start_us=3_600_000_000)
    rows = estimates(Events.concatenate([early, late]))
    quiet = [row for row in rows if row.doubt == "no events"]
    assert len(quiet) == 1
    assert quiet[0].omega_rad_s == pytest.approx(60.0, abs=1.0)
    assert quiet[0].omega_sigma_rad_s == math.inf
    assert len(rows) < 120
    assert all(one.t_us < other.t_us for one, other in pairwise(rows))
    assert confident(rows)[-1].t_us > 3_600_000_000


def same(one, other):
    """Tell whether rows are equal, NaN to NaN."""
    return repr([asdict(row) for row in one]) == repr([asdict(row) for row in other])


@settings(max_examples=10)
@given(cuts=st.lists(st.integers(0, 6000), max_size=20), gap=st.booleans())
def test_chunk_borders_change_nothing(cuts, gap):
    events = marker(60.0, span_us=100_000, rate_mev_s=0.06)
    if gap:
        events = events.select((events.t < 45_000) | (events.t > 85_000))
    cuts = sorted({0, len(events), *(min(cut, len(events)) for cut in cuts)})
    estimator = CircleEstimator(width=320, height=240)
    rows = [row for first, last in pairwise(cuts) for row in estimator.process(events[first:last])]
    assert len(rows) > 5
    assert same(rows, estimates(events))


def test_estimate_depends_on_no_event_at_or_after_its_time():
    events = marker(60.0, span_us=80_000)
    early = events.between(0, 60_000)
    other = marker(-60.0, span_us=30_000, start_us=60_000, seed=3)
    known = [row for row in estimates(events) if row.t_us <= 60_000]
    swapped = [row for row in estimates(Events.concatenate([early, other])) if row.t_us <= 60_000]
    assert len(known) > 15
    assert same(known, swapped)


def test_times_lie_on_the_grid_of_the_start_given():
    events = marker(60.0, span_us=60_000, start_us=5_000)
    rows = estimates(events, start_us=10_000)
    assert rows[0].t_us == 30_000
    assert {row.t_us % 2000 for row in rows} == {0}


def test_estimates_make_a_causal_trajectory():
    trajectory = trajectory_of(estimates(marker(60.0)), source="circle")
    assert trajectory.interpolation == "causal"
    assert trajectory.omega_rad_s[-1] == pytest.approx(60.0, abs=1.0)


def test_chunks_out_of_order_or_of_another_sensor_are_refused():
    estimator = CircleEstimator(width=320, height=240)
    estimator.process(marker(span_us=1000, start_us=5000))
    with pytest.raises(ValueError, match="chunks must follow each other"):
        estimator.process(marker(span_us=1000))
    with pytest.raises(ValueError, match="sensor"):
        estimator.process(Events.empty(640, 480))


@pytest.mark.parametrize(
    "setting",
    [
        {"window_us": 10},
        {"window_us": True},
        {"step_us": 30_000},
        {"center_window_us": 1000},
        {"slot_us": 10_000},
        {"cloud_events": 5},
        {"method": "kasa"},
        {"differencing": "pixels"},
        {"tolerance_px": 0.0},
        {"center_smoothing": 0.0},
        {"omega_smoothing": 1.5},
        {"least_arc_rad": 7.0},
        {"least_inlier_share": math.nan},
        {"widest_share": 0.0},
        {"most_beside": -1.0},
        {"least_resultant": 1.1},
        {"max_omega_rad_s": 5000.0},
    ],
)
def test_settings_out_of_range_are_refused(setting):
    with pytest.raises(ValueError, match=next(iter(setting))):
        CircleConfig(**setting)


@pytest.fixture(scope="module")
def disc():
    return Events.concatenate(list(simulate(SceneConfig.disc(width=640, height=360), duration_s=0.06, seed=1)))


@pytest.mark.parametrize("setting", [{}, {"ransac": False}, {"method": "pratt"}, {"differencing": "events"}])
def test_textured_disc_is_refused_in_every_window(disc, setting):
    rows = estimates(disc, **setting)
    assert len(rows) >= 20
    assert not any(row.confident or row.has_center for row in rows)
    assert all(row.doubt.startswith("no ") and row.omega_rad_s == 0.0 for row in rows)


def test_real_spinning_dot(recording):
    from tiegocancel.files import read_events

    rows = estimates(read_events(recording("spinning_dot_evt2.raw")))
    assert all(row.confident for row in rows)
    assert all(math.dist(row.center_px, (314.4, 202.5)) < 2.0 for row in rows)
    assert all(abs(row.omega_rad_s - 121.8) < 3 * row.omega_sigma_rad_s for row in rows)
    assert all(abs(row.omega_rad_s - 121.8) < 1.0 for row in rows if row.t_us > rows[0].t_us + 15_000)


def test_real_textured_disc_is_refused_in_every_window(recording):
    table = np.load(recording("anu_disc_10ms.npy"))
    x, y, p, t_s, _ = table[table[:, 4] == 0].T
    t_us = np.round(t_s.astype(np.float64) * 1e6).astype(np.int64)
    events = Events(t_us, x.astype(np.int64), y.astype(np.int64), p.astype(np.int64), 1280, 720)
    for setting in ({}, {"ransac": False}, {"method": "pratt"}):
        rows = estimates(events, window_us=4000, step_us=500, **setting)
        assert len(rows) >= 10
        assert not any(row.confident or row.has_center for row in rows)
