"""Random firmwares on random parts, with the configurations and streams of the matching core's tests."""

from __future__ import annotations

import dataclasses
import importlib.util
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tiegocancel.firmware_sim import load_target
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.mcu.simulator import McuSimulator
from tiegocancel.firmware_sim.mcu.timing import lay_out_clock
from tiegocancel.firmware_sim.target_mcu import Cache, McuTarget

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules


def _beside(name: str, path: Path) -> ModuleType:
    """Import a file of the tests by its path: they are no package."""
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return sys.modules[name]


core_cases = _beside("core_cases", Path(__file__).parents[1] / "core" / "conftest.py")


def slow_part(*, cached: bool, ways: int = 2) -> McuTarget:
    """Return a part all of whose RAM waits, behind a tiny cache or none."""
    part = load_target("stm32h743")
    assert isinstance(part, McuTarget)
    banks = tuple(
        dataclasses.replace(bank, wait_cycles=3 + index, cached=cached, dma=True) for index, bank in enumerate(part.ram)
    )
    caches = (Cache(name="D", serves="data", bytes=64 * ways, line_bytes=16, ways=ways, source="made up"),)
    return dataclasses.replace(part, ram=banks, caches=caches if cached else ())


@dataclass(frozen=True)
class McuCase:
    """One random case: what decides, on which part and how, what it sees."""

    target: McuTarget
    config: McuConfig
    cancel: CancelConfig
    schedules: Schedules
    events: Events
    arrival: NDArray[np.int64]
    link_q16: int
    sweep_cycles: int
    cut: int

    def simulator(self, **options: Any) -> McuSimulator:
        """Return a simulator at rest; the sweep is as fast as the case asks."""
        made = McuSimulator(
            self.target,
            self.config,
            self.cancel,
            self.schedules,
            width=self.events.width,
            height=self.events.height,
            **options,
        )
        made.plan = made.plan._replace(sweep_cycles=self.sweep_cycles)
        made.clock = lay_out_clock(made.plan, len(self.cancel.horizons_us))
        return made


@pytest.fixture(scope="session")
def draw_case() -> Callable[[int], McuCase]:
    """Return the case of a seed."""
    names = ("rp2040", "rp2350", "stm32f405", "stm32h743", "imxrt1062", "esp32-s3", "nrf52840")
    parts = [load_target(name) for name in names]
    parts += [slow_part(cached=False), slow_part(cached=True), slow_part(cached=True, ways=1)] * 2

    def draw(seed: int) -> McuCase:
        rng = np.random.default_rng(seed)
        cancel = core_cases.drawn_cancel(rng)
        schedules, events = core_cases.drawn_stream(cancel, rng)
        gaps = 1 + rng.exponential(float(rng.choice([3.0, 100.0, 500.0, 3000.0])), len(events)).astype(np.int64)
        gaps[rng.random(len(events)) < 0.4] = 1
        part = parts[int(rng.integers(len(parts)))]
        assert isinstance(part, McuTarget)
        return McuCase(
            part,
            McuConfig(
                input=str(rng.choice(["dma", "blocks", "interrupt"])),  # type: ignore[arg-type]
                input_depth=int(rng.choice([2, 4, 10, 64])),
                output_depth=int(rng.choice([1, 2, 5, 64])),
                flush_us=int(rng.choice([1, 5, 100])),
                cores=int(rng.choice([1, 2])),
                optimisation=str(rng.choice(["O2", "Os"])),  # type: ignore[arg-type]
            ),
            cancel,
            schedules,
            events,
            np.cumsum(gaps),
            link_q16=int(rng.choice([0, 0, 1 << 16, 5 << 15, 900 << 16])),
            sweep_cycles=int(rng.choice([0, 6000, 20_011, 100_000])),
            cut=int(rng.integers(0, len(events) + 1)),
        )

    return draw


@pytest.fixture(scope="session")
def clocked() -> ModuleType:
    """Return the clocked model."""
    return _beside("clocked_firmware", Path(__file__).parent / "clocked.py")


@pytest.fixture(scope="session")
def draw_slow() -> Callable[[bool], McuTarget]:
    """Return a maker of parts whose RAM waits, behind a cache or not."""
    return lambda cached: slow_part(cached=cached)
