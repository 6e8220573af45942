"""Count the bits that a canceller must hold on a device: ring and table at chosen widths."""

from __future__ import annotations

from dataclasses import dataclass

from tiegocancel.matching.config import CancelConfig

__all__ = ["StateBits", "state_bits"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateBits:
    """Widths and totals in bits. A ring entry is time, cell address, polarity; a cell is time, polarity, valid."""

    time: int
    address: int
    ring_entry: int
    ring: int
    cell: int
    table: int

    @property
    def total(self) -> int:
        """Ring and table together."""
        return self.ring + self.table

    @property
    def total_kib(self) -> float:
        """Ring and table in KiB, before rounding to the memory blocks of a part."""
        return self.total / 8192


def state_bits(config: CancelConfig, *, width: int, height: int, time_bits: int = 30) -> StateBits:
    """Return the state of ``config`` for a sensor of ``width`` × ``height`` px with time stamps of ``time_bits``.

    30 bits is what the packed kernel holds. Fewer wrap sooner and need a scrub of the table; below
    ``log2(2·(Δt + ε_t) + 1)`` a pending prediction is ambiguous, and ``ValueError`` says so.
    """
    least = (2 * config.warm_up_us).bit_length()
    if not least <= time_bits <= 64:
        raise ValueError(
            f"time_bits must be from {least} to 64 for a horizon of {config.horizon_us} µs, not {time_bits}"
        )
    address = (width * height - 1).bit_length()
    ring_entry, cell = time_bits + address + 1, time_bits + 2
    return StateBits(
        time=time_bits,
        address=address,
        ring_entry=ring_entry,
        ring=ring_entry * config.ring_capacity,
        cell=cell,
        table=cell * width * height,
    )
