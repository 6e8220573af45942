"""Map the memories of a design onto the blocks that an FPGA has, with what is lost to widths and depths.

A memory becomes ``rows`` × columns of blocks in one mode, as synthesis tools infer it; splitting 20 bits by hand into
18 and 2 can save blocks and is not assumed, nor is clocking a block twice a cycle. Read ports beyond the first cost a
copy. Of the modes and kinds the one worth least is taken: blocks at what they are worth in LUTs, and half a LUT for
every bit of the multiplexer between rows (yosys ``passes/memory/memory_libmap.cc``, whose choices the tests hold this
to). Where blocks run short the next best that fits is taken before a memory is said not to fit.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil

from tiegocancel.firmware_sim.target_fpga import BlockRam, FpgaTarget, LutRam

__all__ = ["BlockUse", "LogicalMemory", "MemoryMap", "MemoryPlacement", "map_memories", "placements"]

LUT_RAM, FLIP_FLOPS = "LUT", "FF"
_MUX_LUTS_PER_BIT = 0.5
_FLIP_FLOP_LIMIT_BITS = 4096


@dataclass(frozen=True, slots=True, kw_only=True)
class LogicalMemory:
    """A memory of the design: ``words`` of ``width_bits``, and the ports that it needs in one cycle.

    ``read_ports``, ``write_ports``: used in the same cycle. ``shared_ports``: each reads or writes, one of the two a
    cycle; a table behind an arbiter needs ``read_ports=0, write_ports=0, shared_ports=1``. ``needs_init``: contents
    must be there after configuration (SPRAM has none).
    """

    name: str
    words: int
    width_bits: int
    read_ports: int = 1
    write_ports: int = 1
    shared_ports: int = 0
    needs_init: bool = False

    def __post_init__(self) -> None:
        if self.words < 1 or self.width_bits < 1:
            raise ValueError(f"words and width_bits must be positive, not {self.words} and {self.width_bits}")
        if min(self.read_ports, self.write_ports, self.shared_ports) < 0:
            raise ValueError("read_ports, write_ports and shared_ports must not be negative")
        if self.read_ports + self.shared_ports < 1:
            raise ValueError("a memory needs a port that reads")

    @property
    def bits(self) -> int:
        """What it must hold."""
        return self.words * self.width_bits


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryPlacement:
    """One memory on one kind of block; ``kind`` is the block's name, ``LUT`` or ``FF``.

    ``mode``: words and bits of a block. ``rows``: blocks one behind the other in depth. ``copies``: one a read port.
    ``blocks``: all of them (0 in LUTs and flip-flops). ``luts``: RAM made of LUTs and multiplexers between rows.
    ``bits_taken``: what the blocks could hold; ``worth_luts``: what the choice was made by. ``fits``: False where the
    part has not so many left.
    """

    memory: LogicalMemory
    kind: str
    mode: tuple[int, int]
    rows: int
    copies: int
    blocks: int
    luts: int
    ffs: int
    bits_taken: int
    worth_luts: float
    fits: bool = True

    @property
    def waste_bits(self) -> int:
        """Bits taken beyond those needed: rounding of width and depth, and copies."""
        return self.bits_taken - self.memory.bits


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockUse:
    """How many blocks of a kind are needed, how many the part has, and how many of them a design should fill."""

    kind: str
    need: int
    have: int
    usable: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryMap:
    """Where every memory went. ``unplaced``: memories whose ports no block has; they are in no count."""

    placements: tuple[MemoryPlacement, ...]
    uses: tuple[BlockUse, ...]
    unplaced: tuple[LogicalMemory, ...] = ()

    @property
    def fits(self) -> bool:
        """Whether the part holds all of them."""
        return not self.unplaced and all(placement.fits for placement in self.placements)

    @property
    def blocks(self) -> dict[str, int]:
        """Blocks needed by kind, those that are not there included."""
        return {use.kind: use.need for use in self.uses}

    @property
    def luts(self) -> int:
        """LUTs in RAM and between rows."""
        return sum(placement.luts for placement in self.placements)

    @property
    def ffs(self) -> int:
        """Flip-flops that hold memories."""
        return sum(placement.ffs for placement in self.placements)

    @property
    def waste_bits(self) -> int:
        """Bits lost in blocks."""
        return sum(placement.waste_bits for placement in self.placements)

    def of(self, name: str) -> MemoryPlacement:
        """Return the placement of the memory ``name``; raise ``KeyError`` where there is none."""
        for placement in self.placements:
            if placement.memory.name == name:
                return placement
        raise KeyError(name)


def map_memories(memories: Sequence[LogicalMemory], target: FpgaTarget) -> MemoryMap:
    """Place ``memories``, the largest first, each where it is worth least among what is left of ``target``.

    One that does not fit is counted as needed and takes nothing from the others.
    """
    left = {block.name: block.count for block in target.memories}
    left[LUT_RAM] = int(target.lut_ram.share * target.logic.luts) if target.lut_ram else 0
    left[FLIP_FLOPS] = target.logic.ffs
    need = dict.fromkeys(left, 0)
    placed, unplaced = {}, []
    for index, memory in sorted(enumerate(memories), key=lambda item: -item[1].bits):
        options = placements(memory, target)
        if not options:
            unplaced.append(memory)
            continue
        fitting = [option for option in options if _amount(option) <= left[option.kind]]
        choice = fitting[0] if fitting else dataclasses.replace(min(options, key=_shortage(left)), fits=False)
        left[choice.kind] -= _amount(choice) if choice.fits else 0
        need[choice.kind] += _amount(choice)
        placed[index] = choice
    uses = tuple(
        BlockUse(
            kind=block.name,
            need=need[block.name],
            have=block.count,
            usable=int(block.count * (target.usable.large_ram if block.large else target.usable.block_ram)),
        )
        for block in target.memories
    )
    return MemoryMap(placements=tuple(placed[index] for index in sorted(placed)), uses=uses, unplaced=tuple(unplaced))


def placements(memory: LogicalMemory, target: FpgaTarget) -> list[MemoryPlacement]:
    """Return every way to hold ``memory`` alone, the one worth least first; empty where no block has its ports.

    Flip-flops are offered up to 4096 bits: more would fill a part before they were of use.
    """
    found = [
        _in_blocks(memory, block, mode, copies)
        for block in target.memories
        for mode, copies in _modes(memory, block)
        if block.init or not memory.needs_init
    ]
    if memory.write_ports + memory.shared_ports <= 1:
        if target.lut_ram is not None:
            found.append(_in_luts(memory, target.lut_ram))
        if memory.bits <= _FLIP_FLOP_LIMIT_BITS:
            found.append(_in_flip_flops(memory))
    return sorted(found, key=lambda option: (option.worth_luts, option.blocks))


def _modes(memory: LogicalMemory, block: BlockRam) -> list[tuple[tuple[int, int], int]]:
    """Return the modes of ``block`` that give the ports of ``memory``, with the copies that each needs."""
    ports = (memory.read_ports, memory.write_ports, memory.shared_ports)
    if ports == (0, 0, 1):
        return [(mode, 1) for mode in dict.fromkeys(block.single + block.simple_dual + block.true_dual)]
    if ports == (0, 0, 2):
        return [(mode, 1) for mode in block.true_dual]
    if memory.shared_ports == 0 and memory.write_ports <= 1:
        return [(mode, memory.read_ports) for mode in dict.fromkeys(block.simple_dual + block.true_dual)]
    if memory.shared_ports == 1 and memory.write_ports == 0:
        return [(mode, memory.read_ports) for mode in block.true_dual]
    return []


def _in_blocks(memory: LogicalMemory, block: BlockRam, mode: tuple[int, int], copies: int) -> MemoryPlacement:
    """Return ``memory`` in blocks of one mode; rows share a block where a write can change a lane alone."""
    words, width = mode
    rows = ceil(memory.words / words)
    lane = block.lane_bits if 0 < block.lane_bits <= width else width
    lanes = ceil(memory.width_bits / lane)
    blocks = copies * ceil(rows * lanes * lane / width)
    mux = copies * _MUX_LUTS_PER_BIT * (rows - 1) * memory.width_bits
    enables = _MUX_LUTS_PER_BIT * rows if rows > 1 else 0.0
    return MemoryPlacement(
        memory=memory,
        kind=block.name,
        mode=mode,
        rows=rows,
        copies=copies,
        blocks=blocks,
        luts=ceil(mux + enables),
        ffs=0,
        bits_taken=blocks * block.bits,
        worth_luts=blocks * block.worth_luts + mux + enables,
    )


def _in_luts(memory: LogicalMemory, lut_ram: LutRam) -> MemoryPlacement:
    """Return ``memory`` in RAM made of LUTs, one copy a read port."""
    rows, copies = ceil(memory.words / lut_ram.words), max(memory.read_ports + memory.shared_ports, 1)
    units = rows * ceil(memory.width_bits / lut_ram.width_bits) * copies
    luts = units * lut_ram.luts + copies * _MUX_LUTS_PER_BIT * (rows - 1) * memory.width_bits
    return MemoryPlacement(
        memory=memory,
        kind=LUT_RAM,
        mode=(lut_ram.words, lut_ram.width_bits),
        rows=rows,
        copies=copies,
        blocks=0,
        luts=ceil(luts),
        ffs=0,
        bits_taken=units * lut_ram.words * lut_ram.width_bits,
        worth_luts=luts,
    )


def _in_flip_flops(memory: LogicalMemory) -> MemoryPlacement:
    """Return ``memory`` in flip-flops, with a multiplexer a read port."""
    mux = (memory.read_ports + memory.shared_ports) * _MUX_LUTS_PER_BIT * (memory.words - 1) * memory.width_bits
    return MemoryPlacement(
        memory=memory,
        kind=FLIP_FLOPS,
        mode=(1, 1),
        rows=memory.words,
        copies=1,
        blocks=0,
        luts=ceil(mux),
        ffs=memory.bits,
        bits_taken=memory.bits,
        worth_luts=memory.bits + mux,
    )


def _amount(option: MemoryPlacement) -> int:
    """Return how much of its kind a placement takes."""
    return {LUT_RAM: option.luts, FLIP_FLOPS: option.ffs}.get(option.kind, option.blocks)


def _shortage(left: dict[str, int]) -> Callable[[MemoryPlacement], tuple[bool, float]]:
    """Return the order of options that do not fit: blocks before LUTs, the one of which the least is missing first."""
    return lambda option: (option.kind in (LUT_RAM, FLIP_FLOPS), _amount(option) / max(left[option.kind], 1))
