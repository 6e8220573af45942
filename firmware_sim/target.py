"""Find targets by name or file: the parts that ship with the package, or one of the user's own.

A target file is TOML. ``kind`` is ``fpga``, ``mcu`` or ``memory``; the other keys are the fields of
:class:`~tiegocancel.firmware_sim.target_fpga.FpgaTarget`, :class:`~tiegocancel.firmware_sim.target_mcu.McuTarget` and
:class:`~tiegocancel.firmware_sim.target_memory.ExternalMemory`. Every table of numbers has a ``source``: document,
section, table, page; ``sources.FIELD`` names another document for one field. A source that begins with ``unverified:``
marks numbers that no document was found for: ``target.unverified`` lists their paths, and reports must say so.
"""

from __future__ import annotations

import difflib
from functools import cache
from pathlib import Path

from tiegocancel.firmware_sim.target_file import read_target_file
from tiegocancel.firmware_sim.target_fpga import FpgaTarget
from tiegocancel.firmware_sim.target_mcu import McuTarget
from tiegocancel.firmware_sim.target_memory import ExternalMemory

from tiegocancel.errors import ConfigError

__all__ = ["Target", "load_memory", "load_target", "memory_names", "target_names"]

Target = FpgaTarget | McuTarget

_FOLDER = Path(__file__).parent / "targets"
_MEMORY_PREFIX = "memory-"


@cache
def target_names() -> tuple[str, ...]:
    """Return the names of the parts that ship with the package, sorted; FPGAs and microcontrollers together."""
    return tuple(name for name in _stems() if not name.startswith(_MEMORY_PREFIX))


@cache
def memory_names() -> tuple[str, ...]:
    """Return the names of the external memories that ship with the package, sorted."""
    return tuple(name.removeprefix(_MEMORY_PREFIX) for name in _stems() if name.startswith(_MEMORY_PREFIX))


def load_target(name_or_path: str | Path) -> Target:
    """Load a part by its name (any case), or from a file: what ends in ``.toml`` or has a folder in it is a path.

    Raise :class:`ConfigError` in one line for an unknown name (with the nearest one) and for a fault in the file.
    """
    path = _find(name_or_path, target_names(), "", "target")
    return read_target_file(path, {"fpga": FpgaTarget, "mcu": McuTarget})


def load_memory(name_or_path: str | Path) -> ExternalMemory:
    """Load an external memory by its name or from a file, as :func:`load_target` does."""
    path = _find(name_or_path, memory_names(), _MEMORY_PREFIX, "memory")
    return read_target_file(path, {"memory": ExternalMemory})


def _stems() -> list[str]:
    return sorted(path.stem for path in _FOLDER.glob("*.toml"))


def _find(name_or_path: str | Path, names: tuple[str, ...], prefix: str, noun: str) -> Path:
    """Return the file that a name or a path means."""
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or text.endswith(".toml") or "/" in text or "\\" in text:
        return Path(text)
    if text.lower() in names:
        return _FOLDER / f"{prefix}{text.lower()}.toml"
    near = difflib.get_close_matches(text.lower(), names, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(names)}; or the path of a .toml file"
    raise ConfigError(f"unknown {noun} {text!r}; {hint}")
