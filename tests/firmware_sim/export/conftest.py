"""Random configurations on sensors of any size, at times negative and far, for every test of the export."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tiegocancel.firmware_sim.export import Vectors, golden_vectors

from tiegocancel.events import MAX_TIME_US, Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.schedule import MAX_COEFFICIENT, MotionSchedule

Drawn = tuple[CancelConfig, Events, Schedules]


def drawn_config(rng: np.random.Generator) -> CancelConfig:
    """Return the plain rule or any mixture of what lies beyond it."""
    polarity = str(rng.choice(["opposite", "equal", "ignore"]))
    if rng.random() < 0.3:
        return CancelConfig(
            horizon_us=int(rng.integers(0, 60)),
            tolerance_us=int(rng.integers(0, 12)),
            tolerance_px=float(rng.choice([0, 1, 1.5, 2])),
            polarity=polarity,
            ring_capacity=int(rng.choice([3, 20, 500])),
        )
    tick_bits = int(rng.integers(0, 4))
    tick = 1 << tick_bits
    horizons = np.sort(rng.choice(np.arange(12, 60), int(rng.integers(1, 5)), replace=False)) * tick
    chooses = len(horizons) > 1 and rng.random() < 0.4
    carry = int(rng.choice([0, 1, 3, 15]))
    table: dict[str, Any] = {
        "horizon_us": int(horizons[0]),
        "more_horizons_us": tuple(int(value) for value in horizons[1:]),
        "early_us": int(rng.integers(0, 10)) * tick,
        "late_us": int(rng.integers(0, 10)) * tick,
        "tolerance_px": float(rng.choice([0, 1, 1.5, 2])),
        "polarity": polarity,
        "ring_capacity": int(rng.choice([3, 20, 500])),
        "carry": carry,
        "need": int(rng.integers(1, (1 if chooses else len(horizons)) + carry + 1)),
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
        table["line_px"], table["fraction_bits"] = float(rng.choice([0.5, 2])), int(rng.integers(0, 4))
    if rng.random() < 0.3:
        table["off_late_us"], table["off_tolerance_px"] = int(rng.integers(0, 10)) * tick, float(rng.choice([0, 1, 2]))
    return CancelConfig(**table)


def drawn_stream(config: CancelConfig, rng: np.random.Generator) -> tuple[Events, Schedules]:
    """Return a crowded stream in a corner of a sensor of any size, and schedules around its time."""
    width, height = (int(rng.choice([1, 2, 7, 40, 128, 1280, 65_535, 65_536])) for _ in range(2))
    count, span_us = int(rng.integers(1, 120)), int(rng.choice([0, 100, 2000, 10_000]))
    origin_us = int(rng.choice([-MAX_TIME_US, -5000, -1, 0, 3, 10**9, MAX_TIME_US - 10_000]))
    t = origin_us + np.sort(rng.integers(0, span_us + 1, count)).astype(np.int64)
    if rng.random() < 0.1:
        t[-1] = MAX_TIME_US
    x, y = (side - 1 - rng.integers(0, min(side, 24), count) for side in (width, height))
    rows = int(rng.integers(1, 8))
    row_t = np.sort(rng.integers(-1000, span_us + 1000, rows)).astype(np.int64) + origin_us
    coefficients = rng.integers(-300, 300, (len(config.horizons_us), rows, 6))
    coefficients[..., [2, 5]] *= int(rng.choice([1, 400]))
    if rng.random() < 0.2:
        coefficients[:, rng.integers(0, rows)] = MAX_COEFFICIENT * int(rng.choice([-1, 1]))
    return Events(t, x, y, rng.integers(0, 2, count), width, height), tuple(
        MotionSchedule(row_t, part, horizon_us)
        for part, horizon_us in zip(coefficients, config.horizons_us, strict=True)
    )


@pytest.fixture(scope="session")
def draw() -> Callable[[int], Drawn]:
    """Return configuration, events and whole schedules of a seed."""

    def drawn(seed: int) -> Drawn:
        rng = np.random.default_rng(seed)
        config = drawn_config(rng)
        return config, *drawn_stream(config, rng)

    return drawn


@pytest.fixture(scope="session")
def disc() -> Callable[[CancelConfig], Vectors]:
    """Return vectors of a few dots that turn about the middle of 96×64 px, in which much is suppressed."""

    def made(config: CancelConfig, *, start_us: int = 0, **turn: Any) -> Vectors:
        rng = np.random.default_rng(5)
        radius, angle = 8 + 20 * rng.random(14), 2 * np.pi * rng.random(14)
        t = np.repeat(np.arange(0, 24_000, 300), 14) + np.tile(np.arange(14), 80)
        turned = np.tile(angle, 80) + 40.0 * t * 1e-6
        x, y = np.floor(48 + np.tile(radius, 80) * np.cos(turned)), np.floor(32 + np.tile(radius, 80) * np.sin(turned))
        events = Events(t + start_us, x.astype(int), y.astype(int), np.tile(np.arange(14) % 2, 80), 96, 64)
        schedules = tuple(
            MotionSchedule.rotation(center_px=(48, 32), omega_rad_s=40.0, horizon_us=horizon_us)
            for horizon_us in config.horizons_us
        )
        return golden_vectors(events, config, schedules)

    return made
