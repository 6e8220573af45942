"""A microcontroller as the simulator sees it: cores, cycles an instruction, memories, links."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tiegocancel.firmware_sim.target_link import Link
from tiegocancel.firmware_sim.target_source import Sourced, unverified_of

__all__ = ["Cache", "Core", "Flash", "InstructionCycles", "McuEnergy", "McuTarget", "RamBank"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Core(Sourced):
    """The processor: its name, instruction set, how many of them, and the greatest clock.

    ``issue_width``: instructions that can begin in one cycle at best; 2 on a dual-issue core, where no table of cycles
    tells the whole and a model by class is an upper bound.
    """

    name: str
    isa: str
    count: int
    mhz: float
    issue_width: int = 1

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        for name in ("count", "mhz", "issue_width"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class InstructionCycles(Sourced):
    """Cycles by class of instruction with memory of no wait states; ``load`` includes its use by the next one.

    ``load_next``: each further load of a run of independent ones. ``branch_taken``, ``branch_not_taken``: predicted
    rightly where the core predicts; ``mispredict``: what a wrong prediction costs on top, 0 where the core does not
    predict. ``call``: branch with link. ``div_min``, ``div_max``: 0 where there is no divider or no figure.
    ``exception_entry``: from the request of an interrupt to its first instruction, 0 where there is no figure.
    """

    alu: float
    load: float
    load_next: float
    store: float
    mul: float
    branch_taken: float
    branch_not_taken: float
    call: float
    div_min: float = 0
    div_max: float = 0
    mispredict: float = 0
    exception_entry: float = 0

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        for name in ("alu", "load", "load_next", "store", "mul", "branch_taken", "branch_not_taken", "call"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)}")
        if self.mispredict < 0 or self.exception_entry < 0:
            raise ValueError("mispredict and exception_entry must not be negative")
        if not 0 <= self.div_min <= self.div_max:
            raise ValueError(f"div_min must be from 0 to div_max = {self.div_max}, not {self.div_min}")


@dataclass(frozen=True, slots=True, kw_only=True)
class RamBank(Sourced):
    """One bank of RAM. Banks that touch in address (``base + bytes`` = next ``base``) can hold one array together.

    ``wait_cycles``: cycles that a data access of the core takes beyond the table of instruction cycles, without a
    cache. ``dma``: the DMA controllers reach it. ``cached``: the core's data cache serves it.
    """

    name: str
    base: int
    bytes: int
    wait_cycles: int
    dma: bool
    cached: bool = False

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        if self.base < 0 or self.wait_cycles < 0:
            raise ValueError(f"base and wait_cycles must not be negative, not {self.base} and {self.wait_cycles}")
        if self.bytes <= 0:
            raise ValueError(f"bytes must be positive, not {self.bytes}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Flash(Sourced):
    """Where code lives: ``wait_states`` a fetch at the core's full clock, ``fetch_bits`` a fetch.

    ``bytes``: on the chip, 0 where code runs from an external flash through a cache. ``prefetch``: the controller reads
    ahead. ``accelerator``: its own cache of lines, in words; ``accelerator_bytes`` of instructions it holds.
    """

    bytes: int
    wait_states: int
    fetch_bits: int
    prefetch: bool
    accelerator: str = ""
    accelerator_bytes: int = 0

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        for name in ("bytes", "wait_states", "accelerator_bytes"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, not {getattr(self, name)}")
        if self.fetch_bits <= 0:
            raise ValueError(f"fetch_bits must be positive, not {self.fetch_bits}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Cache(Sourced):
    """A cache: what it serves, its size, line and ways."""

    name: str
    serves: Literal["instructions", "data", "both"]
    bytes: int
    line_bytes: int
    ways: int

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        for name in ("bytes", "line_bytes", "ways"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)}")
        if self.bytes % (self.line_bytes * self.ways):
            raise ValueError(f"bytes must be a multiple of line_bytes · ways, not {self.bytes}")


@dataclass(frozen=True, slots=True, kw_only=True)
class McuEnergy(Sourced):
    """Current of the running core by its clock, at a supply: the datasheet's figure, all of the chip included."""

    microamps_per_mhz: float
    volts: float

    def __post_init__(self) -> None:
        Sourced.__post_init__(self)
        for name in ("microamps_per_mhz", "volts"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)}")

    @property
    def picojoules_per_cycle(self) -> float:
        """µA/MHz · V = pJ a cycle."""
        return self.microamps_per_mhz * self.volts


@dataclass(frozen=True, slots=True, kw_only=True)
class McuTarget:
    """A microcontroller: see the tables' classes for their fields. ``notes``: facts that are no numbers."""

    name: str
    part: str
    vendor: str
    core: Core
    cycles: InstructionCycles
    ram: tuple[RamBank, ...]
    flash: Flash
    caches: tuple[Cache, ...] = ()
    links: tuple[Link, ...] = ()
    energy: McuEnergy | None = None
    notes: str = ""
    kind: Literal["mcu"] = "mcu"

    def __post_init__(self) -> None:
        if not self.ram:
            raise ValueError("ram needs at least one bank")
        for table, names in (
            ("ram", [bank.name for bank in self.ram]),
            ("caches", [cache.name for cache in self.caches]),
            ("links", [link.name for link in self.links]),
        ):
            if len(set(names)) < len(names):
                raise ValueError(f"{table} must have distinct names, not {names}")
        for before, after in zip(self.banks, self.banks[1:], strict=False):
            if before.base + before.bytes > after.base:
                raise ValueError(f"ram banks {before.name!r} and {after.name!r} overlap at {after.base:#x}")

    @property
    def banks(self) -> tuple[RamBank, ...]:
        """The RAM banks by address."""
        return tuple(sorted(self.ram, key=lambda bank: bank.base))

    @property
    def ram_bytes(self) -> int:
        """All RAM together."""
        return sum(bank.bytes for bank in self.ram)

    @property
    def largest_piece_bytes(self) -> int:
        """The largest array that fits: banks that touch, together."""
        largest, run, stop = 0, 0, -1
        for bank in self.banks:
            run = run + bank.bytes if bank.base == stop else bank.bytes
            stop = bank.base + bank.bytes
            largest = max(largest, run)
        return largest

    @property
    def clock_mhz(self) -> float:
        """The greatest clock of the core."""
        return self.core.mhz

    @property
    def unverified(self) -> tuple[str, ...]:
        """Paths of the numbers without a document."""
        return unverified_of(self)
