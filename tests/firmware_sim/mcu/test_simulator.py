"""A firmware decides as the semantics say and takes the cycles of the clocked model; its queue obeys theory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim import load_target
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.mcu.simulator import McuSimulator
from tiegocancel.firmware_sim.mcu.timing import CAUSES, lay_out_clock

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.motion.schedule import MotionSchedule

SEEDS = st.integers(0, 2**32 - 1)
Draw = Callable[[int], Any]


def golden(case: Any, events: Events) -> OracleCanceller:
    return OracleCanceller(case.cancel, case.schedules, width=events.width, height=events.height)


def assert_decides_as_the_semantics_say(case: Any) -> None:
    oracle, firmware = golden(case, case.events), case.simulator(saturated=True, link_q16=case.link_q16)
    for part in (case.events[: case.cut], case.events[case.cut :]):
        assert firmware.process(part).suppressed.tolist() == oracle.process(part).suppressed.tolist()
    told = {name: count for name, count in firmware.counts.items() if name in dict(oracle.counters)}
    assert told == dict(oracle.counters)


def assert_takes_the_cycles_of_the_clocked_model(case: Any, clocked: Any) -> int:
    """Compare every time of every event; return how many were dropped."""
    fast = case.simulator(link_q16=case.link_q16)
    cut = 0 if case.config.input == "blocks" else case.cut
    parts = (slice(0, cut), slice(cut, None))
    traces = [fast.process(case.events[part], case.arrival[part]) for part in parts]
    slow = clocked.ClockedFirmware(case, fast.plan)
    slow.run()

    def joined(name: str) -> list[int]:
        return np.concatenate([getattr(trace, name) for trace in traces]).tolist()

    assert joined("dropped") == [one.dropped for one in slow.handled]
    assert joined("suppressed") == [one.suppressed for one in slow.handled]
    for name, theirs in (("taken", "start"), ("decided", "end"), ("left", "left")):
        assert joined(name) == [getattr(one, theirs) for one in slow.handled], name
    return sum(one.dropped for one in slow.handled)


@settings(max_examples=50, deadline=None)
@given(seed=SEEDS)
def test_decisions_and_counts_equal_the_plain_model(draw_case: Draw, seed: int) -> None:
    assert_decides_as_the_semantics_say(draw_case(seed))


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS)
def test_every_cycle_equals_the_clocked_model(draw_case: Draw, clocked: Any, seed: int) -> None:
    assert_takes_the_cycles_of_the_clocked_model(draw_case(seed), clocked)


@pytest.mark.slow
def test_both_at_length(draw_case: Draw, clocked: Any) -> None:
    dropped = 0
    for seed in range(600):
        assert_decides_as_the_semantics_say(draw_case(seed))
        dropped += assert_takes_the_cycles_of_the_clocked_model(draw_case(seed), clocked)
    assert dropped > 1000


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS)
def test_what_is_dropped_is_counted_and_the_rest_decided_as_if_it_had_never_been(draw_case: Draw, seed: int) -> None:
    case = draw_case(seed)
    firmware = case.simulator(link_q16=case.link_q16)
    trace = firmware.process(case.events, case.arrival)
    kept = case.events.select(~trace.dropped)
    assert firmware.counts["events"] == len(kept) == firmware.items["event"]
    assert int((~trace.suppressed & ~trace.dropped).sum()) == firmware.items["output"]
    assert not (trace.dropped & trace.suppressed).any()
    assert trace.suppressed[~trace.dropped].tolist() == golden(case, kept).process(kept).suppressed.tolist()


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS)
def test_every_cycle_of_the_core_has_a_cause(draw_case: Draw, seed: int) -> None:
    case = draw_case(seed)
    firmware = case.simulator(saturated=True, link_q16=case.link_q16)
    trace = firmware.process(case.events)
    assert set(firmware.work) == set(CAUSES)
    busy_until = max(int(trace.decided[-1]), int(firmware.clock.now[0]))
    assert sum(firmware.work.values()) == busy_until
    assert firmware.work["interrupts"] == 0 or case.config.cores == 1


def still_stream(count: int, rng: np.random.Generator) -> Events:
    """Events one by one, far apart in time, each alone at its place."""
    t = np.arange(count, dtype=np.int64) * 50
    return Events(
        t,
        rng.integers(8, 56, count).astype(np.uint16),
        rng.integers(8, 40, count).astype(np.uint16),
        rng.integers(0, 2, count).astype(np.uint8),
        64,
        48,
    )


def queue(depth: int, count: int) -> tuple[McuSimulator, Events, np.random.Generator]:
    """Return a firmware without interrupts and sweeps, and events for it."""
    rng = np.random.default_rng(0)
    firmware = McuSimulator(
        load_target("stm32f405"),  # type: ignore[arg-type]
        McuConfig(input_depth=depth, cores=2, sweep=False),
        CancelConfig(horizon_us=3000, tolerance_us=300, tolerance_px=1.0, ring_capacity=500),
        MotionSchedule.still(),
        width=64,
        height=48,
    )
    return firmware, still_stream(count, rng), rng


def test_the_wait_is_that_of_pollaczek_and_khinchine() -> None:
    for load in (0.5, 0.8):
        firmware, events, rng = queue(1 << 16, 60_000)
        probe = np.cumsum(np.full(len(events), 100_000))
        service = firmware.process(events, probe)
        cycles = (service.decided - service.taken).astype(float)
        firmware, events, _ = queue(1 << 16, 60_000)
        arrival = np.cumsum(1 + rng.exponential(cycles.mean() / load - 0.5, len(events)).astype(np.int64))
        trace = firmware.process(events, arrival)
        rate = len(events) / arrival[-1]
        wait = (trace.taken - trace.arrival - 1).mean()
        expected = rate * (cycles**2).mean() / (2 * (1 - rate * cycles.mean()))
        assert wait == pytest.approx(expected, rel=0.06)


def test_arrivals_as_even_as_the_service_never_wait_below_full_load_and_fill_the_buffer_above() -> None:
    firmware, events, _ = queue(64, 4000)
    firmware.plan.cost[1:] = 0  # every event costs the same
    each = int(np.ceil(firmware.plan.cost[0] / 65536))
    easy = firmware.process(events[:2000], np.arange(1, 2001) * (each + 1))
    assert (easy.taken - easy.arrival == 1).all()
    assert not easy.dropped.any()
    start = int(easy.decided[-1]) + 10
    gap = each // 2
    hard = firmware.process(events[2000:], start + np.arange(2000) * gap)
    assert hard.dropped[500:].mean() == pytest.approx(1 - gap / each, abs=0.01)
    waits = (hard.taken - hard.arrival)[~hard.dropped][200:]
    assert waits.max() == pytest.approx(64 * each, abs=2 * each)


def test_double_buffering_hands_events_over_by_halves_or_after_the_time_given() -> None:
    _, events, _ = queue(2, 12)
    firmware = McuSimulator(
        load_target("stm32f405"),  # type: ignore[arg-type]
        McuConfig(input="blocks", input_depth=8, flush_us=100),
        CancelConfig(ring_capacity=500),
        MotionSchedule.still(),
        width=64,
        height=48,
    )
    arrival = np.array([1, 2, 3, 4, 10_000, 10_001, 60_000, 60_001, 60_002, 60_003, 90_000, 90_001])
    taken = firmware.process(events, arrival).taken
    assert taken[0] == 5
    assert taken[4] == 10_000 + 100 * 168 + 1
    assert taken[6] == 60_004
    assert taken[10] == 90_000 + 100 * 168 + 1


def test_a_slow_link_fills_the_output_and_makes_the_core_wait() -> None:
    firmware, events, _ = queue(64, 3000)
    slow = McuSimulator(
        firmware.target, firmware.config, firmware.cancel, MotionSchedule.still(), width=64, height=48,
        link_q16=5000 << 16, saturated=True,
    )  # fmt: skip
    trace = slow.process(events)
    residual = np.flatnonzero(~trace.suppressed)
    assert np.diff(trace.left[residual][1000:]).tolist() == [5000] * (len(residual) - 1001)
    assert slow.work["output_full"] > 0.5 * trace.decided[-1]


def test_wait_states_and_misses_add_what_the_accesses_cost(draw_slow: Callable[[bool], Any]) -> None:
    for cached in (False, True):
        _, events, _ = queue(64, 4000)
        options = {"width": 64, "height": 48, "saturated": True}
        config, cancel = McuConfig(sweep=False, cores=2), CancelConfig(ring_capacity=500, tolerance_px=1.0)
        firmware = McuSimulator(draw_slow(cached), config, cancel, MotionSchedule.still(), **options)
        firmware.process(events)
        work, items = firmware.work, firmware.items
        if cached:
            assert work["wait_states"] == 0
            each = firmware.plan.miss_cycles
            misses = firmware.cache["misses"]
            assert 0 < each.min() * misses <= work["cache_misses"] <= each.max() * misses
            assert firmware.cache["hits"] > 0
            continue
        waits = {place.array.name: place.wait_cycles for place in firmware.ram.placements}
        words = firmware.words.ring_entry // 32
        assert work["cache_misses"] == 0
        assert work["wait_states"] == (
            waits["ring"] * words * (items["pass"] + items["store"])
            + waits["table"] * (2 * items["write"] + items["look"] + items["take"])
            + waits["input"] * 2 * items["event"]
            + waits["output"] * 2 * items["output"]
        )


def test_a_cache_that_holds_everything_misses_each_line_once() -> None:
    _, events, _ = queue(64, 8000)
    firmware = McuSimulator(
        load_target("imxrt1062"),  # type: ignore[arg-type]
        McuConfig(sweep=False, cores=2, input="interrupt"),
        CancelConfig(ring_capacity=500, tolerance_px=1.0),
        MotionSchedule.still(),
        width=64,
        height=48,
        saturated=True,
    )
    firmware.plan = firmware.plan._replace(
        cached=3, miss_cycles=np.full(4, 11), line_bytes=32, cache_sets=256, cache_ways=4
    )
    firmware.clock = lay_out_clock(firmware.plan, 1)
    firmware.process(events)
    lines = 64 * 48 * firmware.plan.cell_bytes // 32 + 500 * firmware.plan.entry_bytes // 32 + 2
    assert 0 < firmware.cache["misses"] <= lines
    assert firmware.work["cache_misses"] == 11 * firmware.cache["misses"]


def test_a_second_core_takes_the_interrupts_off_the_first() -> None:
    _, events, _ = queue(64, 2000)
    spent = []
    for cores in (1, 2):
        firmware = McuSimulator(
            load_target("rp2040"),  # type: ignore[arg-type]
            McuConfig(input="interrupt", cores=cores),
            CancelConfig(ring_capacity=500),
            MotionSchedule.still(),
            width=64,
            height=48,
            saturated=True,
        )
        firmware.process(events)
        spent.append(firmware.work)
    assert spent[0]["interrupts"] == 2000 * firmware.plan.interrupt_cycles
    assert spent[1]["interrupts"] == 0
    assert spent[0]["compute"] == spent[1]["compute"]


def test_misuse_is_said_in_one_line() -> None:
    firmware, events, _ = queue(64, 3)
    with pytest.raises(ValueError, match="rise by at least one cycle"):
        firmware.process(events, np.array([5, 5, 6]))
    with pytest.raises(ValueError, match="arrivals must be given"):
        firmware.process(events)
    far = MotionSchedule(np.zeros(1, np.int64), np.array([[1 << 28, 0, -(1 << 33), 0, 0, 0]]))
    with pytest.raises(ValueError, match="coefficient_bits must be 64"):
        McuSimulator(
            firmware.target, McuConfig(coefficient_bits=32), firmware.cancel, far, width=64, height=48,
        )  # fmt: skip
