"""Random configurations, cores and small crowded streams, for every test of the matching core."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.plan import fastest_scrub

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.schedule import MotionSchedule


def drawn_cancel(rng: np.random.Generator) -> CancelConfig:
    """Return a random configuration: the plain rule, or any mixture of what lies beyond it."""
    if rng.random() < 0.3:
        return CancelConfig(
            horizon_us=int(rng.integers(0, 60)),
            tolerance_us=int(rng.integers(0, 12)),
            tolerance_px=float(rng.choice([0, 1, 1.5, 2])),
            polarity=str(rng.choice(["opposite", "equal", "ignore"])),
            ring_capacity=int(rng.choice([1, 3, 20, 500])),
        )
    tick_bits = int(rng.integers(0, 4))
    tick = 1 << tick_bits
    horizons = np.sort(rng.choice(np.arange(12, 60), int(rng.integers(1, 4)), replace=False)) * tick
    chooses = len(horizons) > 1 and rng.random() < 0.4
    carry = int(rng.choice([0, 1, 3]))
    agreeing = 1 if chooses else len(horizons)
    table: dict[str, Any] = {
        "horizon_us": int(horizons[0]),
        "more_horizons_us": tuple(int(value) for value in horizons[1:]),
        "early_us": int(rng.integers(0, 10)) * tick,
        "late_us": int(rng.integers(0, 10)) * tick,
        "tolerance_px": float(rng.choice([0, 1, 1.5, 2])),
        "polarity": str(rng.choice(["opposite", "equal", "ignore"])),
        "ring_capacity": int(rng.choice([3, 20, 500])),
        "carry": carry,
        "need": int(rng.integers(1, agreeing + carry + 1)),
        "uses": int(rng.choice([0, 1, 2, 3])),
        "tick_bits": tick_bits,
        "bin_bits": int(rng.integers(0, 3)),
        "set_bits": None if rng.random() < 0.5 else (int(rng.integers(0, 4)), int(rng.integers(0, 4))),
        "ways": int(rng.integers(1, 5)),
        "least_shift_px": float(rng.choice([0, 0, 1.0])),
        "motion_at": "event" if chooses else str(rng.choice(["event", "gate"])),
    }
    if chooses:
        table["choose_px"] = float(rng.choice([1.0, 2.5]))
        table["more_ring_capacities"] = tuple(int(rng.choice([3, 20, 500])) for _ in horizons[1:])
    if rng.random() < 0.3:
        table["spread_px"], table["spread_us"] = float(rng.choice([0, 1])), int(rng.integers(1, 30))
    if rng.random() < 0.3:
        table["off_late_us"] = int(rng.integers(0, 10)) * tick
        table["off_tolerance_px"] = float(rng.choice([0, 1, 2]))
    if rng.random() < 0.3:
        table["line_px"], table["fraction_bits"] = float(rng.choice([0.5, 1, 2.5])), int(rng.integers(0, 4))
    return CancelConfig(**table)


def drawn_stream(config: CancelConfig, rng: np.random.Generator) -> tuple[Schedules, Events]:
    """Return random schedules for a configuration, and a small crowded stream."""
    count, width, height = (int(rng.integers(1, most)) for most in (160, 40, 30))
    rows = int(rng.integers(1, 5))
    row_t = np.sort(rng.integers(-300, 2000, rows)).astype(np.int64)
    coefficients = rng.integers(-6000, 6000, (len(config.horizons_us), rows, 6))
    coefficients[..., [2, 5]] *= 20
    schedules = tuple(
        MotionSchedule(row_t, part, horizon_us)
        for part, horizon_us in zip(coefficients, config.horizons_us, strict=True)
    )
    t = np.sort(rng.integers(-300, int(rng.choice([-100, 300, 2500])), count)).astype(np.int64)
    columns = (rng.integers(0, limit, count) for limit in (width, height, 2))
    events, _ = Events.from_unsorted(t, *columns, width, height)
    return schedules, events


def drawn_core(rng: np.random.Generator) -> CoreConfig:
    """Return a random micro-architecture."""
    memory = str(rng.choice(["block", "block", "block", "single_port", "external"]))
    single, outside = memory == "single_port", memory == "external"
    return CoreConfig(
        input_depth=int(rng.choice([1, 2, 5, 64])),
        output_depth=int(rng.choice([1, 2, 5, 64])),
        lookup="serial" if single or outside else str(rng.choice(["serial", "row", "banked"])),
        ways_per_read=int(rng.integers(0, 3)),
        lanes=1 if outside else int(rng.choice([1, 1, 2, 5])),
        overlap="none" if single else str(rng.choice(["none", "interlock", "forward"])),
        read_latency=int(rng.integers(1, 3)),
        select_depth=int(rng.integers(0, 4)),
        predict_multipliers=int(rng.choice([1, 2, 4])),
        drain_multipliers=int(rng.choice([1, 2, 4])),
        map_depth=int(rng.integers(1, 5)),
        table_memory=memory,
        cache_lines=int(rng.choice([1, 4, 16])),
        line_cells=int(rng.choice([1, 4, 16])),
        miss_cycles=int(rng.choice([1, 7, 40])),
    )


def drawn_arrival(count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return arrivals in cycles: crowded, spaced, or in bursts."""
    mean = float(rng.choice([1.0, 4.0, 30.0, 300.0]))
    gaps = 1 + rng.exponential(mean, count).astype(np.int64)
    gaps[rng.random(count) < 0.5] = 1
    return np.cumsum(gaps)


@dataclass(frozen=True)
class Case:
    """One random case: what decides, what it is built of, what it sees."""

    cancel: CancelConfig
    core: CoreConfig
    schedules: Schedules
    events: Events
    arrival: NDArray[np.int64]
    scrub_cycles: int
    link_q16: int
    cut: int

    @property
    def size(self) -> dict[str, int]:
        """Width and height of the sensor."""
        return {"width": self.events.width, "height": self.events.height}


@pytest.fixture(scope="session")
def draw_case() -> Callable[[int], Case]:
    """Return the case of a seed."""

    def draw(seed: int) -> Case:
        rng = np.random.default_rng(seed)
        cancel, core = drawn_cancel(rng), drawn_core(rng)
        schedules, events = drawn_stream(cancel, rng)
        return Case(
            cancel,
            core,
            schedules,
            events,
            drawn_arrival(len(events), rng),
            scrub_cycles=int(rng.choice([0, 0, 1, 2, 5, 100])) * fastest_scrub(core),
            link_q16=int(rng.choice([0, 0, 1 << 16, 5 << 15, 40 << 16])),
            cut=int(rng.integers(0, len(events) + 1)),
        )

    return draw
