"""Hold the verdict on one device: every constraint with its margin, the one that binds, and what it rests on."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any

from tiegocancel.firmware_sim.constraint import Constraint, binding
from tiegocancel.firmware_sim.measure import Distribution
from tiegocancel.firmware_sim.outcome import Outcome

__all__ = ["Verdict"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Verdict:
    """Say whether a device fits, keeps up, and why not.

    ``design``: the micro-architecture or firmware in words; ``memory`` and ``logic``: rows for people;
    ``utilisation``: share of cycles that each port or unit is busy; ``energy``: in words; ``burst_events``: how many
    may come at once, ∞ for any number; ``remarks``: what the numbers rest on. ``outcome`` is ``None`` where the design
    could not be simulated.
    """

    target: str
    kind: str
    design: str
    clock_hz: float
    constraints: list[Constraint]
    outcome: Outcome | None
    memory: list[dict[str, Any]] = field(default_factory=list)
    logic: dict[str, Any] = field(default_factory=dict)
    utilisation: dict[str, float] = field(default_factory=dict)
    link: dict[str, Any] = field(default_factory=dict)
    energy: str = "no figure"
    burst_events: float = math.nan
    startup_us: float = 0.0
    remarks: list[str] = field(default_factory=list)

    @property
    def fits(self) -> bool:
        """Tell whether the part holds the design."""
        return all(one.ok for one in self.constraints if one.kind == "fit")

    @property
    def keeps_up(self) -> bool:
        """Tell whether it takes the events as they come."""
        return self.outcome is not None and all(one.ok for one in self.constraints if one.kind == "pace")

    @property
    def passes(self) -> bool:
        """Tell both."""
        return self.fits and self.keeps_up

    @property
    def binding(self) -> Constraint:
        """The constraint with the least margin."""
        return binding(self.constraints)

    def to_json(self) -> dict[str, Any]:
        """Return it for machines."""
        outcome = self.outcome
        numbers: dict[str, Any] = {
            "name": self.target,
            "kind": self.kind,
            "design": self.design,
            "clock_hz": self.clock_hz,
            "fits": self.fits,
            "keeps_up": self.keeps_up,
            "binding": self.binding.name,
            "constraints": [
                {**asdict(one), "margin": one.margin, "ok": one.ok, "verdict": one.verdict} for one in self.constraints
            ],
            "memory": self.memory,
            "logic": self.logic,
            "utilisation": self.utilisation,
            "link": self.link,
            "energy": self.energy,
            "startup_us": self.startup_us,
            "remarks": self.remarks,
        }
        if outcome is None:
            return numbers
        return numbers | {
            "cycles_per_event": _plain(outcome.pace),
            "latency_ns": _plain(outcome.latency_ns),
            "latency_cycles": _plain(outcome.gauge.latency()),
            "stages_cycles": {name: _plain(one) for name, one in outcome.gauge.stages().items()},
            "stalls_cycles": outcome.waited,
            "work": outcome.work,
            "counters": outcome.counts,
            "drops": outcome.drops,
            "lost_at_sensor": outcome.lost,
            "max_events_per_second": outcome.max_events_per_second,
            "burst_events": self.burst_events if math.isfinite(self.burst_events) else None,
            "input_fifo_high_water": outcome.gauge.input_level().high_water,
            "output_fifo_high_water": outcome.gauge.output_level().high_water,
        }


def _plain(one: Distribution) -> dict[str, float | None]:
    """Return a distribution as JSON has it: no NaN."""
    names = {"least": "min", "mean": "mean", "p50": "p50", "p99": "p99", "most": "max"}
    return {
        names[name]: (value if math.isfinite(value) else None)
        for name, value in ((name, getattr(one, name)) for name in names)
    }
