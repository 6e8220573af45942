"""Events reach a device when they fire, when they are read out and when the line has room; nothing is lost unsaid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.arrival import Arrivals, InputPath


def test_a_wide_line_brings_events_in_the_cycle_in_which_they_fire() -> None:
    arrival, lost = Arrivals(InputPath(), clock_hz=50e6).process(np.array([7, 8, 8, 8, 1007]))
    assert arrival.tolist() == [0, 50, 51, 52, 50_000]
    assert not lost.any()


def test_readout_spreads_what_fires_together() -> None:
    path = InputPath(readout_events_per_second=10e6)
    arrival, _ = Arrivals(path, clock_hz=100e6).process(np.array([0, 0, 0, 5]))
    assert arrival.tolist() == [0, 10, 20, 500]


def test_a_slow_line_queues_and_a_full_buffer_loses() -> None:
    path = InputPath(link_bits_per_second=1e6, bits_per_event=40, buffer_events=2)
    arrivals = Arrivals(path, clock_hz=1e6)
    arrival, lost = arrivals.process(np.array([0, 1, 2, 3, 200]))
    assert arrival.tolist() == [0, 40, 80, -1, 200]
    assert lost.tolist() == [False, False, False, True, False]
    assert arrivals.lost == 1


RATES = st.one_of(st.just(0.0), st.floats(1, 3e6))


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 300), min_size=1, max_size=80), st.integers(0, 80), RATES, RATES)
def test_cuts_change_nothing_and_arrivals_rise(gaps: list[int], cut: int, readout: float, line: float) -> None:
    t = np.cumsum(np.array(gaps, np.int64))
    path = InputPath(readout_events_per_second=readout, link_bits_per_second=32 * line, buffer_events=5)
    whole, whole_lost = Arrivals(path, clock_hz=12e6).process(t)
    parts = Arrivals(path, clock_hz=12e6)
    pieces = [parts.process(t[:cut]), parts.process(t[cut:])]
    assert np.concatenate([arrival for arrival, _ in pieces]).tolist() == whole.tolist()
    assert parts.lost == int(whole_lost.sum())
    kept = whole[~whole_lost]
    assert (np.diff(kept) >= 1).all()
    assert (kept >= np.floor((t[~whole_lost] - t[0]) * 12)).all()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"buffer_events": 0}, "buffer_events must be at least 1, not 0"),
        ({"bits_per_event": 0}, "bits_per_event must be above 0 and at most 4096, not 0"),
        ({"link_bits_per_second": -1.0}, "link_bits_per_second must be 0 or from 1 to 1e15, not -1.0"),
    ],
)
def test_what_cannot_be_is_refused(table: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        InputPath(**table)  # type: ignore[arg-type]
