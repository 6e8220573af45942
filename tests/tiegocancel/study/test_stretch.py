"""Pictures hold a bounded stretch, whatever the chunks, and skip a still beginning."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.study.stretch import Densest, Stretch

LIMITS = {"span_us": 1000, "longest_us": 50_000, "enough": 20, "most": 300}


def stream(times: list[int]) -> Events:
    n = len(times)
    return Events(np.array(times, np.int64), np.arange(n) % 8, np.arange(n) % 4, np.ones(n, int), 8, 4)


def collect(events: Events, size: int, kind: type[Stretch] | type[Densest] = Stretch) -> list[int]:
    stretch = kind(100, **LIMITS)
    marks = np.arange(len(events)) % 3 == 0
    for first in range(0, len(events), size):
        stretch.add(events[first : first + size], marks[first : first + size])
    found = stretch.events()
    assert found is None or len(stretch.suppressed()) == len(found)
    return [] if found is None else found.t.tolist()


@pytest.mark.parametrize("size", [1, 7, 10_000])
@pytest.mark.parametrize(
    ("times", "first", "last", "count"),
    [
        (list(range(0, 5000, 10)), 100, 1100, 101),  # 1 ms holds enough
        (list(range(0, 60_000, 200)), 200, 4000, 20),  # slow: longer, until enough
        (list(range(0, 200_000, 20_000)), 20_000, 40_000, 2),  # slower still: the longest
        (list(range(5000)), 100, 399, 300),  # fast: the most
    ],
)
def test_a_stretch_ends_where_its_limits_say(times: list[int], first: int, last: int, count: int, size: int) -> None:
    found = collect(stream(times), size)
    assert (found[0], found[-1], len(found)) == (first, last, count)


@pytest.mark.parametrize("size", [1, 50, 10_000])
def test_the_densest_stretch_is_kept(size: int) -> None:
    still, busy = list(range(0, 900_000, 30_000)), list(range(1_000_000, 1_010_000, 10))
    found = collect(stream(still + busy), size, Densest)
    assert found[0] >= 1_000_100
    assert len(found) == 101
    assert collect(stream([]), 1, Densest) == []


def test_rows_are_kept_alone() -> None:
    events = stream(list(range(0, 2000, 5)))
    stretch = Stretch(0, rows=(1, 2), **LIMITS)
    stretch.add(events, np.zeros(len(events), bool))
    found = stretch.events()
    assert found is not None
    assert set(found.y.tolist()) == {1, 2}
