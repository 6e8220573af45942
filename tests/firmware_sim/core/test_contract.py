"""One suite for every level of the core: the plain model, the event-driven simulator, the clocked model, later the RTL.

A level is a class with ``run(events, arrival)``; whoever adds one lists it in ``LEVELS`` and inherits every test.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.cycle_model import CycleModel
from tiegocancel.firmware_sim.core.rule import lay_out_rule, lay_out_state
from tiegocancel.firmware_sim.core.simulator import CoreSimulator

from tiegocancel.matching.oracle import OracleCanceller

SEEDS = st.integers(0, 2**32 - 1)


@dataclass
class Ran:
    """What a level made of a stream: suppressed and dropped events; the cycle of each decision where it has cycles."""

    suppressed: list[bool]
    dropped: list[bool]
    decided: list[int] | None = None


class Functional:
    """The semantics, one event at a time, without time."""

    def run(self, case: Any, arrival: Any, core: CoreConfig) -> Ran:
        oracle = OracleCanceller(case.cancel, case.schedules, **case.size)
        return Ran(oracle.process(case.events).suppressed.tolist(), [False] * len(case.events))


class EventDriven:
    """The simulator that a study runs."""

    def run(self, case: Any, arrival: Any, core: CoreConfig) -> Ran:
        simulator = CoreSimulator(core, case.cancel, case.schedules, link_q16=case.link_q16, **case.size)
        trace = simulator.process(case.events, arrival)
        return Ran(trace.suppressed.tolist(), trace.dropped.tolist(), trace.decided.tolist())


class Clocked:
    """The model that steps every cycle."""

    def run(self, case: Any, arrival: Any, core: CoreConfig) -> Ran:
        plan = CoreSimulator(core, case.cancel, case.schedules, link_q16=case.link_q16, **case.size).plan
        rows = np.stack([one.coefficients for one in case.schedules])
        rule = lay_out_rule(case.cancel, case.schedules[0].t_us, rows, **case.size)
        model = CycleModel(rule, lay_out_state(case.cancel, **case.size), plan, case.events, arrival.tolist())
        model.run()
        done = model.handled
        return Ran([one.suppressed for one in done], [one.dropped for one in done], [one.decided for one in done])


LEVELS = [Functional, EventDriven, Clocked]


@pytest.fixture(scope="session", params=LEVELS, ids=lambda level: level.__name__)
def level(request: pytest.FixtureRequest) -> Any:
    return request.param()


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS)
def test_decisions_are_those_of_the_semantics_when_nothing_is_dropped(draw_case: Any, level: Any, seed: int) -> None:
    case = draw_case(seed)
    roomy = replace(case.core, input_depth=512)
    ran = level.run(case, np.arange(len(case.events), dtype=np.int64) * 30, roomy)
    golden = OracleCanceller(case.cancel, case.schedules, **case.size).process(case.events)
    assert not any(ran.dropped)
    assert ran.suppressed == golden.suppressed.tolist()


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS)
def test_every_event_is_suppressed_residual_or_dropped(draw_case: Any, level: Any, seed: int) -> None:
    case = draw_case(seed)
    ran = level.run(case, case.arrival, case.core)
    assert len(ran.suppressed) == len(ran.dropped) == len(case.events)
    assert not any(one and lost for one, lost in zip(ran.suppressed, ran.dropped, strict=True))


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS)
def test_what_is_kept_is_decided_as_if_the_rest_had_never_been(draw_case: Any, level: Any, seed: int) -> None:
    case = draw_case(seed)
    ran = level.run(case, case.arrival, case.core)
    kept = ~np.array(ran.dropped, np.bool_)
    golden = OracleCanceller(case.cancel, case.schedules, **case.size).process(case.events.select(kept))
    assert np.array(ran.suppressed, np.bool_)[kept].tolist() == golden.suppressed.tolist()


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS)
def test_decisions_leave_in_order_and_after_their_events(draw_case: Any, level: Any, seed: int) -> None:
    case = draw_case(seed)
    ran = level.run(case, case.arrival, case.core)
    if ran.decided is None:
        return  # a level without time
    kept = ~np.array(ran.dropped, np.bool_)
    decided = np.array(ran.decided)[kept]
    assert (np.diff(decided) >= 1).all()
    assert (decided > case.arrival[kept]).all()
