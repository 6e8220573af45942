"""Cycles are those of the simulated core, and only where it decides as the vectors say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.export import Vectors, core_cycles
from tiegocancel.firmware_sim.export.layout import cell_word

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig

PLAIN = CancelConfig(horizon_us=2000, ring_capacity=500)
LINES = CancelConfig(
    horizon_us=2048, tick_bits=6, early_us=640, late_us=640, carry=3, need=2, uses=0, line_px=1.0, fraction_bits=2
)


@pytest.mark.parametrize("config", [PLAIN, LINES])
def test_a_core_that_keeps_up_decides_as_the_vectors_say(disc: Callable[..., Vectors], config: CancelConfig) -> None:
    vectors = disc(config)
    cycles = core_cycles(vectors, CoreConfig(), clock_hz=1e8)
    assert not cycles.dropped.any()
    assert cycles.suppressed.tolist() == vectors.suppressed.tolist()
    assert (cycles.decided > cycles.arrival).all()
    assert (np.diff(cycles.decided) > 0).all()
    due = ((vectors.events.t - vectors.events.t[0]) * 100).astype(int)
    assert (cycles.arrival >= due).all()
    assert cycles.arrival[0] == 0


def test_a_faster_clock_takes_the_same_cycles_from_arrival_to_decision(disc: Callable[..., Vectors]) -> None:
    vectors = disc(PLAIN)
    slow, fast = (core_cycles(vectors, CoreConfig(), clock_hz=hz) for hz in (1e8, 2e8))
    assert (fast.decided - fast.arrival).min() == (slow.decided - slow.arrival).min()
    assert fast.arrival[-1] == 2 * slow.arrival[-1]


def test_drops_change_what_the_core_decides_and_nothing_else(disc: Callable[..., Vectors]) -> None:
    vectors = disc(PLAIN)
    cycles = core_cycles(vectors, CoreConfig(input_depth=1), clock_hz=1e6)
    assert 0 < cycles.dropped.sum() < len(vectors.events)
    assert not (cycles.dropped & cycles.suppressed).any()
    assert (cycles.decided[cycles.dropped] == -1).all()


def test_the_stamps_of_the_core_are_those_of_the_layout(disc: Callable[..., Vectors]) -> None:
    vectors = disc(PLAIN)
    cycles = core_cycles(vectors, CoreConfig(), clock_hz=1e8)
    assert cycles.scrub_cycles > 0
    with_core = replace(vectors, cycles=cycles)
    assert {one.name: one.bits for one in cell_word(with_core).fields}["due"] == cycles.stamp_bits < 30
    bare = core_cycles(vectors, CoreConfig(stamp_bits=20), clock_hz=1e8)
    assert (bare.stamp_bits, bare.scrub_cycles) == (20, 0)


def test_a_core_of_another_rule_tells_no_cycles(disc: Callable[..., Vectors]) -> None:
    vectors = disc(PLAIN)
    wrong = vectors.suppressed.copy()
    wrong[700] ^= True
    with pytest.raises(ValueError, match="does not serve this configuration: it decides event 700 otherwise"):
        core_cycles(replace(vectors, suppressed=wrong), CoreConfig(), clock_hz=1e8)
    counters = replace(vectors.counters, outside=1 + vectors.counters.outside)
    with pytest.raises(ValueError, match=f"it counts {vectors.counters.outside} outside, not {counters.outside}"):
        core_cycles(replace(vectors, counters=counters), CoreConfig(), clock_hz=1e8)


def test_a_stretch_beyond_counting_is_refused(disc: Callable[..., Vectors]) -> None:
    vectors = disc(PLAIN)
    e = vectors.events
    far = Events(np.append(e.t[:-1], 1 << 50), e.x, e.y, e.p, e.width, e.height)
    with pytest.raises(ValueError, match="are more cycles than can be counted"):
        core_cycles(replace(vectors, events=far), CoreConfig(), clock_hz=1e8)
