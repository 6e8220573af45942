"""The core behaves as queueing theory says: full use at saturation, level by utilisation, pressure from behind."""

from __future__ import annotations

import numpy as np
import pytest
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.simulator import CoreSimulator
from tiegocancel.firmware_sim.measure import Gauge

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.schedule import MotionSchedule

# Nothing is predicted under an unknown motion, so that every event takes the same cycles.
CANCEL = CancelConfig(horizon_us=1000, tolerance_us=0, tolerance_px=2.0)


def stream(count: int) -> Events:
    rng = np.random.default_rng(1)
    t = np.arange(count, dtype=np.int64)
    return Events(
        t,
        rng.integers(2, 30, count).astype(np.uint16),
        rng.integers(2, 30, count).astype(np.uint16),
        rng.integers(0, 2, count).astype(np.uint8),
        32,
        32,
    )


def simulator(core: CoreConfig, **options: int | bool) -> CoreSimulator:
    return CoreSimulator(core, CANCEL, MotionSchedule.unknown(), width=32, height=32, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("core", "interval"),
    [
        # 13 reads, then data and decision, before the next one enters.
        (CoreConfig(lookup="serial"), 13 + 1 + 2),
        (CoreConfig(lookup="serial", overlap="forward"), 13),
        (CoreConfig(lookup="row", overlap="forward"), 5),
        (CoreConfig(lookup="banked", overlap="forward"), 1),
        (CoreConfig(lookup="banked", overlap="forward", predict_multipliers=1), 4),
    ],
)
def test_a_saturated_core_takes_one_event_an_interval(core: CoreConfig, interval: int) -> None:
    trace = simulator(core, saturated=True).process(stream(500))
    assert set(np.diff(trace.issued)[20:].tolist()) == {interval}


@pytest.mark.parametrize("utilisation", [0.3, 0.6, 0.8])
def test_the_wait_at_the_input_is_that_of_a_queue_with_constant_service(utilisation: float) -> None:
    count, service = 60_000, 16
    core = simulator(CoreConfig(input_depth=1 << 16, output_depth=1 << 10))
    rng = np.random.default_rng(3)
    arrival = np.cumsum(1 + rng.geometric(1.0 / (service / utilisation - 1.0), count) - 1 + 1) - 1
    trace = core.process(stream(count), arrival.astype(np.int64))
    gaps = np.diff(arrival)
    # Kingman's formula is exact to first order: variance of the gaps, constant service.
    load = service / gaps.mean()
    wait = load / (1 - load) * (gaps.std() / gaps.mean()) ** 2 / 2 * service
    idle = trace.latency.min()
    assert trace.latency.mean() - idle == pytest.approx(wait, rel=0.25, abs=1.0)


def test_a_core_that_is_asked_for_more_drops_what_it_cannot_take() -> None:
    count = 20_000
    core = simulator(CoreConfig(input_depth=8))
    trace = core.process(stream(count), np.arange(count, dtype=np.int64) * 8)  # one event every 8 of 16 cycles
    assert trace.dropped.mean() == pytest.approx(0.5, abs=0.01)
    gauge = Gauge()
    gauge.take(trace)
    assert gauge.input_level().high_water == 8


def test_a_slow_line_out_holds_the_core_back_until_the_input_drops() -> None:
    count = 5000
    quick, slow = (simulator(CoreConfig(output_depth=4, input_depth=8), link_q16=link << 16) for link in (0, 100))
    arrival = np.arange(count, dtype=np.int64) * 50
    assert not quick.process(stream(count), arrival).dropped.any()
    trace = slow.process(stream(count), arrival)
    left = trace.left[~trace.dropped]
    assert set(np.diff(left)[10:].tolist()) == {100}
    assert trace.dropped.mean() == pytest.approx(0.5, abs=0.01)
    assert slow.waited["credit"] > 0


def test_lanes_work_side_by_side_where_events_lie_apart() -> None:
    events = stream(2000)
    left = events.select(events.x < 14)
    one, two = (
        simulator(CoreConfig(lookup="serial", overlap="forward", lanes=lanes), saturated=True) for lanes in (1, 2)
    )
    together = one.process(events).issued[-1] / two.process(events).issued[-1]
    alone_one, alone_two = (
        simulator(CoreConfig(lookup="serial", overlap="forward", lanes=lanes), saturated=True) for lanes in (1, 2)
    )
    alone = alone_one.process(left).issued[-1] / alone_two.process(left).issued[-1]
    assert alone == pytest.approx(1.0, abs=0.01)
    assert together > 1.2


def test_a_line_of_text_shows_every_block() -> None:
    from tiegocancel.firmware_sim.core.cycle_model import CycleModel
    from tiegocancel.firmware_sim.core.rule import lay_out_rule, lay_out_state

    events, schedule = stream(3), MotionSchedule.unknown()
    fast = simulator(CoreConfig())
    rule = lay_out_rule(CANCEL, schedule.t_us, schedule.coefficients[None], width=32, height=32)
    model = CycleModel(rule, lay_out_state(CANCEL, width=32, height=32), fast.plan, events, [0, 1, 2])
    lines = []
    while not model.done:
        model.step()
        lines.append(model.line_trace())
    assert all(line.count("|") == 6 for line in lines)
    assert "issue match" in "\n".join(lines)
    assert lines[0].split("|")[1].split() == ["in", "0", "0"]


def test_a_burst_of_the_length_that_is_told_is_taken_and_one_twice_as_long_is_not() -> None:
    from tiegocancel.firmware_sim.offer import Offer
    from tiegocancel.firmware_sim.outcome import run_device
    from tiegocancel.firmware_sim.pace import burst_events

    core = CoreConfig(input_depth=100, lookup="serial")
    events, offer = stream(2000), Offer()

    def make(mode: str) -> CoreSimulator:
        return simulator(core, saturated=mode == "saturated")

    outcome = run_device(make, events, offer, clock_hz=1e8, warm_up_us=0)
    length = burst_events(outcome, offer, input_depth=core.input_depth)
    for many, dropped in ((int(length) - 2, False), (int(2 * length), True)):
        trace = simulator(core).process(events[:many], np.arange(many, dtype=np.int64))
        assert trace.dropped.any() == dropped
