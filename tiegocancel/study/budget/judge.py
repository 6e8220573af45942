"""Judge every part of a list on one ground."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.simulator import narrowed
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.target import Target, load_memory
from tiegocancel.firmware_sim.verdict import Verdict
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.study.budget.changes import Tried, search_changes
from tiegocancel.study.budget.ground import Cancelled, Ground
from tiegocancel.study.budget.settings import BudgetSettings
from tiegocancel.study.budget.subject import Subject, offer_of

__all__ = ["Judged", "judge_target"]


@dataclass(frozen=True, slots=True)
class Judged:
    """The verdict on one part, what it cancels, and the changes that would let it pass.

    ``ideal``: what an unlimited device cancels with the same configuration. ``equal``: whether every decision equals
    the golden model's on the events that were not dropped; ``None`` where nothing could be simulated.
    ``changes_simulated``: −1 where none were looked for.
    """

    target: Target
    cancel: CancelConfig
    verdict: Verdict
    cancelled: Cancelled | None
    ideal: Cancelled
    equal: bool | None
    changes: list[Tried] = field(default_factory=list)
    changes_simulated: int = -1

    def to_json(self) -> dict[str, Any]:
        """Return it for machines."""
        return self.verdict.to_json() | {
            "decisions_equal_golden": self.equal,
            "cancelled": _shares(self.cancelled),
            "cancelled_without_limits": _shares(self.ideal),
            "unverified": list(self.target.unverified),
            "changes_simulated": self.changes_simulated,
            "changes": [
                {
                    "name": one.name,
                    "design": one.verdict.design,
                    "cancelled": _shares(one.cancelled),
                    "loss": one.loss,
                    "binding": one.verdict.binding.name,
                    "margin": one.verdict.binding.margin,
                }
                for one in self.changes
            ],
        }


def judge_target(
    ground: Ground,
    target: Target,
    cancel: CancelConfig,
    core: CoreConfig,
    settings: BudgetSettings,
    *,
    mcu: McuConfig | None = None,
    progress: Callable[[str], None] | None = None,
) -> Judged:
    """Simulate a part on the ground, compare its decisions with the golden model, and look for changes on a fail."""
    say = progress or (lambda _: None)
    subject = Subject(
        ground,
        cancel,
        core,
        offer_of(settings, target),
        settings.clock_mhz * 1e6,
        settings.architecture == "fixed",
        mcu=mcu if settings.architecture == "fixed" else None,
        external=load_memory(settings.external_memory) if settings.external_memory else None,
    )
    say(f"{target.name}: simulating")
    verdict = subject.judge(target)
    known: dict[int, Cancelled] = {}

    def ideal(there: Ground) -> Cancelled:
        if id(there) not in known:
            known[id(there)] = there.cancelled(_golden(there, cancel, core), cancel)
        return known[id(there)]

    outcome = verdict.outcome
    cancelled, equal = None, None
    if outcome is not None:
        cancelled = ground.cancelled(outcome.suppressed, cancel)
        kept = outcome.kept
        expected = _golden(replace(ground, events=ground.events.select(kept)), cancel, core)
        equal = bool((expected == outcome.suppressed[kept]).all())
    found: list[Tried] = []
    simulated = -1  # not looked for
    if settings.changes and not verdict.passes:
        say(f"{target.name}: looking for changes")
        found, simulated = search_changes(subject, target, verdict, ideal, most=settings.most_changes)
    return Judged(target, cancel, verdict, cancelled, ideal(ground), equal, found, simulated)


def _golden(ground: Ground, cancel: CancelConfig, core: CoreConfig) -> Any:
    """Return the golden model's decisions, with the motion as wide as the core has it."""
    events = ground.events
    motion = tuple(narrowed(one, core.coefficient_fraction_bits) for one in ground.motion(cancel))
    return Canceller(cancel, motion, width=events.width, height=events.height).process(events).suppressed


def _shares(one: Cancelled | None) -> dict[str, float | None] | None:
    if one is None:
        return None
    return {"ratio": one.ratio, "ego": one.ego, "mover": one.mover, "selectivity": one.selectivity}
