"""Price the firmware's primitives: instructions by class as compiled, times a core's cycles by class."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.mcu.primitives import PRIMITIVES
from tiegocancel.firmware_sim.target_mcu import InstructionCycles, McuTarget

__all__ = ["CLASSES", "LoopTable", "class_cycles", "loop_table"]

CLASSES = (
    "alu", "load", "load_next", "store", "mul", "branch_taken", "branch_not_taken", "call", "mispredict",
)  # fmt: skip
"""Classes of instruction: the fields of :class:`InstructionCycles` of these names. ``load_next`` follows a load and
does not need its result. ``mispredict``: branches that a predictor of two bits an address gets wrong."""

_STAND_IN = "rv32imc"
_CORES = {
    "cortex-m0": "cortex-m0plus",
    "cortex-m0+": "cortex-m0plus",
    "cortex-m23": "cortex-m0plus",
    "cortex-m3": "cortex-m4",
    "cortex-m4": "cortex-m4",
    "cortex-m4f": "cortex-m4",
    "cortex-m7": "cortex-m7",
    "cortex-m7f": "cortex-m7",
    "cortex-m33": "cortex-m33",
    "cortex-m33f": "cortex-m33",
}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LoopTable:
    """What the compiler made of the loop for one core.

    ``counts`` float64[primitives, classes]; ``once``: the same float64[classes] for the handlers of an interrupt
    (``isr_event``, ``isr_half``) and for ``sweep_block``, a block of ``sweep_cells`` cells. ``code_bytes`` of the loop,
    of the plain rule and of others (the median); ``bytes_per_instruction`` on average. ``fit_share``: root mean square
    error of cycles an event for a configuration that was left out of the fit, ``fit_worst`` the largest.
    ``borrowed``: the core has no table of its own and borrows this one.
    """

    core: str
    counts: NDArray[np.float64]
    once: dict[str, NDArray[np.float64]]
    sweep_cells: int
    code_bytes_plain: int
    code_bytes: int
    bytes_per_instruction: float
    fit_share: float
    fit_worst: float
    borrowed: bool = False

    def cycles(self, table: InstructionCycles) -> NDArray[np.float64]:
        """Return cycles a primitive without wait states, float64[primitives]."""
        return self.counts @ class_cycles(table)

    def cycles_once(self, name: str, table: InstructionCycles) -> float:
        """Return cycles of a handler or of a block of the sweep."""
        return float(self.once[name] @ class_cycles(table))


def class_cycles(table: InstructionCycles) -> NDArray[np.float64]:
    """Return a core's cycles by class, float64[classes]."""
    return np.array([getattr(table, name) for name in CLASSES], np.float64)


@cache
def _tables() -> dict[str, object]:
    return tomllib.loads((files("tiegocancel.firmware_sim.mcu") / "loops.toml").read_text("utf-8"))


def loop_table(target: McuTarget, optimisation: str) -> LoopTable:
    """Return the table for a part's core; a core that none was compiled for borrows that of RV32IMC."""
    isa = target.core.isa.lower()
    name = _CORES.get(target.core.name.lower(), _STAND_IN if isa.startswith("rv32") else "")
    borrowed = not name
    data = _tables()[name or _STAND_IN][optimisation]  # type: ignore[index]
    counts = np.array([data["primitives"][one] for one in PRIMITIVES], np.float64)
    return LoopTable(
        core=name or _STAND_IN,
        counts=counts,
        once={key: np.array(value, np.float64) for key, value in data["once"].items()},
        sweep_cells=int(data["sweep_cells"]),
        code_bytes_plain=int(data["code_bytes_plain"]),
        code_bytes=int(data["code_bytes"]),
        bytes_per_instruction=float(data["bytes_per_instruction"]),
        fit_share=float(data["fit_share"]),
        fit_worst=float(data["fit_worst"]),
        borrowed=borrowed,
    )
