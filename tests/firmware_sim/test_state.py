"""The state in bits follows from capacity, sensor and time width, and narrow stamps show in no decision."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim import state_bits

from tiegocancel import CancelConfig, Events, MotionSchedule
from tiegocancel.matching.selective_oracle import SelectiveOracle

SELECTIVE = CancelConfig(
    horizon_us=12_288,
    early_us=2560,
    late_us=2560,
    tolerance_px=1.0,
    tick_bits=9,
    bin_bits=1,
    uses=0,
    carry=3,
    need=4,
    set_bits=(6, 5),
    ways=8,
    ring_capacity=49_152,
)


def test_bits_of_ring_and_table_by_hand() -> None:
    state = state_bits(CancelConfig(ring_capacity=1000), width=320, height=240, time_bits=16)
    assert (state.address, state.ring_entry, state.cell) == (17, 34, 18)
    assert (state.ring, state.table) == (34_000, 18 * 76_800)
    assert state.total_kib == pytest.approx((34_000 + 18 * 76_800) / 8192)


def test_the_plain_rule_has_the_stamps_of_the_packed_kernel() -> None:
    state = state_bits(CancelConfig(ring_capacity=1000), width=320, height=240)
    assert (state.time, state.ring_entry, state.cell, state.sweep_ticks) == (30, 48, 32, 0)


def test_a_time_too_narrow_to_tell_pending_predictions_apart_is_refused() -> None:
    config = CancelConfig(horizon_us=8000, tolerance_us=1000)  # 18,001 instants from −9000 to 9000
    assert state_bits(config, width=8, height=8, time_bits=15).time == 15
    with pytest.raises(ValueError, match="time_bits must be from 15 to 64 for a horizon of 8000 µs, not 14"):
        state_bits(config, width=8, height=8, time_bits=14)


def test_bits_of_a_selective_configuration_by_hand() -> None:
    state = state_bits(SELECTIVE, width=1280, height=720)
    # 11 + 10 for the pixel, polarity, support 0 to 3; 24 + 5 + 1 ticks begin at a place of 49,152 and one more.
    assert (state.address, state.support, state.ring_entry) == (21, 2, 24)
    assert state.index == 30 * 16
    assert state.ring == 24 * 49_152 + 480
    # 640 × 360 bins: 10 − 6 and 9 − 5 bits of tag; 11 ticks of gate in 4 bits; polarity, one horizon, support.
    assert (state.tag, state.time, state.sweep_ticks) == (8, 4, 5)
    assert (state.cell, state.cells, state.table) == (16, 16_384, 16 * 16_384)
    assert state.total_kib == pytest.approx((24 * 49_152 + 480 + 16 * 16_384) / 8192)


@pytest.mark.parametrize(
    ("changed", "entry", "cell", "cells"),
    [
        ({}, 18 + 10, 8 + 2, 320 * 240),  # age to 600 in 10 bits; 201 ticks of gate with a quarter to spare
        ({"carry": 7}, 18 + 10 + 3, 8 + 2 + 3, 320 * 240),
        ({"uses": 0}, 18 + 10, 8 + 2, 320 * 240),
        ({"uses": 2}, 18 + 10, 8 + 2 + 1, 320 * 240),
        ({"uses": 4}, 18 + 10, 8 + 2 + 2, 320 * 240),
        ({"uses": 5}, 18 + 10, 8 + 2 + 3, 320 * 240),
        ({"more_horizons_us": (900, 950)}, 18 + 11, 8 + 4, 320 * 240),
        ({"early_us": 0}, 18 + 10, 7 + 2, 320 * 240),
        ({"bin_bits": 2}, 18 + 10, 8 + 2, 80 * 60),
        ({"off_late_us": 300}, 18 + 10, 9 + 2, 320 * 240),  # 100 + 300 + 1 ticks, and a quarter
        ({"line_px": 1.0}, 18 + 10, 8 + 2, 320 * 240),
        ({"line_px": 1.0, "fraction_bits": 2, "bin_bits": 1}, 18 + 10, 8 + 2 + 2 * 3, 160 * 120),
        ({"spread_us": 30, "spread_px": 1.0}, 18 + 10, 8 + 2, 320 * 240),
        ({"set_bits": (3, 12), "ways": 2}, 18 + 10, 8 + 2 + 6, 2 << 15),  # rows are told by the set alone
    ],
)
def test_each_parameter_costs_its_bits(changed: dict[str, Any], entry: int, cell: int, cells: int) -> None:
    table: dict[str, Any] = {"horizon_us": 500, "tolerance_us": 100, "ring_capacity": 50, "motion_at": "gate"}
    state = state_bits(CancelConfig(**{**table, **changed}), width=320, height=240)
    assert (state.ring_entry, state.cell, state.cells) == (entry, cell, cells)
    assert (state.ring, state.table) == (entry * 50 + state.index, cell * cells)
    assert state.index == 0  # so short a ring stamps its entries


def test_each_horizon_has_a_ring_of_its_own_where_events_choose() -> None:
    table: dict[str, Any] = {"horizon_us": 500, "more_horizons_us": (900,), "tolerance_us": 100, "choose_px": 4.0}
    state = state_bits(CancelConfig(**table, ring_capacity=50, more_ring_capacities=(30,)), width=320, height=240)
    assert (state.ring_entry, state.ring, state.index) == (18 + 10, (18 + 10) * 80, 0)
    long = state_bits(CancelConfig(**table, ring_capacity=5000, more_ring_capacities=(2000,)), width=320, height=240)
    assert long.index == (500 + 100 + 1) * 13 + (900 + 100 + 1) * 11
    assert (long.ring_entry, long.ring) == (18, 18 * 7000 + long.index)


def test_stamps_no_wider_than_their_gate_are_refused() -> None:
    assert state_bits(SELECTIVE, width=8, height=8, time_bits=4).sweep_ticks == 5
    with pytest.raises(ValueError, match="time_bits must be from 4 to 64 for a gate of 11 ticks, not 3"):
        state_bits(SELECTIVE, width=8, height=8, time_bits=3)


class NarrowStamps(SelectiveOracle):
    """Keep stamps modulo ``2^T`` and sweep, as a device does; everything else is the plain model's."""

    def __init__(self, *args: Any, time_bits: int, sweep_ticks: int, **size: int) -> None:
        super().__init__(*args, **size)
        self._modulus, self._sweep_ticks = 1 << time_bits, sweep_ticks
        self._clock: int | None = None

    def _left(self, cell: Any, now: int, late: int) -> int:
        return int((cell.due - now + late) % self._modulus)

    def _is_open(self, cell: Any, now: int) -> bool:
        late = self._late[cell.p]
        return bool(cell.horizons) and self._left(cell, now, late) <= self._early + late

    def _passes(self, cell: Any, now: int, p: int) -> bool:
        return self.config.polarity == "ignore" or (cell.p == p) == (self.config.polarity == "opposite")

    def _cell_for(self, at: Any, now: int) -> Any:
        first = super()._cell_for(at, now)
        ways = self._table[self._set_of(at)]
        if self._is_open(first, now) and first.bin != at:
            return min(ways, key=lambda cell: self._left(cell, now, max(self._late)))
        return first

    def _write(self, at: Any, h: int, due: int, entry: Any, now: int) -> Any:
        cell = super()._write(at, h, due, entry, now)
        cell.due = due % self._modulus
        return cell

    def _drain(self, maps: Any, h: int, now: int) -> None:
        for tick in range(now if self._clock is None else self._clock, now):
            cells = [cell for ways in self._table.values() for cell in ways]
            for cell in cells[tick % self._sweep_ticks :: self._sweep_ticks]:
                if not self._is_open(cell, tick):
                    cell.horizons = set()
        self._clock = now
        super()._drain(maps, h, now)


