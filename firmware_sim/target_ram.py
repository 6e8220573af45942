"""Tell how much RAM a part offers to ring and table."""

from __future__ import annotations

from tiegocancel.firmware_sim.target import Target
from tiegocancel.firmware_sim.target_fpga import FpgaTarget

__all__ = ["usable_ram_bits"]


def usable_ram_bits(target: Target) -> int:
    """Return the bits of RAM that a design may fill.

    Of an FPGA: every memory block, times the share that its kind may be filled to; LUTs that can be memory are left
    out. Of a microcontroller: all RAM banks. An upper bound: blocks come in widths and banks apart, see ``memory_map``
    and ``ram_map`` for what fits in the end.
    """
    if not isinstance(target, FpgaTarget):
        return 8 * target.ram_bytes
    usable = target.usable
    return sum(
        int(memory.count * memory.bits * (usable.large_ram if memory.large else usable.block_ram))
        for memory in target.memories
    )
