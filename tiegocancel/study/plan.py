"""Search operating points for a recording: selectivity against memory and work."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from tiegocancel.events import Events
from tiegocancel.interrupt import deferred_interrupt
from tiegocancel.matching.config import CancelConfig
from tiegocancel.study.plan_candidates import Proposal, grid, neighbour
from tiegocancel.study.plan_result import PlanLimits, PlanResult, front_of
from tiegocancel.study.plan_stretch import Ground, lay_out
from tiegocancel.study.plan_trial import Bound, Trial
from tiegocancel.study.settings import Settings

__all__ = ["REFERENCES", "PlanConfig", "plan_stream", "search"]

REFERENCES = {
    "thesis (2 ms)": CancelConfig(horizon_us=2000, tolerance_us=1000, tolerance_px=2.0),
    "default": CancelConfig(),
}
"""Operating points beside the search: the thesis's, and what ``run`` does unless told."""

_GRID_SHARE = 0.6
_PREFIX_SLACK = 0.08
"""Score that a trial may still gain after the first look."""
_FRONT_DEPTH = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanConfig:
    """Bound a search: ``budget`` operating points are tried; ``seed`` draws the ones beyond the grid."""

    budget: int = 60
    seed: int = 0
    limits: PlanLimits = field(default_factory=PlanLimits)

    def __post_init__(self) -> None:
        if not 1 <= self.budget <= 10_000:
            raise ValueError(f"budget must be from 1 to 10000, not {self.budget}")
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, not {self.seed}")


def plan_stream(
    chunks: Callable[[], Iterable[Events]],
    settings: Settings,
    config: PlanConfig,
    *,
    width: int,
    height: int,
    progress: Callable[[Events], None] | None = None,
) -> PlanResult | None:
    """Search on the densest stretch of a stream, ``None`` for one without events; see :func:`lay_out` for the rest."""
    ground = lay_out(chunks, settings, width=width, height=height)
    return None if ground is None else search(ground, config, progress=progress)


def search(ground: Ground, config: PlanConfig, *, progress: Callable[[Events], None] | None = None) -> PlanResult:
    """Try the grid, then neighbours of the front; the same ground, budget and seed give the same result.

    A trial is given up when another, no larger and with no more reads, already scores what it cannot reach: after a
    third of the counted events by :data:`_PREFIX_SLACK`, after the true motion for certain. Ctrl-C ends the search.
    """
    found = _Search(ground, config)
    interrupted = False
    with deferred_interrupt() as interrupt:
        found.run_references()
        for proposal in itertools.chain(found.from_grid(), found.around()):
            interrupted = interrupt.wanted
            if interrupted or found.tried >= config.budget:
                break
            if found.run(proposal) and progress is not None:
                progress(ground.course.events)
    return found.result(interrupted=interrupted)


class _Search:
    """Hold what was tried."""

    def __init__(self, ground: Ground, config: PlanConfig) -> None:
        self.tried = self._dropped = self._cold = 0
        self._ground, self._config = ground, config
        self._trials: list[Trial] = []
        self._references: list[Trial] = []
        self._notes = list(ground.notes)
        self._seen: set[CancelConfig] = set()
        self._origins: dict[str, Proposal] = {}

    def from_grid(self) -> Iterator[Proposal]:
        """Yield the grid until its share of the budget was tried; what the stretch is too short for does not count."""
        share = max(round(_GRID_SHARE * self._config.budget), 1)
        for proposal in grid():
            if self.tried >= share:
                return
            yield proposal

    def run_references(self) -> None:
        """Try the operating points that stand beside the search."""
        for name, config in REFERENCES.items():
            if not self._ground.course.serves(config):
                self._notes.append(
                    f"{name}: its warm-up of {config.warm_up_us / 1000:g} ms is too long for the stretch"
                )
                continue
            trial = self._ground.course.run(name, config)
            if trial is not None:
                self._references.append(trial)

    def run(self, proposal: Proposal) -> bool:
        """Try a proposal, unless it is known, contradicts itself or is not warm in time; tell whether it was tried."""
        try:
            config = proposal.config(self._ground.pace)
        except ValueError:  # as where gate and horizon come to the same tick
            return False
        if config in self._seen:
            return False
        self._seen.add(config)
        if not self._ground.course.serves(config):
            self._cold += 1
            return False
        self.tried += 1
        name = f"c{self.tried:03d}"
        trial = self._ground.course.run(name, config, hopeless=self._hopeless)
        if trial is None:
            self._dropped += 1
        else:
            self._trials.append(trial)
            self._origins[name] = proposal
        return True

    def around(self) -> Iterator[Proposal]:
        """Yield neighbours of the fronts so far, as long as draws lead anywhere; within the limits, if anything is."""
        rng = np.random.default_rng(self._config.seed)
        for _ in range(50 * self._config.budget):
            allowed = [trial for trial in self._trials if self._config.limits.allow(trial)] or self._trials
            if not allowed:
                return
            # One front for each bound of reads, so that cheap ones are followed too.
            most = int(rng.choice(sorted({trial.reads for trial in allowed})))
            front = front_of([trial for trial in allowed if trial.reads <= most])
            # What scores far below the best is seldom worth its memory, however little that is.
            good = [trial for trial in front if trial.score >= front[-1].score - _FRONT_DEPTH]
            yield neighbour(self._origins[good[int(rng.integers(len(good)))].name], rng)

    def result(self, *, interrupted: bool) -> PlanResult:
        """Return what was found."""
        if self._cold:
            self._notes.append(f"{self._cold} operating points left out: the stretch is too short for their warm-up")
        return PlanResult(
            trials=tuple(self._trials),
            references=tuple(self._references),
            limits=self._config.limits,
            pace=self._ground.pace,
            dropped=self._dropped,
            cold=self._cold,
            injected=self._ground.injected,
            notes=tuple(self._notes),
            interrupted=interrupted,
        )

    def _hopeless(self, bound: Bound) -> bool:
        reach = bound.margin + (0.0 if bound.whole else _PREFIX_SLACK)
        return any(t.kib <= bound.kib and t.reads <= bound.reads and t.score >= reach for t in self._trials)
