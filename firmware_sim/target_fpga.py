"""An FPGA as the simulator sees it: logic, memory blocks, multipliers, clocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tiegocancel.firmware_sim.target_link import Link
from tiegocancel.firmware_sim.target_source import Sourced, unverified_of

__all__ = ["BlockRam", "Clock", "FpgaEnergy", "FpgaTarget", "Logic", "LutRam", "Multiplier", "Usable"]

Mode = tuple[int, int]
"""Words and bits a word of one configuration of a memory block."""

ClockBasis = Literal["pnr-extracted", "pnr-advisory", "typical", "datasheet"]
"""How far to trust a clock: routed with extracted timing; routed, timing doubtful; what designs reach; a limit."""


def _positive(**values: float) -> None:
    """Refuse what must be above zero."""
    for name, value in values.items():
        if not value > 0:
            raise ValueError(f"{name} must be positive, not {value}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Logic(Sourced):
    """Look-up tables (``lut_inputs`` inputs each) and flip-flops of the whole part.

    ``lut_factor``: LUTs that a matching core takes here for one on an ECP5.
    """

    luts: int
    lut_inputs: int
    ffs: int
    lut_factor: float = 1.0

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        _positive(luts=self.luts, lut_inputs=self.lut_inputs, ffs=self.ffs, lut_factor=self.lut_factor)


@dataclass(frozen=True, slots=True, kw_only=True)
class LutRam(Sourced):
    """RAM made of LUTs: ``words`` × ``width_bits`` with one write and one read port costs ``luts``.

    ``share``: part of all LUTs that can serve so.
    """

    words: int
    width_bits: int
    luts: int
    share: float

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        _positive(words=self.words, width_bits=self.width_bits, luts=self.luts)
        if not 0 < self.share <= 1:
            raise ValueError(f"share must be above 0 and at most 1, not {self.share}")


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockRam(Sourced):
    """One kind of memory block: how many, and what one can be.

    ``single``, ``simple_dual``, ``true_dual``: its modes as (words, bits a word) with one shared port, with one read
    and one write port, with two ports that each read or write; empty where it has none. ``large``: SPRAM, URAM, LRAM,
    meant for big memories. ``init``: contents can be set by the bitstream; otherwise the core must clear it.
    ``read_latency_cycles``: clock edges from address to data, without the optional output register.
    ``lane_bits``: the fewest neighbouring bits that a write can change alone, 0: only a whole word; rows of a memory
    can share a block by it. ``worth_luts``: what synthesis takes one block to be worth when it chooses.
    """

    name: str
    count: int
    bits: int
    worth_luts: float
    large: bool
    init: bool
    single: tuple[Mode, ...] = ()
    simple_dual: tuple[Mode, ...] = ()
    true_dual: tuple[Mode, ...] = ()
    lane_bits: int = 0
    read_latency_cycles: int = 1

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        _positive(count=self.count, bits=self.bits, read_latency_cycles=self.read_latency_cycles)
        _positive(worth_luts=self.worth_luts)
        if self.lane_bits < 0:
            raise ValueError(f"lane_bits must not be negative, not {self.lane_bits}")
        modes = self.single + self.simple_dual + self.true_dual
        if not modes:
            raise ValueError("give at least one mode in single, simple_dual or true_dual")
        for words, width in modes:
            if words < 1 or width < 1 or words * width > self.bits:
                raise ValueError(f"mode [{words}, {width}] must be positive and hold at most bits = {self.bits}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Multiplier(Sourced):
    """One kind of multiplier: how many signed ``a_bits`` × ``b_bits`` products the part can form at once."""

    name: str
    count: int
    a_bits: int
    b_bits: int

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        _positive(count=self.count, a_bits=self.a_bits, b_bits=self.b_bits)


@dataclass(frozen=True, slots=True, kw_only=True)
class Usable(Sourced):
    """Fractions of each resource that a design may fill and still close timing."""

    luts: float
    ffs: float
    block_ram: float
    large_ram: float
    multipliers: float

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        for name in ("luts", "ffs", "block_ram", "large_ram", "multipliers"):
            if not 0 < getattr(self, name) <= 1:
                raise ValueError(f"{name} must be above 0 and at most 1, not {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock(Sourced):
    """A clock that the core is taken to reach in a speed ``grade``, and how far to trust it."""

    grade: str
    mhz: float
    basis: ClockBasis

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        _positive(mhz=self.mhz)


@dataclass(frozen=True, slots=True, kw_only=True)
class FpgaEnergy(Sourced):
    """Static power of the part; no sourced figure an event exists, so nothing dynamic is claimed."""

    static_milliwatts: float

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        _positive(static_milliwatts=self.static_milliwatts)


@dataclass(frozen=True, slots=True, kw_only=True)
class FpgaTarget:
    """An FPGA: see the tables' classes for their fields.

    ``clocks``: the first one is what verdicts use. ``memories``: every kind of block RAM, large ones included.
    ``links``: what a board adds; the bare part has none. ``notes``: facts that are no numbers.
    """

    name: str
    part: str
    vendor: str
    logic: Logic
    usable: Usable
    clocks: tuple[Clock, ...]
    memories: tuple[BlockRam, ...]
    multipliers: tuple[Multiplier, ...] = ()
    lut_ram: LutRam | None = None
    energy: FpgaEnergy | None = None
    links: tuple[Link, ...] = ()
    notes: str = ""
    kind: Literal["fpga"] = "fpga"

    def __post_init__(self) -> None:
        if not self.clocks:
            raise ValueError("clocks needs at least one entry")
        for table, names in (
            ("clocks", [clock.grade for clock in self.clocks]),
            ("memories", [memory.name for memory in self.memories]),
            ("multipliers", [multiplier.name for multiplier in self.multipliers]),
        ):
            if len(set(names)) < len(names):
                raise ValueError(f"{table} must have distinct names, not {names}")

    @property
    def clock(self) -> Clock:
        """The clock that verdicts use."""
        return self.clocks[0]

    @property
    def clock_mhz(self) -> float:
        """Its frequency."""
        return self.clocks[0].mhz

    @property
    def multiplier_count(self) -> int:
        """All multipliers together."""
        return sum(multiplier.count for multiplier in self.multipliers)

    @property
    def unverified(self) -> tuple[str, ...]:
        """Paths of the numbers without a document."""
        return unverified_of(self)
