"""Say what a budget assumes beside the part and the canceller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["BudgetSettings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetSettings:
    """Assume links, sensor and clock; see ``firmware_sim.arrival.InputPath`` and ``firmware_sim.offer.Offer``.

    ``external_memory``: name or file of a memory chip that may hold the table of an FPGA; none when empty.
    ``most_events`` of the recording are simulated, from its beginning. ``clock_mhz``: 0 is what the part is known to
    reach. ``architecture``: ``auto`` takes the simplest core or firmware that passes, ``fixed`` the one of ``[core]``
    or ``[mcu]``. A link of 0 bits a second is as wide as it takes; on a microcontroller it is the fastest link of the
    part. ``changes``: look for the smallest changes that turn a fail into a pass; at most ``most_changes`` are told.
    """

    most_events: int = 1_000_000
    clock_mhz: float = 0.0
    architecture: Literal["auto", "fixed"] = "auto"
    readout_events_per_second: float = 0.0
    input_link_bits_per_second: float = 0.0
    input_bits_per_event: float = 32.0
    sensor_buffer_events: int = 4096
    output_link_bits_per_second: float = 0.0
    output_bits_per_event: float = 32.0
    max_latency_us: float = 0.0
    external_memory: str = ""
    changes: bool = True
    most_changes: int = 5

    def __post_init__(self) -> None:
        if not 1 <= self.most_events <= 100_000_000:
            raise ValueError(f"most_events must be from 1 to 100,000,000, not {self.most_events}")
        if self.clock_mhz and not 0.01 <= self.clock_mhz <= 10_000:
            raise ValueError(f"clock_mhz must be 0 or from 0.01 to 10000, not {self.clock_mhz}")
        if not 1 <= self.most_changes <= 20:
            raise ValueError(f"most_changes must be from 1 to 20, not {self.most_changes}")