def crowd(seed: int) -> tuple[CancelConfig, Events]:
    """Return a random small configuration and a stream with gaps, in which stamps wrap many times."""
    rng = np.random.default_rng(seed)
    config = CancelConfig(
        horizon_us=8,
        more_horizons_us=(13,),
        early_us=int(rng.integers(0, 4)),
        late_us=int(rng.integers(0, 4)),
        off_late_us=int(rng.integers(0, 4)) if rng.random() < 0.5 else None,
        uses=int(rng.integers(0, 3)),
        carry=3,
        need=int(rng.integers(1, 4)),
        set_bits=(1, 1) if rng.random() < 0.5 else None,
        ways=3,
    )
    gaps = rng.choice([0, 0, 0, 1, 1, 2, 9, 40], 150)
    columns = (rng.integers(0, limit, 150) for limit in (6, 4, 2))
    return config, Events(np.cumsum(gaps), *columns, 6, 4)


def decided(oracle: SelectiveOracle, events: Events) -> tuple[list[bool], list[int], dict[str, int]]:
    decisions = oracle.process(events)
    assert decisions.source is not None
    return decisions.suppressed.tolist(), decisions.source.tolist(), dict(oracle.counters)


def narrow(config: CancelConfig, events: Events, *, spare: int, slower: int = 0) -> Any:
    """Decide with the least stamps and ``spare`` bits more, the sweep ``slower`` ticks slower than it may be."""
    gate = config.early_gate_us + config.late_gate_us + 1
    state = state_bits(config, width=6, height=4, time_bits=gate.bit_length() + spare)
    widths = {"time_bits": state.time, "sweep_ticks": state.sweep_ticks + slower}
    return decided(NarrowStamps(config, MotionSchedule.still(), width=6, height=4, **widths), events)


@settings(max_examples=100)
@given(seed=st.integers(0, 2**32), spare=st.integers(0, 2))
def test_stamps_that_wrap_show_in_no_decision_and_no_count(seed: int, spare: int) -> None:
    config, events = crowd(seed)
    assert narrow(config, events, spare=spare) == decided(
        SelectiveOracle(config, MotionSchedule.still(), width=6, height=4), events
    )


def test_without_its_sweep_an_alias_is_seen() -> None:
    config = CancelConfig(horizon_us=8, tolerance_us=1, uses=0)
    events = Events([0, 8, 12], [1, 1, 1], [1, 1, 1], [1, 1, 1], 6, 4)  # 12 is 4 ticks after the prediction for 8
    assert narrow(config, events, spare=0)[0] == [False, True, False]
    assert narrow(config, events, spare=0, slower=1000)[0] == [False, True, True]
