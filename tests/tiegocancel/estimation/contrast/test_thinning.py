"""Draw events one by one or by places that move, without losing order or the pairs that an estimate rests on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.thinning import thinned, thinned_by_place
from tiegocancel.events import Events

ANCHOR, MIDDLE_US = (160.0, 120.0), 25_000
TRUE = Twist.about((150.0, 110.0), 5.0, ANCHOR)


def by_place(events, most, *, motion=TRUE, middle_us=MIDDLE_US, seed=0):
    return thinned_by_place(events, motion, ANCHOR, middle_us, most, np.random.default_rng(seed))


def numbered(count, **columns):
    """Return events whose time is their index."""
    rng = np.random.default_rng(0)
    given_ = {"x": rng.integers(0, 320, count), "y": rng.integers(0, 240, count), "p": np.arange(count) % 2}
    return Events(np.arange(count), *((given_ | columns).values()), 320, 240)


@given(count=st.integers(0, 300), most=st.integers(1, 300), seed=st.integers(0, 99))
def test_single_events_are_a_subset_in_order_of_the_size_asked_for(count, most, seed):
    events = numbered(count)
    few = thinned(events, most, np.random.default_rng(seed))
    assert len(few) == min(count, most)
    assert (np.diff(few.t) > 0).all()
    assert np.array_equal(few.x, events.x[few.t])


def test_few_events_are_left_alone():
    events = numbered(100)
    assert thinned(events, 100, np.random.default_rng(0)) is events
    assert by_place(events, 100) is events


def test_same_seed_draws_the_same_and_another_seed_others(turning):
    events = turning()
    for draw in (thinned, lambda *arguments: by_place(arguments[0], arguments[1], seed=arguments[3])):
        one, again, other = (draw(events, 3000, np.random.default_rng(seed), seed) if draw is not thinned
                             else thinned(events, 3000, np.random.default_rng(seed)) for seed in (1, 1, 2))  # fmt: skip
        assert np.array_equal(one.t, again.t)
        assert len(one) != len(other) or not np.array_equal(one.x, other.x)


@pytest.mark.parametrize("most", [1000, 4000])
def test_places_hold_about_as_many_as_asked_for_in_order(turning, most):
    few = by_place(turning(count=40_000), most)
    assert most <= len(few) < 1.5 * most
    assert (np.diff(few.t) >= 0).all()
    assert few.span_us > 45_000


def test_chosen_places_keep_all_their_events_through_the_motion(turning):
    events = turning(count=60_000, points=600, noise=0.0)
    few = by_place(events, len(events) // 3)
    theta = -5.0 * (events.t - MIDDLE_US) * 1e-6
    right, down = events.x - 150.0, events.y - 110.0
    home = np.floor(
        np.stack([np.cos(theta) * right - np.sin(theta) * down, np.sin(theta) * right + np.cos(theta) * down]) / 8
    )
    kept = np.isin(events.t * 400_000 + events.x.astype(np.int64) * 400 + events.y,
                   few.t * 400_000 + few.x.astype(np.int64) * 400 + few.y)  # fmt: skip
    _, place = np.unique(home, axis=1, return_inverse=True)
    share = np.bincount(place.ravel(), kept) / np.bincount(place.ravel())
    held = np.bincount(place.ravel())
    # A small spot of the scene is in or out as a whole, but for those that lie on a border.
    assert held[(share < 0.02) | (share > 0.98)].sum() > 0.7 * len(events)


def test_an_object_in_few_places_is_thinned_event_by_event():
    rng = np.random.default_rng(0)
    events = numbered(5000, x=150 + rng.integers(0, 40, 5000), y=100 + rng.integers(0, 40, 5000))
    few = by_place(events, 1000, motion=Twist(0.0, 0.0, 0.0))
    assert len(few) == 1000


def test_times_far_from_zero_change_nothing(turning):
    near, far = turning(), turning(start_us=(1 << 60) - 60_000)
    few = by_place(far, 3000, middle_us=MIDDLE_US + (1 << 60) - 60_000)
    assert np.array_equal(few.t - ((1 << 60) - 60_000), by_place(near, 3000).t)


@pytest.mark.parametrize("motion", [Twist(1e6, -1e6, 0.0), Twist(0.0, 0.0, 1e4), Twist(0.0, 0.0, 0.0)])
def test_any_motion_is_borne(turning, motion):
    assert 1000 <= len(by_place(turning(), 1000, motion=motion)) <= 20_000
