"""The verdict on a firmware follows what was placed and simulated, and names what binds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tiegocancel.firmware_sim import load_target
from tiegocancel.firmware_sim.arrival import InputPath
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.mcu.judge import fits_mcu, judge_mcu
from tiegocancel.firmware_sim.offer import Offer
from tiegocancel.firmware_sim.target_mcu import McuTarget
from tiegocancel.firmware_sim.verdict import Verdict

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.motion.schedule import MotionSchedule

PLAIN = CancelConfig(horizon_us=3000, tolerance_us=300, tolerance_px=1.0, ring_capacity=4096)
TURN = MotionSchedule.rotation(center_px=(32.0, 24.0), omega_rad_s=3.0, horizon_us=3000)


def stream(rate_hz: float, count: int = 6000) -> Events:
    """Random events at a steady mean rate."""
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.exponential(1e6 / rate_hz, count)).astype(np.int64)
    columns = (rng.integers(0, limit, count) for limit in (64, 48, 2))
    events, _ = Events.from_unsorted(t, *columns, 64, 48)
    return events


def part(name: str) -> McuTarget:
    target = load_target(name)
    assert isinstance(target, McuTarget)
    return target


def judged(name: str, events: Events, cancel: CancelConfig = PLAIN, **options: Any) -> Verdict:
    offer = Offer(input=InputPath(link_bits_per_second=0.0))
    return judge_mcu(part(name), cancel, TURN, events, offer, clock_hz=part(name).clock_mhz * 1e6, **options)


def test_a_slow_stream_passes_with_the_decisions_of_the_semantics() -> None:
    events = stream(50_000)
    verdict = judged("stm32f405", events)
    assert verdict.passes
    outcome = verdict.outcome
    assert outcome is not None
    golden = OracleCanceller(PLAIN, TURN, width=64, height=48).process(events)
    assert outcome.suppressed.tolist() == golden.suppressed.tolist()
    assert outcome.drops == outcome.lost == 0
    assert 0 < verdict.utilisation["compute"] < 0.2


def test_a_stream_beyond_the_core_fails_at_its_rate_and_what_is_dropped_is_counted() -> None:
    events = stream(3_000_000, 20_000)
    verdict = judged("rp2040", events, config=McuConfig(input_depth=64))
    assert verdict.fits
    assert not verdict.keeps_up
    outcome = verdict.outcome
    assert outcome is not None
    assert outcome.drops == len(events) - int(outcome.kept.sum()) > 1000
    assert outcome.counts["events"] == int(outcome.kept.sum())
    rate = next(one for one in verdict.constraints if one.name == "mean rate")
    assert not rate.ok
    assert 150_000 < rate.have < 600_000
    assert outcome.input_need > 64 + outcome.drops / 2


def test_what_has_no_place_is_said_and_not_simulated() -> None:
    verdict = judge_mcu(
        part("rp2040"), CancelConfig(), MotionSchedule.still(), Events.empty(1280, 720), Offer(), clock_hz=133e6
    )
    assert not verdict.fits
    assert verdict.outcome is None
    assert verdict.binding.name.startswith("RAM")
    assert not fits_mcu(part("rp2040"), CancelConfig(), width=1280, height=720)
    assert fits_mcu(part("rp2040"), PLAIN, width=64, height=48)


@pytest.mark.parametrize("source", ["dma", "blocks", "interrupt"])
def test_every_way_in_keeps_all_events_of_a_slow_stream(source: Any) -> None:
    verdict = judged("nrf52840", stream(20_000), config=McuConfig(input=source))
    assert verdict.outcome is not None
    assert verdict.outcome.drops == 0
    latency_us = verdict.outcome.latency_ns.most * 1e-3
    assert latency_us > 1000 if source == "blocks" else latency_us < 200
