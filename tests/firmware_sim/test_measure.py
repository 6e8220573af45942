"""Levels and distributions are those that a plain count gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.core.simulator import CoreTrace
from tiegocancel.firmware_sim.measure import Distribution, Gauge


def trace(arrival: list[int], waits: list[int], suppressed: list[bool]) -> CoreTrace:
    """A trace of events that are taken, decided and sent some cycles after each other, in order."""
    enter = np.array(arrival, np.int64)
    leave = np.maximum.accumulate(enter + 1 + np.array(waits, np.int64))
    return CoreTrace(
        suppressed=np.array(suppressed),
        dropped=np.zeros(len(arrival), np.bool_),
        arrival=enter,
        taken=leave,
        first=leave,
        issued=leave,
        decided=leave,
        left=leave,
        held=np.arange(len(arrival)),
    )


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 5), st.integers(0, 20), st.booleans()), min_size=1, max_size=40))
def test_the_high_water_of_a_fifo_is_the_most_that_were_in_it(rows: list[tuple[int, int, bool]]) -> None:
    arrival = np.cumsum([gap for gap, _, _ in rows]).tolist()
    one = trace(arrival, [wait for _, wait, _ in rows], [kept for _, _, kept in rows])
    gauge = Gauge()
    gauge.take(one)
    level = gauge.input_level(bins=7)
    held = [
        sum(1 for e, g in zip(one.arrival.tolist(), one.taken.tolist(), strict=True) if e <= at <= g)
        for at in range(int(one.arrival[0]), int(one.taken[-1]) + 1)
    ]
    assert level.high_water == max(held) == level.most_by_time.max()
    assert len(level.most_by_time) == 7
    assert gauge.ring_level().high_water == len(rows) - 1


def test_the_stages_of_a_firmware_are_two_and_those_of_a_core_four() -> None:
    gauge = Gauge()
    gauge.take(trace([1, 2], [3, 3], [False, True]))
    assert list(gauge.stages()) == ["input FIFO", "decision"]
    core = Gauge()
    one = trace([1, 2], [3, 3], [False, True])
    core.take(replace(one, issued=one.taken + 2, decided=one.taken + 5))
    assert [part.mean for part in core.stages().values()] == [pytest.approx(4.0, abs=1), 0.0, 2.0, 3.0]


def test_dropped_events_are_counted_and_left_out() -> None:
    gauge = Gauge()
    one = trace([1, 2, 3], [0, 0, 0], [False, True, False])
    gauge.take(one)
    lost = trace([4], [0], [False])
    lost.dropped[0] = True
    gauge.take(lost)
    assert gauge.drops == 1
    assert gauge.latency() == Distribution(least=1.0, mean=1.0, p50=1.0, p99=1.0, most=1.0)
    assert gauge.fate("suppressed").tolist() == [False, True, False, False]


def test_nothing_is_described_as_nothing() -> None:
    gauge = Gauge()
    assert np.isnan(gauge.latency().mean)
    assert gauge.input_level().high_water == gauge.ring_level().high_water == 0
    assert Distribution.of(np.array([2.0, 4.0])).scaled(10.0).mean == 30.0
