"""The core decides as the semantics say and takes the cycles that the clocked model takes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.core.cycle_model import CycleModel
from tiegocancel.firmware_sim.core.rule import lay_out_rule, lay_out_state
from tiegocancel.firmware_sim.core.simulator import CoreSimulator

from tiegocancel.matching.oracle import OracleCanceller

SEEDS = st.integers(0, 2**32 - 1)
Draw = Callable[[int], Any]


def assert_decides_as_the_semantics_say(case: Any) -> None:
    oracle = OracleCanceller(case.cancel, case.schedules, **case.size)
    core = CoreSimulator(case.core, case.cancel, case.schedules, **case.size, saturated=True)
    for part in (case.events[: case.cut], case.events[case.cut :]):
        assert core.process(part).suppressed.tolist() == oracle.process(part).suppressed.tolist()
    told = {name: count for name, count in core.counts.items() if name in dict(oracle.counters)}
    assert told == dict(oracle.counters)


def clocked(case: Any, plan: Any) -> CycleModel:
    """Return the clocked model of a case."""
    rows = np.stack([one.coefficients for one in case.schedules])
    rule = lay_out_rule(case.cancel, case.schedules[0].t_us, rows, **case.size)
    return CycleModel(rule, lay_out_state(case.cancel, **case.size), plan, case.events, case.arrival.tolist())


def assert_takes_the_cycles_of_the_clocked_model(case: Any) -> int:
    """Compare every time of every event; return how many events were dropped."""
    fast = CoreSimulator(
        case.core, case.cancel, case.schedules, scrub_cycles=case.scrub_cycles, link_q16=case.link_q16, **case.size
    )
    parts = (slice(0, case.cut), slice(case.cut, None))
    traces = [fast.process(case.events[part], case.arrival[part]) for part in parts]
    slow = clocked(case, fast.plan)
    slow.run()

    def joined(name: str) -> list[int]:
        return np.concatenate([getattr(trace, name) for trace in traces]).tolist()

    assert joined("dropped") == [one.dropped for one in slow.handled]
    assert joined("suppressed") == [one.suppressed for one in slow.handled]
    for name in ("taken", "first", "issued", "decided", "left"):
        assert joined(name) == [getattr(one, name) for one in slow.handled], name
    return sum(one.dropped for one in slow.handled)


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS)
def test_decisions_and_counts_equal_the_plain_model(draw_case: Draw, seed: int) -> None:
    assert_decides_as_the_semantics_say(draw_case(seed))


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS)
def test_every_cycle_equals_the_clocked_model(draw_case: Draw, seed: int) -> None:
    assert_takes_the_cycles_of_the_clocked_model(draw_case(seed))


@pytest.mark.slow
def test_both_at_length(draw_case: Draw) -> None:
    dropped = 0
    for seed in range(3000):
        assert_decides_as_the_semantics_say(draw_case(seed))
        dropped += assert_takes_the_cycles_of_the_clocked_model(draw_case(seed))
    assert dropped > 1000


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS)
def test_what_is_dropped_is_counted_and_the_rest_decided_as_if_it_had_never_been(draw_case: Draw, seed: int) -> None:
    case = draw_case(seed)
    simulator = CoreSimulator(case.core, case.cancel, case.schedules, link_q16=case.link_q16, **case.size)
    trace = simulator.process(case.events, case.arrival)
    kept = case.events.select(~trace.dropped)
    assert simulator.counts["events"] == len(kept) == len(case.events) - int(trace.dropped.sum())
    assert not (trace.dropped & trace.suppressed).any()
    golden = OracleCanceller(case.cancel, case.schedules, **case.size).process(kept)
    assert trace.suppressed[~trace.dropped].tolist() == golden.suppressed.tolist()
