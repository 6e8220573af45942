"""The queue is bounded under every policy, keeps order, and accounts for every event."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import Events
from tiegocancel.link.event_queue import Arrival, EventQueue, QueueOptions
from tiegocancel.link.protocols.protocol import TextLine


def numbered(first: int, count: int) -> Events:
    return Events(
        np.arange(first, first + count), np.zeros(count, int), np.zeros(count, int), np.zeros(count, int), 4, 4
    )


def arrival(first: int, count: int, *lines: TextLine) -> Arrival:
    return Arrival(numbered(first, count), list(lines), time.perf_counter())


def times(taken: list[Arrival]) -> list[int]:
    return [int(t) for part in taken for t in part.events.t]


@given(
    policy=st.sampled_from(["drop-oldest", "thin"]),
    sizes=st.lists(st.one_of(st.integers(0, 60), st.none()), max_size=40),
)
def test_every_event_is_handed_on_or_counted_and_order_is_kept(policy: str, sizes: list[int | None]) -> None:
    options = QueueOptions(capacity_events=64, chunk_events=16, policy=policy, hold_s=0.0)  # type: ignore[arg-type]
    queue = EventQueue(options)
    put, got = 0, []
    for size in sizes:
        if size is None:
            got += times(queue.take(0.0))
            continue
        assert queue.put(arrival(put, size))
        put += size
        assert len(queue) <= 64
    queue.close()
    got += times(queue.take(0.0))
    counts = queue.counters
    assert got == sorted(set(got))
    assert put == counts.accepted + counts.thinned
    assert counts.accepted == len(got) + counts.dropped
    assert counts.high_water <= 64
    assert counts.thinned == 0 if policy == "drop-oldest" else counts.dropped == 0


def test_drop_oldest_keeps_the_newest() -> None:
    queue = EventQueue(QueueOptions(capacity_events=10, chunk_events=10, policy="drop-oldest", hold_s=0.0))
    for first in range(0, 40, 4):
        queue.put(arrival(first, 4, TextLine(first, str(first))))
    taken = queue.take(0.0)
    assert times(taken) == list(range(30, 40))
    assert queue.counters.dropped == 30
    # The text among the events that went is not lost with them.
    assert [line.text for part in taken for line in part.lines] == [str(first) for first in range(0, 40, 4)]


def test_thinning_begins_gently() -> None:
    queue = EventQueue(QueueOptions(capacity_events=1000, chunk_events=1000, policy="thin", hold_s=0.0))
    for first in range(0, 1500, 10):
        queue.put(arrival(first, 10))
    kept = times(queue.take(0.0))
    assert kept[:500] == list(range(500))
    steps = np.diff(kept[520:])
    assert set(steps[:100].tolist()) == {2}
    assert 4 in steps


def test_block_lets_the_writer_wait_and_loses_nothing() -> None:
    queue = EventQueue(QueueOptions(capacity_events=50, chunk_events=50, hold_s=0.0))
    writer = threading.Thread(target=lambda: [queue.put(arrival(first, 20)) for first in range(0, 1000, 20)])
    writer.start()
    time.sleep(0.05)
    assert len(queue) == 50
    got: list[int] = []
    while len(got) < 1000:
        got += times(queue.take(1.0))
    writer.join(2.0)
    assert got == list(range(1000))
    assert queue.counters.blocked_s > 0.02


def test_closing_frees_a_writer_that_waits() -> None:
    queue = EventQueue(QueueOptions(capacity_events=10, chunk_events=10))
    said: list[bool] = []
    writer = threading.Thread(target=lambda: said.append(queue.put(arrival(0, 30))))
    writer.start()
    time.sleep(0.05)
    queue.close()
    writer.join(2.0)
    assert said == [False]


def test_events_are_held_for_the_bound_and_no_longer() -> None:
    queue = EventQueue(QueueOptions(hold_s=0.1))
    queue.put(arrival(0, 1))
    started = time.perf_counter()
    assert times(queue.take(5.0)) == [0]
    assert 0.08 < time.perf_counter() - started < 2.0
    queue.put(Arrival(numbered(0, QueueOptions().chunk_events), [], time.perf_counter() + 100.0))
    assert len(queue.take(5.0)) == 1  # a full chunk is handed on at once


def test_nothing_comes_of_nothing(tiny: SimpleNamespace) -> None:
    queue = EventQueue(QueueOptions())
    assert queue.take(0.01) == []
    queue.close()
    assert queue.take(10.0) == []


@pytest.mark.parametrize("share", [0.5, 0.99])
def test_a_quantile_of_latency_is_never_flattered(share: float) -> None:
    from tiegocancel.link.latency import Latency

    rng = np.random.default_rng(1)
    waits = rng.lognormal(-6.0, 1.0, 5000)
    latency = Latency()
    for wait in waits:
        latency.add(float(wait))
    exact = float(np.quantile(waits, share, method="inverted_cdf"))
    assert exact <= latency.quantile(share) <= 1.05 * exact
    assert latency.max_s == waits.max()
    assert latency.to_json()["events"] == 5000
