"""A labelled mover is put among events that keep their times, places and labels."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.events import EGO, MOVER, NOISE
from tiegocancel.study.injection import inject_mover


def stream(*, label: int | None = None, count: int = 4000) -> Events:
    rng = np.random.default_rng(3)
    t = np.sort(rng.integers(1_000_000, 1_100_000, count))
    x, y = rng.integers(20, 140, count), rng.integers(20, 100, count)
    labels = None if label is None else np.full(count, label, np.int8)
    return Events(t, x, y, rng.integers(0, 2, count), 160, 120, labels)


def test_the_real_events_stay_and_the_hand_is_labelled_among_them() -> None:
    events = stream()
    put = inject_mover(events, speed_px_s=600.0)
    assert put.events.label is not None
    real = put.events.select(put.events.label == EGO)
    for name in "txyp":
        assert np.array_equal(getattr(real, name), getattr(events, name))
    assert put.mover == int((put.events.label == MOVER).sum()) > 100
    assert events.t[0] <= put.events.t[0]
    assert put.events.t[-1] <= events.t[-1]
    assert f"{put.mover:,} events of a simulated hand" in put.note


def test_the_hand_crosses_where_the_events_are() -> None:
    put = inject_mover(stream(), speed_px_s=600.0)
    hand = put.events.select(put.events.label == MOVER)
    assert np.hypot(hand.x.mean() - 80, hand.y.mean() - 60) < 60
    assert hand.x.std() > 5


def test_labels_that_are_there_are_kept() -> None:
    put = inject_mover(stream(label=NOISE), speed_px_s=600.0)
    assert int((put.events.label == NOISE).sum()) == 4000
    assert not (put.events.label == EGO).any()


def test_a_seed_gives_the_same_hand() -> None:
    one, other = (inject_mover(stream(), speed_px_s=300.0, seed=5).events for _ in range(2))
    assert np.array_equal(one.t, other.t)
    assert np.array_equal(one.x, other.x)


def test_a_stream_without_events_is_refused() -> None:
    with pytest.raises(ValueError, match="there are none"):
        inject_mover(Events.empty(64, 64), speed_px_s=100.0)
