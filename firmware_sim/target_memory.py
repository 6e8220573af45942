"""A memory chip beside the device: latency, burst, bandwidth, refresh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tiegocancel.firmware_sim.target_source import Sourced, unverified_of

__all__ = ["ExternalMemory"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ExternalMemory(Sourced):
    """A HyperRAM, SDRAM or DDR chip at one clock.

    ``bus_bits`` pass ``transfers_per_cycle`` times a clock of ``clock_mhz``. ``first_access_cycles``: clocks from the
    command to the first data of a row that is closed; ``open_access_cycles``: of a row that is open.
    ``turnaround_cycles``: clocks before the next access can begin after the last data (precharge, chip select high).
    ``burst_bytes``: what one access moves at least. ``refresh_period_us``: between two refreshes that each block the
    chip for ``refresh_busy_cycles``; 0 where the chip hides them in ``first_access_cycles``.
    """

    name: str
    part: str
    technology: Literal["hyperram", "sdram", "ddr3", "psram"]
    bytes: int
    clock_mhz: float
    bus_bits: int
    transfers_per_cycle: int
    first_access_cycles: int
    open_access_cycles: int
    turnaround_cycles: int
    burst_bytes: int
    refresh_period_us: float = 0
    refresh_busy_cycles: int = 0
    notes: str = ""
    kind: Literal["memory"] = "memory"

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        for name in ("bytes", "clock_mhz", "bus_bits", "transfers_per_cycle", "first_access_cycles", "burst_bytes"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)}")
        if not 0 <= self.open_access_cycles <= self.first_access_cycles:
            raise ValueError(
                f"open_access_cycles must be from 0 to first_access_cycles = {self.first_access_cycles}, "
                f"not {self.open_access_cycles}"
            )
        for name in ("turnaround_cycles", "refresh_period_us", "refresh_busy_cycles"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, not {getattr(self, name)}")

    @property
    def bytes_per_cycle(self) -> float:
        """Bytes a clock of the chip while a burst runs."""
        return self.bus_bits * self.transfers_per_cycle / 8

    @property
    def peak_bytes_per_second(self) -> float:
        """Bandwidth of an endless burst."""
        return self.bytes_per_cycle * self.clock_mhz * 1e6

    @property
    def refresh_share(self) -> float:
        """Part of the time lost to refresh."""
        if not self.refresh_period_us:
            return 0.0
        return self.refresh_busy_cycles / (self.refresh_period_us * self.clock_mhz)

    def access_cycles(self, size: int, *, row_open: bool = False) -> float:
        """Return the chip's clocks for one access to ``size`` neighbouring bytes, up to when the next can begin."""
        bursts = -(-size // self.burst_bytes)
        first = self.open_access_cycles if row_open else self.first_access_cycles
        return first + bursts * self.burst_bytes / self.bytes_per_cycle + self.turnaround_cycles

    def access_ns(self, size: int, *, row_open: bool = False) -> float:
        """Return the same in ns."""
        return self.access_cycles(size, row_open=row_open) * 1e3 / self.clock_mhz

    @property
    def unverified(self) -> tuple[str, ...]:
        """Paths of the numbers without a document."""
        return unverified_of(self)
