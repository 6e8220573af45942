"""Find rotations from scratch, and refine them beside things that move otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.estimation.contrast.refine import refine
from tiegocancel.estimation.contrast.scorer import Contrast, Twist
from tiegocancel.estimation.contrast.search import polish, search, thinned
from tiegocancel.events import Events

ANCHOR = (160.0, 120.0)


def from_scratch(events):
    return search(events, anchor_px=ANCHOR, max_omega_rad_s=200.0, signed=True, rng=np.random.default_rng(0))


@pytest.mark.parametrize(
    ("center", "omega"),
    [((150, 110), 4.0), ((150, 110), -4.0), ((10, 235), 15.0), ((-150, 60), 4.0), ((170, 120), 70.0)],
)
def test_rotation_is_found_from_scratch(turning, center, omega):
    _, best = from_scratch(turning(center, omega, count=30_000))[0]
    assert best.omega_rad_s == pytest.approx(omega, rel=0.03)
    assert best.center_px(ANCHOR) == pytest.approx(center, abs=8)


def test_candidates_come_best_first_and_differ(turning):
    found = from_scratch(turning())
    gains = [gain for gain, _ in found]
    assert gains == sorted(gains, reverse=True)
    assert len({twist for _, twist in found}) == len(found)


def test_search_stays_within_the_bound_on_omega(turning):
    found = search(
        turning(omega_rad_s=20.0), anchor_px=ANCHOR, max_omega_rad_s=6.0, signed=True, rng=np.random.default_rng(0)
    )
    assert max(abs(twist.omega_rad_s) for _, twist in found) <= 6.0


def test_polish_with_no_room_for_omega_finds_a_translation(turning):
    events = turning((150.0, -40_000.0), 0.01)  # so far away that the path is straight: 401 px/s to the left
    scorer = Contrast(events, anchor_px=ANCHOR, cell_bits=1, signed=True, slots=256)
    best, gain = polish(Twist(-380.0, 20.0, 0.0), scorer, 0.0, evaluations=100)
    assert best.omega_rad_s == 0.0
    assert best == pytest.approx((-401.0, 0.0, 0.0), abs=5)
    assert gain > 1.5


def test_refine_leaves_out_a_static_corner(turning):
    moving, rng = turning(noise=0.0), np.random.default_rng(3)
    # A flickering board in the upper left, as many events as the rotation has: fixed pixels, both polarities in step.
    count = len(moving)
    cells = rng.integers(0, 5, (count, 2)) * 16
    t = rng.integers(0, 50_000, count)
    rest = ~((moving.x < 80) & (moving.y < 80))
    events, _ = Events.from_unsorted(
        np.concatenate([moving.t[rest], t]),
        np.concatenate([moving.x[rest].astype(np.int64), cells[:, 0]]),
        np.concatenate([moving.y[rest].astype(np.int64), cells[:, 1]]),
        np.concatenate([moving.p[rest].astype(np.int64), (cells[:, 0] // 16 + cells[:, 1] // 16) % 2]),
        320,
        240,
    )
    start = Twist.about((152.0, 112.0), 4.7, ANCHOR)
    fit = refine(events, start, anchor_px=ANCHOR, signed=True)
    assert fit.twist.omega_rad_s == pytest.approx(5.0, rel=0.01)
    assert fit.twist.center_px(ANCHOR) == pytest.approx((150, 110), abs=1.5)
    assert 0.3 < fit.kept_share < 0.7


def test_thinning_keeps_order_and_span_and_leaves_small_streams_alone(turning):
    events = turning()
    few = thinned(events, 1000, np.random.default_rng(0))
    assert len(few) == 1000
    assert (np.diff(few.t) >= 0).all()
    assert few.span_us > 0.98 * events.span_us
    assert thinned(few, 1000, np.random.default_rng(0)) is few
