"""The beginning of a stream is the same however it is cut, and its motion looks at nothing beyond it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.study import beginning

CONFIG = CancelConfig(horizon_us=200, tolerance_us=50)


class Watched:
    """A feed that remembers what it has looked at."""

    def __init__(self) -> None:
        self.seen: list[Events] = []

    def advance(self, chunk: Events) -> None:
        self.seen.append(chunk)


def stream(count: int, seed: int = 0) -> Events:
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(-500, 500, count))
    return Events(t, rng.integers(0, 8, count), rng.integers(0, 8, count), rng.integers(0, 2, count), 8, 8)


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beginning, "_CHUNK_EVENTS", 7)
    monkeypatch.setattr(beginning, "BEYOND_WARM_UP", 11)
    monkeypatch.setattr(beginning, "MOST_EVENTS", 60)


@given(
    count=st.integers(1, 150),
    cut=st.integers(1, 40),
    from_us=st.none() | st.integers(-600, 600),
    most=st.none() | st.integers(1, 170),
)
def test_the_beginning_is_that_of_the_whole_stream(count: int, cut: int, from_us: int | None, most: int | None) -> None:
    events, feed = stream(count), Watched()
    chunks = (events[first : first + cut] for first in range(0, count, cut))
    taken = beginning.take_beginning(chunks, feed, CONFIG, from_us=from_us, max_events=most)  # type: ignore[arg-type]
    start = 0 if from_us is None else int(np.searchsorted(events.t, from_us))
    stop = count
    if start < count:
        warm = int(np.searchsorted(events.t, events.t[start] + CONFIG.warm_up_us))
        stop = start + (min(warm - start + 11, 60) if most is None else most)
    expected = events[start:stop]
    assert (taken is None) == (len(expected) == 0)
    for name in ("t", "x", "y", "p"):
        assert getattr(expected if taken is None else taken, name).tolist() == getattr(expected, name).tolist()
    assert sum(len(part) for part in feed.seen) == (count if taken is None else start + len(expected))
    seen: list[Any] = [time for part in feed.seen for time in part.t.tolist()]
    assert seen == events.t[: len(seen)].tolist()


def test_nothing_begins_in_nothing() -> None:
    assert beginning.take_beginning([], Watched(), CONFIG) is None  # type: ignore[arg-type]
    assert beginning.take_beginning([Events.empty(8, 8)], Watched(), CONFIG) is None  # type: ignore[arg-type]
