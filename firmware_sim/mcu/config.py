"""Say how the firmware is built: where events come from, where code lies, how many cores share the work."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["McuConfig"]


@dataclass(frozen=True, slots=True, kw_only=True)
class McuConfig:
    """Describe one firmware; how each choice acts on time is said in ``mcu/timing.py`` (rules M1 to M6).

    - ``input``: events come by ``dma`` into a circular buffer that the loop polls, with an interrupt every half buffer;
      by ``blocks`` (double buffering: two halves, one filled while the other is worked on, handed over whole or after
      ``flush_us``); or by one ``interrupt`` an event.
    - ``input_depth``, ``output_depth``: events of 8 bytes that the buffers hold. The output leaves by DMA.
    - ``code``: the loop runs from ``ram`` without wait states, or from ``flash``.
    - ``cores``: with 2, one serves interrupts and links and the other decides.
    - ``optimisation``: of the C compiler, ``O2`` or ``Os``.
    - ``time_bits`` of a cell's stamp and ``coefficient_bits`` of the motion (32 or 64), chosen when 0.
    - ``sweep``: look at every cell in time to hide the aliases of its stamp.

    Raise ``ValueError`` with field, rule and value.
    """

    input: Literal["dma", "blocks", "interrupt"] = "dma"
    input_depth: int = 512
    output_depth: int = 512
    flush_us: int = 1000
    code: Literal["ram", "flash"] = "ram"
    cores: int = 1
    optimisation: Literal["O2", "Os"] = "O2"
    time_bits: int = 0
    coefficient_bits: int = 0
    sweep: bool = True

    def __post_init__(self) -> None:
        for name, low, high in (
            ("input_depth", 1, 1 << 20),
            ("output_depth", 1, 1 << 20),
            ("flush_us", 1, 1 << 28),
            ("cores", 1, 2),
            ("time_bits", 0, 32),
        ):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
                raise ValueError(f"{name} must be an integer from {low} to {high}, not {value!r}")
        for name, allowed in (
            ("input", ("dma", "blocks", "interrupt")),
            ("code", ("ram", "flash")),
            ("optimisation", ("O2", "Os")),
            ("coefficient_bits", (0, 32, 64)),
        ):
            if getattr(self, name) not in allowed:
                known = ", ".join(str(value) for value in allowed)
                raise ValueError(f"{name} must be one of {known}, not {getattr(self, name)!r}")
        if self.input != "interrupt" and self.input_depth % 2:
            raise ValueError(f"input_depth must be even, for halves of the buffer, not {self.input_depth}")
