"""The kernel of the selective rule equals the plain model, bit for bit, whatever the parameters and the cuts."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.events import Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.matching.presets import PRESETS
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.schedule import MotionSchedule


def drawn(seed: int) -> tuple[CancelConfig, Schedules, Events]:
    """Return a random configuration with its schedules, and a small crowded stream.

    What chooses, spreads and splits is left out; see :func:`extended`.
    """
    rng = np.random.default_rng(seed)
    tick_bits = int(rng.integers(0, 4))
    tick = 1 << tick_bits
    horizons = np.sort(rng.choice(np.arange(12, 60), int(rng.integers(1, 5)), replace=False)) * tick
    carry = int(rng.choice([0, 1, 3, 7]))
    table: dict[str, Any] = {
        "horizon_us": int(horizons[0]),
        "more_horizons_us": tuple(int(value) for value in horizons[1:]),
        "early_us": int(rng.integers(0, 10)) * tick,
        "late_us": int(rng.integers(0, 10)) * tick,
        "tolerance_px": float(rng.choice([0, 1, 1.5, 2, 3])),
        "polarity": str(rng.choice(["opposite", "equal", "ignore"])),
        "ring_capacity": int(rng.choice([3, 20, 5000])),
        "carry": carry,
        "need": int(rng.integers(1, len(horizons) + carry + 1)),
        "uses": int(rng.choice([0, 1, 1, 2, 3])),
        "tick_bits": tick_bits,
        "bin_bits": int(rng.integers(0, 3)),
        "set_bits": None if rng.random() < 0.5 else (int(rng.integers(0, 4)), int(rng.integers(0, 4))),
        "ways": int(rng.integers(1, 5)),
        "least_shift_px": float(rng.choice([0, 0, 1.0, 1.5])),
        "motion_at": str(rng.choice(["event", "gate"])),
    }
    config = CancelConfig(**table)
    return config, *met_by(config, rng)


def met_by(config: CancelConfig, rng: np.random.Generator) -> tuple[Schedules, Events]:
    """Return random schedules for a configuration, and a small crowded stream."""
    horizons = config.horizons_us
    count, width, height = (int(rng.integers(1, most)) for most in (250, 40, 30))
    rows = int(rng.integers(1, 6))
    row_t = np.sort(rng.integers(-300, 2000, rows)).astype(np.int64)
    coefficients = rng.integers(-6000, 6000, (len(horizons), rows, 6))
    coefficients[..., [2, 5]] *= 20
    schedules = tuple(
        MotionSchedule(row_t, part, horizon_us)
        for part, horizon_us in zip(coefficients, config.horizons_us, strict=True)
    )
    t = np.sort(rng.integers(-300, int(rng.choice([300, 2500])), count)).astype(np.int64)
    columns = (rng.integers(0, limit, count) for limit in (width, height, 2))
    events, _ = Events.from_unsorted(t, *columns, width, height)
    return schedules, events


def extended(seed: int) -> tuple[CancelConfig, Schedules, Events]:
    """Return a case in which events choose among three horizons, the gate grows with speed, OFF has its own, or all.

    Few shapes of the kernel, because each is compiled.
    """
    rng = np.random.default_rng(seed)
    chooses, spreads, splits = (bool(seed >> bit & 1) for bit in range(3))
    table: dict[str, Any] = {
        "horizon_us": 12,
        "more_horizons_us": (26, 44),
        "early_us": int(rng.integers(0, 10)),
        "late_us": int(rng.integers(0, 10)),
        "tolerance_px": float(rng.choice([0, 1, 2, 3])),
        "polarity": str(rng.choice(["opposite", "equal", "ignore"])),
        "ring_capacity": int(rng.choice([3, 20, 5000])),
        "carry": 3,
        "need": int(rng.integers(1, 4)),
        "uses": int(rng.choice([0, 1, 2])),
        "bin_bits": int(rng.integers(0, 3)),
        "set_bits": (1, 2) if chooses != spreads else None,
        "ways": 3,
        "least_shift_px": float(rng.choice([0, 0, 1.0])),
        "motion_at": "gate" if splits and not chooses else "event",
    }
    if chooses:
        table["choose_px"] = float(rng.choice([0.5, 1.0, 2.0, 5.0]))
        table["more_ring_capacities"] = () if rng.random() < 0.5 else tuple(rng.choice([2, 9, 500], 2).tolist())
    if spreads:
        table |= {"spread_us": int(rng.choice([0, 1, 5, 30])), "spread_px": float(rng.choice([0.5, 1.0, 1.5]))}
    if splits:
        table |= {"off_late_us": int(rng.integers(0, 10)), "off_tolerance_px": float(rng.choice([0, 1, 2, 3]))}
    if chooses == splits:
        table |= {"line_px": float(rng.choice([0.5, 1.0, 2.0, 8.0])), "fraction_bits": int(rng.integers(0, 4))}
    config = CancelConfig(**table)
    return config, *met_by(config, rng)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32), cuts=st.lists(st.integers(0, 300), max_size=3))
@pytest.mark.parametrize("case", [drawn, extended])
def test_kernel_equals_the_plain_model(case: Any, seed: int, cuts: list[int]) -> None:
    config, schedules, events = case(seed)
    size = {"width": events.width, "height": events.height}
    canceller, oracle = Canceller(config, schedules, **size), OracleCanceller(config, schedules, **size)
    wanted = oracle.process(events)
    edges = [0, *sorted(min(cut, len(events)) for cut in cuts), len(events)]
    parts = [canceller.process(events[first:last]) for first, last in pairwise(edges)]
    assert np.concatenate([part.suppressed for part in parts]).tolist() == wanted.suppressed.tolist()
    assert np.concatenate([part.source for part in parts]).tolist() == np.asarray(wanted.source).tolist()
    if wanted.support is not None:
        assert np.concatenate([part.support for part in parts]).tolist() == wanted.support.tolist()
    assert dict(canceller.counters) == dict(oracle.counters)
    assert canceller.pending == oracle.pending
    assert canceller.most_held == oracle.most_held


def test_counts_balance() -> None:
    config, schedules, events = drawn(7)
    canceller = Canceller(config, schedules, width=events.width, height=events.height)
    canceller.process(events)
    counters = canceller.counters
    assert counters.events == counters.predicted + counters.outside + counters.overflow + counters.still


def test_a_least_shift_leaves_nothing_to_zero_motion() -> None:
    _, _, events = drawn(11)
    config = CancelConfig(horizon_us=40, tolerance_us=9, least_shift_px=1.0)
    canceller = Canceller(config, MotionSchedule.still(), width=events.width, height=events.height)
    assert not canceller.process(events).suppressed.any()
    assert canceller.counters.still == len(events)


def test_schedules_must_fit_the_horizons() -> None:
    config = CancelConfig(horizon_us=4000, more_horizons_us=(8000,), need=2)
    one = MotionSchedule.rotation(center_px=(5, 5), omega_rad_s=3.0, horizon_us=4000)
    with pytest.raises(ValueError, match="1 schedules do not serve 2 horizons"):
        Canceller(config, one, width=10, height=10)
    with pytest.raises(ValueError, match="horizon of 4000"):
        Canceller(config, (one, one), width=10, height=10)
    turn = RotationTrajectory.constant(center_px=(5, 5), omega_rad_s=3.0)
    with pytest.raises(ValueError, match="float path"):
        Canceller(config, turn, width=10, height=10)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_configurations(name: str) -> None:
    table = {key: tuple(value) if isinstance(value, list) else value for key, value in PRESETS[name].items()}
    assert CancelConfig(**table).is_plain == (name == "plain")
