"""``tiegocancel targets [NAME|FILE]…``: say which parts are known, with their numbers and where these come from."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tiegocancel.firmware_sim.target import Target
    from tiegocancel.firmware_sim.target_fpga import FpgaTarget
    from tiegocancel.firmware_sim.target_mcu import McuTarget
    from tiegocancel.firmware_sim.target_memory import ExternalMemory

__all__ = ["add_parser", "run"]


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "targets",
        help="say which FPGAs, microcontrollers and memories are known",
        description="List the known parts with their key numbers; of one that is named, or of a target file of your "
        "own, every number with the document that it comes from.",
    )
    parser.add_argument(
        "target", nargs="*", metavar="NAME|FILE", help="a part of the list, or the path of a .toml file"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from tiegocancel.firmware_sim.target import load_memory, load_target, memory_names, target_names

    if args.target:
        known = set(memory_names()) - set(target_names())
        parts = [load_memory(name) if name.lower() in known else load_target(name) for name in args.target]
    else:
        parts = [*map(load_target, target_names()), *map(load_memory, memory_names())]
    if args.json:
        sys.stdout.write(json.dumps({"targets": [_facts(part) for part in parts]}, ensure_ascii=False) + "\n")
    elif args.target:
        sys.stdout.write("\n".join("".join(_details(part)) for part in parts))
    else:
        sys.stdout.writelines(_tables(parts))
    return 0


def _facts(part: Target | ExternalMemory) -> dict[str, Any]:
    """Return everything that a file says, and the source of every number by its path."""
    from tiegocancel.firmware_sim.target_source import numbers_of

    return {
        **dataclasses.asdict(part),
        "unverified": list(part.unverified),
        "numbers": [{"path": path, "value": value, "source": source} for path, value, source in numbers_of(part)],
    }


def _details(part: Target | ExternalMemory) -> list[str]:
    """Arrange one part: its numbers, grouped under the document that they share."""
    from tiegocancel.firmware_sim.target_source import numbers_of

    lines = [f"{part.name}: {part.part}\n"]
    lines += [f"  {part.notes}\n"] if part.notes else []
    groups: dict[str, list[str]] = {}
    for path, value, source in numbers_of(part):
        number = f"{value:#x}" if path.endswith(".base") else f"{value:g}" if isinstance(value, float) else str(value)
        groups.setdefault(source, []).append(f"{path} = {number}")
    for source, numbers in groups.items():
        lines.append(f"  {source}\n")
        lines += [f"    {number}\n" for number in numbers]
    return lines


def _tables(parts: list[Target | ExternalMemory]) -> list[str]:
    """Arrange the list of parts: one table a kind; a star marks a part with numbers that have no document."""
    from tiegocancel.firmware_sim.target_fpga import FpgaTarget
    from tiegocancel.firmware_sim.target_mcu import McuTarget
    from tiegocancel.firmware_sim.target_memory import ExternalMemory

    tables = (
        (_FPGA, [_fpga(part) for part in parts if isinstance(part, FpgaTarget)]),
        (_MCU, [_mcu(part) for part in parts if isinstance(part, McuTarget)]),
        (_MEMORY, [_memory(part) for part in parts if isinstance(part, ExternalMemory)]),
    )
    lines = []
    for title, rows in tables:
        widths = [max(len(cells[column]) for cells in (title, *rows)) for column in range(len(title))]
        lines += ["  ".join(map(str.ljust, cells, widths)).rstrip() + "\n" for cells in (title, *rows)]
        lines.append("\n")
    return [*lines, "* some numbers have no document: tiegocancel targets NAME says which\n"]


_FPGA = ("FPGA", "LUT", "FF", "memory blocks", "multipliers", "clock")
_MCU = ("microcontroller", "core", "clock", "RAM", "in one piece", "links", "energy")
_MEMORY = ("memory", "size", "bandwidth", "first access", "refresh")


def _name(part: Target | ExternalMemory) -> str:
    return f"{part.name} *" if part.unverified else part.name


def _fpga(part: FpgaTarget) -> tuple[str, ...]:
    return (
        _name(part),
        f"{part.logic.luts} LUT{part.logic.lut_inputs}",
        str(part.logic.ffs),
        " + ".join(f"{memory.count} {memory.name}" for memory in part.memories),
        " + ".join(f"{one.count} {one.a_bits}x{one.b_bits}" for one in part.multipliers) or "none",
        f"{part.clock.mhz:g} MHz {part.clock.basis}",
    )


def _mcu(part: McuTarget) -> tuple[str, ...]:
    return (
        _name(part),
        f"{part.core.count} x {part.core.name}" if part.core.count > 1 else part.core.name,
        f"{part.core.mhz:g} MHz",
        f"{part.ram_bytes / 1024:g} KiB",
        f"{part.largest_piece_bytes / 1024:g} KiB",
        ", ".join(f"{link.name} {link.bytes_per_second / 1e6:.3g} MB/s" for link in part.links) or "none listed",
        f"{part.energy.picojoules_per_cycle:.0f} pJ/cycle" if part.energy else "no figure",
    )


def _memory(part: ExternalMemory) -> tuple[str, ...]:
    return (
        _name(part),
        f"{part.bytes / 2**20:g} MiB",
        f"{part.peak_bytes_per_second / 1e6:.0f} MB/s",
        f"{part.access_ns(1):.0f} ns",
        f"{part.refresh_share:.1%}" if part.refresh_share else "hidden",
    )
