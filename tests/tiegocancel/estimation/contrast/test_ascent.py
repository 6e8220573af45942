"""Climb to rotations and pans, know how far to trust the peak, and leave out what moves otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.estimation.contrast.ascent import Ascent, ascend, rates_of, twist_of
from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.window import Window
from tiegocancel.events import Events

CENTER, OMEGA = (150.0, 110.0), 5.0
ANCHOR = (160.0, 120.0)
SPAN_US = 20_000
TRUE = Twist.about(CENTER, OMEGA, ANCHOR)


def window_of(events, **change):
    return Window(events, **({"start_us": 0, "stop_us": SPAN_US, "anchor_px": ANCHOR} | change))


def swept_edges(seed, *, twist=TRUE, segments=60, width=320, height=240, noise=0.05):
    """Return events of straight edges that move with a twist: each pixel fires once, as an edge reaches it."""
    rng = np.random.default_rng(seed)
    middle = np.stack([rng.uniform(-40, width + 40, segments), rng.uniform(-40, height + 40, segments)])[:, :, None]
    along, half = rng.uniform(0, np.pi, segments), rng.uniform(5, 20, segments)
    reach = np.linspace(-1.0, 1.0, 80) * half[:, None]
    x0, y0 = middle + np.stack([np.cos(along)[:, None] * reach, np.sin(along)[:, None] * reach])
    polarity = rng.integers(0, 2, segments)
    center = twist.center_px(ANCHOR)
    fired = np.zeros(segments * width * height, np.bool_)
    columns = []
    step_us = SPAN_US // 200
    for t in range(0, SPAN_US, step_us):
        angle = twist.omega_rad_s * t * 1e-6
        right, down = x0 - center[0], y0 - center[1]
        x = np.floor(center[0] + np.cos(angle) * right - np.sin(angle) * down + 0.5).astype(np.int64)
        y = np.floor(center[1] + np.sin(angle) * right + np.cos(angle) * down + 0.5).astype(np.int64)
        seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        edge = np.broadcast_to(np.arange(segments)[:, None], x.shape)[seen]
        cell = np.unique((edge * height + y[seen]) * width + x[seen])
        cell = cell[~fired[cell]]
        fired[cell] = True
        if t == 0:
            continue  # where edges are at first, nothing has changed yet
        columns.append([t + rng.integers(0, step_us, len(cell)), cell % width, cell // width % height,
                        polarity[cell // (width * height)]])  # fmt: skip
    t, x, y, p = (np.concatenate(column) for column in zip(*columns, strict=True))
    stray = int(noise * len(t))
    more = [rng.integers(0, side, stray) for side in (SPAN_US, width, height, 2)]
    return Events.from_unsorted(*(np.append(*pair) for pair in zip((t, x, y, p), more, strict=True)), width, height)[0]


def distance_px(one: Twist, other: Twist, window: Window) -> float:
    """Return how far two motions part in half a window, at the typical distance."""
    apart = np.subtract(one, other) * (1.0, 1.0, window.radius_px) * window.half_s
    return float(np.abs(apart).max())


def error_px(ascent: Ascent, true: Twist, window: Window) -> float:
    """Return how far a climb ended from a motion."""
    return distance_px(ascent.twist, true, window)


def test_rates_and_twists_convert_both_ways():
    assert twist_of(rates_of(TRUE)) == TRUE
    assert rates_of(Twist(3.0, 4.0, 0.0)).tolist() == [0.0, 0.0, 3.0, 0.0, 0.0, 4.0]
    assert rates_of(Twist(0.0, 0.0, 2.0)).tolist() == [0.0, -2.0, 0.0, 2.0, 0.0, 0.0]


@pytest.mark.parametrize("factor", [0.92, 0.97, 1.0, 1.03, 1.08])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rotation_is_found_from_some_percent_off(turning, factor, sign):
    true = TRUE.scaled(sign)
    window = window_of(turning(CENTER, sign * OMEGA, span_us=SPAN_US, count=8_000))
    found = ascend(window, true.scaled(factor))
    assert found.converged
    assert found.twist.omega_rad_s == pytest.approx(sign * OMEGA, rel=0.01)
    assert found.twist.center_px(ANCHOR) == pytest.approx(CENTER, abs=1.5)
    assert error_px(found, true, window) < 0.1
    assert found.gain > 1.3
    assert found.correlation > 0.5


@pytest.mark.parametrize("factor", [0.92, 1.08])
def test_pan_is_found_from_some_percent_off(turning, factor):
    far = (150.0, -40_000.0)  # so far away that the path is straight: 401 px/s to the left
    window = window_of(turning(far, 0.01, span_us=SPAN_US, count=8_000))
    found = ascend(window, Twist(-401.2 * factor, 0.0, 0.0))
    assert found.converged
    assert found.twist[:2] == pytest.approx((-401.2, 0.0), abs=5.0)
    assert found.twist.omega_rad_s == pytest.approx(0.0, abs=0.1)


def test_coarse_cells_reach_a_peak_many_px_away(turning):
    window = window_of(turning(CENTER, OMEGA, span_us=50_000), stop_us=50_000)
    far = Twist.about((170.0, 118.0), 1.5 * OMEGA, ANCHOR)
    found = ascend(window, far, cells_px=(8.0, 4.0, 2.0))
    assert distance_px(far, TRUE, window) > 5.0
    assert error_px(found, TRUE, window) < 0.1


@pytest.mark.parametrize("kind", ["points", "edges"])
def test_covariance_says_how_large_the_errors_are(turning, kind):
    surprise = []
    for seed in range(16):
        events = turning(span_us=SPAN_US, count=8_000, seed=seed) if kind == "points" else swept_edges(seed)
        found = ascend(window_of(events), TRUE.scaled(1.02))
        assert found.converged
        off = np.subtract(found.twist, TRUE)
        surprise.append(off @ np.linalg.solve(found.covariance, off) / 3.0)
        assert np.abs(off).max() > 0.0
    assert 0.4 < np.mean(surprise) < 2.0


def crowded(turning, share):
    """Return a rotation with a dense group of points in the lower right that moves nearly, but not quite, alike."""
    events = turning(CENTER, OMEGA, span_us=SPAN_US, count=12_000, noise=0.0)
    events = events.select(~((events.x > 200) & (events.y > 140)))
    rng = np.random.default_rng(5)
    count = int(share * len(events))
    t, point = rng.integers(0, SPAN_US, count), rng.integers(0, 40, count)
    vx, vy, _ = TRUE.seen_from(ANCHOR, (260.0, 195.0))
    x = rng.uniform(225, 295, 40)[point] + 1e-6 * (vx + 120.0) * (t - SPAN_US / 2)
    y = rng.uniform(165, 225, 40)[point] + 1e-6 * (vy - 90.0) * (t - SPAN_US / 2)
    more = (t, np.floor(x + 0.5).astype(np.int64), np.floor(y + 0.5).astype(np.int64), point % 2)
    return Events.from_unsorted(
        *(np.append(*pair) for pair in zip((events.t, events.x, events.y, events.p), more, strict=True)), 320, 240
    )[0]


def test_mover_in_a_corner_has_no_say(turning):
    window = window_of(crowded(turning, 0.25))
    found = ascend(window, TRUE.scaled(1.03))
    assert found.converged
    assert error_px(found, TRUE, window) < 0.1
    assert found.kept_share < 0.9
    assert ascend(window, TRUE.scaled(1.03), robust=False).kept_share == 1.0


def test_static_flicker_in_a_corner_has_no_say(turning):
    moving = turning(CENTER, OMEGA, span_us=SPAN_US, count=12_000, noise=0.0)
    moving = moving.select(~((moving.x < 80) & (moving.y < 80)))
    rng = np.random.default_rng(3)
    cell = rng.integers(0, 5, (len(moving) // 3, 2))
    more = (rng.integers(0, SPAN_US, len(cell)), *(16 * cell.T), cell.sum(axis=1) % 2)
    events, _ = Events.from_unsorted(
        *(np.append(*pair) for pair in zip((moving.t, moving.x, moving.y, moving.p), more, strict=True)), 320, 240
    )
    window = window_of(events)
    found = ascend(window, TRUE.scaled(1.03))
    assert error_px(found, TRUE, window) < 0.15


def test_small_object_tells_its_velocity_but_hardly_a_centre():
    rng = np.random.default_rng(1)
    t, point = np.sort(rng.integers(0, SPAN_US, 3000)), rng.integers(0, 20, 3000)
    x = rng.uniform(197, 203, 20)[point] + 400e-6 * (t - SPAN_US / 2)
    y = rng.uniform(97, 103, 20)[point] + 50e-6 * (t - SPAN_US / 2)
    events = Events(t, np.floor(x + 0.5).astype(int), np.floor(y + 0.5).astype(int), point % 2, 320, 240)
    window = window_of(events, anchor_px=(200.0, 100.0))
    found = ascend(window, Twist(380.0, 40.0, 0.0))
    assert found.twist[:2] == pytest.approx((400.0, 50.0), abs=15.0)
    assert found.support < 16
    assert abs(found.twist.omega_rad_s) < 4.0 * float(np.sqrt(found.covariance[2, 2]))
    assert np.sqrt(found.covariance[2, 2]) > 0.5


def test_support_counts_the_tiles_that_share_a_motion(turning):
    wide = ascend(window_of(turning(CENTER, OMEGA, span_us=SPAN_US, count=8_000)), TRUE)
    assert 20 < wide.support <= len(wide.agreeing) * 1.5
    assert 0.5 < wide.kept_share <= 1.0


@pytest.mark.parametrize("count", [1, 2, 3])
def test_hardly_any_events_are_no_peak_and_no_crash(count):
    events = Events(list(range(0, 100 * count, 100)), [100] * count, [90] * count, [1] * count, 320, 240)
    found = ascend(window_of(events), TRUE)
    assert not found.converged
    assert np.isfinite(found.twist).all()


def test_events_that_never_meet_are_no_peak():
    early = Events([5, 10, 15], [1, 50, 90], [1, 50, 90], [1, 0, 1], 320, 240)
    found = ascend(window_of(early), TRUE)
    assert not found.converged
    assert not np.isfinite(found.covariance).any()


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("start", [Twist(1e9, 0.0, 0.0), Twist(0.0, 0.0, 1e6), Twist(-1e12, 1e12, -1e9)])
def test_start_that_throws_every_event_out_is_no_peak(turning, start):
    found = ascend(window_of(turning(span_us=SPAN_US, count=500)), start)
    assert not found.converged or found.correlation < 0.25


def test_same_events_give_the_same_bits(turning):
    events = turning(span_us=SPAN_US, count=4_000)
    one, other = (ascend(window_of(events), TRUE.scaled(1.02)) for _ in range(2))
    assert one.twist == other.twist
    assert one.covariance.tobytes() == other.covariance.tobytes()
