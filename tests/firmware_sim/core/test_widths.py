"""Narrow stamps without a sweep come back as aliases, coefficients are rounded: to the bit as a plain model says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.simulator import CoreSimulator, narrowed

from tiegocancel.files import read_events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.matching.selective_oracle import SelectiveOracle
from tiegocancel.motion.schedule import MotionSchedule

SEEDS = st.integers(0, 2**32 - 1)


class AliasingOracle(SelectiveOracle):
    """The plain model with cells that know their time modulo ``2^bits`` only, and no sweep."""

    bits = 62

    def _left(self, cell: Any, now: int) -> int:
        return (cell.due - now + self._late[cell.p]) % (1 << self.bits)

    def _is_open(self, cell: Any, now: int) -> bool:
        early = self.config.early_gate_us >> self.config.tick_bits
        return bool(cell.horizons) and self._left(cell, now) <= early + self._late[cell.p]

    def _passes(self, cell: Any, now: int, p: int) -> bool:
        return self.config.polarity == "ignore" or (cell.p == p) == (self.config.polarity == "opposite")

    def _cell_for(self, at: Any, now: int) -> Any:
        found = super()._cell_for(at, now)
        ways = self._table[self._set_of(at)]
        if any(not self._is_open(cell, now) for cell in ways) or (self._is_open(found, now) and found.bin == at):
            return found
        return min(ways, key=lambda cell: self._left(cell, now))


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, more=st.integers(0, 3))
def test_aliases_of_narrow_stamps_are_those_of_a_plain_model(draw_case: Any, seed: int, more: int) -> None:
    case = draw_case(seed)
    if case.cancel.lines:
        return  # the line asks how late an event is, which an alias has no one answer to
    gate = ((case.cancel.early_gate_us + case.cancel.late_gate_us) >> case.cancel.tick_bits) + 1
    bits = gate.bit_length() + more
    core = CoreSimulator(CoreConfig(stamp_bits=bits), case.cancel, case.schedules, saturated=True, **case.size)
    oracle = AliasingOracle(case.cancel, case.schedules, **case.size)
    oracle.bits = bits
    assert core.process(case.events).suppressed.tolist() == oracle.process(case.events).suppressed.tolist()


def test_narrow_stamps_without_a_sweep_suppress_wrongly_and_wide_ones_do_not() -> None:
    rng = np.random.default_rng(7)
    from tiegocancel.events import Events

    count = 20_000
    t = np.sort(rng.integers(0, 400_000, count)).astype(np.int64)
    x, y = (rng.integers(0, 48, count).astype(np.uint16) for _ in range(2))
    events = Events(t, x, y, rng.integers(0, 2, count).astype(np.uint8), 48, 48)
    cancel = CancelConfig(horizon_us=3000, tolerance_us=500, tolerance_px=1.0)
    motion = MotionSchedule.rotation(center_px=(24, 24), omega_rad_s=40.0, horizon_us=3000)
    golden = OracleCanceller(cancel, motion, width=48, height=48).process(events).suppressed
    wrong = {}
    for bits in (12, 14, 20):
        core = CoreSimulator(CoreConfig(stamp_bits=bits), cancel, motion, width=48, height=48, saturated=True)
        wrong[bits] = int((core.process(events).suppressed != golden).sum())
    assert wrong[12] > wrong[14] > wrong[20] == 0


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, bits=st.integers(4, 16))
def test_narrow_coefficients_decide_as_the_golden_model_with_the_same(draw_case: Any, seed: int, bits: int) -> None:
    case = draw_case(seed)
    config = CoreConfig(coefficient_fraction_bits=bits)
    core = CoreSimulator(config, case.cancel, case.schedules, saturated=True, **case.size)
    golden = OracleCanceller(case.cancel, tuple(narrowed(one, bits) for one in case.schedules), **case.size)
    assert core.process(case.events).suppressed.tolist() == golden.process(case.events).suppressed.tolist()


@pytest.mark.parametrize(
    ("name", "options", "motion"),
    [
        ("anu_disc_10ms.npy", {"time_unit": "s", "width": 1280, "height": 720}, (664.6, 336.9, 3.63)),
        ("spinning_dot_evt2.raw", {}, (314.4, 202.5, 121.8)),
    ],
)
def test_real_recordings_are_decided_as_by_the_canceller(
    recording: Callable[[str], Path], name: str, options: dict[str, Any], motion: tuple[float, float, float]
) -> None:
    events = read_events(recording(name), **options)[:60_000]
    cancel = CancelConfig(horizon_us=2000, tolerance_us=500, ring_capacity=1 << 15)
    schedule = MotionSchedule.rotation(center_px=motion[:2], omega_rad_s=motion[2], horizon_us=2000)
    size = {"width": events.width, "height": events.height}
    core = CoreSimulator(CoreConfig(), cancel, schedule, saturated=True, **size)
    suppressed = core.process(events).suppressed
    assert suppressed.any()
    assert suppressed.tolist() == Canceller(cancel, schedule, **size).process(events).suppressed.tolist()
