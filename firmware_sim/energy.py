"""Energy an event, where a document gives a figure for the part; otherwise say that there is none.

A microcontroller's figure is the current of the running core by its clock times the supply: pJ a cycle, all of the
chip included, peripherals idle. Cycles an event times that is the energy of computing; links and sensor are not in it.
No document gives an FPGA's energy an event of such a core: static power, where a file has it, is said and no more.
"""

from __future__ import annotations

from dataclasses import dataclass

from tiegocancel.firmware_sim.target import Target
from tiegocancel.firmware_sim.target_mcu import McuTarget

__all__ = ["NO_FIGURE", "EnergyEstimate", "estimate_energy"]

NO_FIGURE = "no figure"


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyEstimate:
    """Energy of one event in nJ, ``None`` where no document gives a figure; ``source`` says which, or why not.

    ``milliwatts``: average power at the event rate asked for, ``None`` likewise or where none was asked for.
    """

    nanojoules_per_event: float | None
    milliwatts: float | None
    source: str

    @property
    def text(self) -> str:
        """The figure for people, or ``no figure``."""
        if self.nanojoules_per_event is None:
            return NO_FIGURE
        return f"{self.nanojoules_per_event:.3g} nJ/event"


def estimate_energy(
    target: Target, *, cycles_per_event: float, events_per_second: float | None = None
) -> EnergyEstimate:
    """Return the energy that ``target`` spends on an event of ``cycles_per_event`` core cycles, if a figure exists."""
    for name, value in (("cycles_per_event", cycles_per_event), ("events_per_second", events_per_second)):
        if value is not None and value < 0:
            raise ValueError(f"{name} must not be negative, not {value}")
    if isinstance(target, McuTarget):
        if target.energy is None:
            return _none(f"no document gives the current of the {target.part} by its clock")
        nanojoules = cycles_per_event * target.energy.picojoules_per_cycle * 1e-3
        return EnergyEstimate(
            nanojoules_per_event=nanojoules,
            milliwatts=None if events_per_second is None else nanojoules * events_per_second * 1e-6,
            source=target.energy.source,
        )
    static = target.energy.static_milliwatts if target.energy else None
    known = f"; static power {static:g} mW: {target.energy.source}" if target.energy else ""
    return _none(f"no document gives the energy an event of such a core on the {target.part}{known}")


def _none(reason: str) -> EnergyEstimate:
    return EnergyEstimate(nanojoules_per_event=None, milliwatts=None, source=f"{NO_FIGURE}: {reason}")
