"""Order what a search of operating points found: the front, its knee, the choice within limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from tiegocancel.study.plan_candidates import Pace
from tiegocancel.study.plan_trial import Trial

__all__ = ["PlanLimits", "PlanResult", "front_of", "knee_of"]

NEAR_BEST = 0.02
"""Score that is given away for less memory in the row "smallest"."""

_LAMP_PERIODS_US = (10_000.0, 1e6 / 120.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanLimits:
    """Bound the choice; ``None`` bounds nothing. ``max_loss`` is of mover events, a share.

    ``target_kib`` is the RAM of the part ``target``, and bounds memory as ``max_kib`` does.
    """

    max_kib: float | None = None
    max_loss: float | None = None
    max_reads: int | None = None
    target: str | None = None
    target_kib: float | None = None

    def __post_init__(self) -> None:
        for name in ("max_kib", "max_reads", "target_kib"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"{name} must be positive, not {value!r}")
        if self.max_loss is not None and not 0.0 <= self.max_loss <= 1.0:
            raise ValueError(f"max_loss must be from 0 to 1, not {self.max_loss!r}")

    @property
    def most_kib(self) -> float | None:
        """The tighter of the two bounds of memory, ``None`` where there is none."""
        return min((bound for bound in (self.max_kib, self.target_kib) if bound is not None), default=None)

    def allow(self, trial: Trial) -> bool:
        """Tell whether a trial keeps within all limits."""
        return (
            (self.most_kib is None or trial.kib <= self.most_kib)
            and (self.max_loss is None or trial.mover <= self.max_loss)
            and (self.max_reads is None or trial.reads <= self.max_reads)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanResult:
    """Everything that a search found.

    ``trials`` of the search, ``references`` beside them (the thesis's operating point first, then today's default);
    ``dropped`` were given up early, ``cold`` not tried because the stretch is too short for their warm-up.
    """

    trials: tuple[Trial, ...]
    references: tuple[Trial, ...]
    limits: PlanLimits
    pace: Pace
    dropped: int
    cold: int
    injected: bool
    notes: tuple[str, ...] = ()
    interrupted: bool = False

    @property
    def front(self) -> list[Trial]:
        """The trials that no smaller one equals in score, smallest first."""
        return front_of(self.trials)

    @property
    def knee(self) -> Trial | None:
        """Where the front stops being worth its memory."""
        return knee_of(self.front)

    @property
    def chosen(self) -> Trial | None:
        """The best score within the limits, of equal ones the smallest; ``None`` where none keeps within them."""
        allowed = [trial for trial in self.trials if self.limits.allow(trial)]
        return max(allowed, key=lambda trial: (round(trial.score, 4), -trial.kib), default=None)

    @property
    def smallest(self) -> Trial | None:
        """The least memory within :data:`NEAR_BEST` of the choice, within the limits."""
        chosen = self.chosen
        if chosen is None:
            return None
        near = [t for t in self.trials if self.limits.allow(t) and t.score >= chosen.score - NEAR_BEST]
        return min(near, key=lambda trial: trial.kib)

    def rows(self) -> list[tuple[str, Trial]]:
        """Return the table's rows that there are, with what each is."""
        named = [("chosen", self.chosen), (f"smallest within {NEAR_BEST:g}", self.smallest), ("knee", self.knee)]
        rows = [(name, trial) for name, trial in named if trial is not None]
        return rows + [(trial.name, trial) for trial in self.references]

    def text(self) -> str:
        """Return the table for a terminal."""
        lines = [
            f"{'':<22}{'ego':>7}{'mover':>7}{'zero':>7}{'rev.':>7}{'J':>7}{'score':>7}{'KiB':>8}{'reads':>7}"
            f"{'horizon (ms)':>14}"
        ]
        for name, trial in self.rows():
            shares = (trial.ego, trial.mover, trial.zero, trial.reversed, trial.selectivity, trial.score)
            horizons = " + ".join(f"{horizon_us / 1000:g}" for horizon_us in trial.config.horizons_us)
            numbers = "".join(f"{share:7.3f}" for share in shares)
            lines.append(f"{name:<22}{numbers}{trial.kib:8.0f}{trial.reads:7d}{horizons:>14}")
        return "\n".join(lines) + "\n"

    def flicker_note(self) -> str | None:
        """Warn of a horizon whose gate holds a period of mains light: a cell that is never emptied follows lamps."""
        chosen = self.chosen
        if chosen is None:
            return None
        for horizon_us in chosen.config.horizons_us:
            for period_us in _LAMP_PERIODS_US:
                nearest = max(round(horizon_us / period_us), 1) * period_us
                if -chosen.config.early_gate_us <= nearest - horizon_us <= chosen.config.late_gate_us:
                    return (
                        f"the gate of the horizon of {horizon_us / 1000:g} ms holds {nearest / 1000:.1f} ms, a period "
                        "of lamps on mains: under such light filter flicker first (--flicker-periods)"
                    )
        return None

    def to_json(self) -> dict[str, Any]:
        """Return everything as JSON holds it."""
        named = {"chosen": self.chosen, "smallest": self.smallest, "knee": self.knee}
        return {
            **{name: None if trial is None else trial.to_json() for name, trial in named.items()},
            "references": [trial.to_json() for trial in self.references],
            "front": [trial.name for trial in self.front],
            "trials": [trial.to_json() for trial in self.trials],
            "limits": asdict(self.limits),
            "us_per_px": self.pace.us_per_px,
            "rate_hz": self.pace.rate_hz,
            "dropped": self.dropped,
            "cold": self.cold,
            "injected": self.injected,
            "interrupted": self.interrupted,
            "notes": list(self.notes),
        }


def front_of(trials: Sequence[Trial]) -> list[Trial]:
    """Return the Pareto front of score against memory, smallest first: along it both rise strictly."""
    front: list[Trial] = []
    for trial in sorted(trials, key=lambda trial: (trial.kib, -trial.score)):
        if not front or trial.score > front[-1].score:
            front.append(trial)
    return front


def knee_of(front: Sequence[Trial]) -> Trial | None:
    """Return the point farthest above the line between the front's ends, score against the logarithm of memory."""
    if not front:
        return None
    first, last = front[0], front[-1]
    octaves, gain = math.log2(last.kib / first.kib), last.score - first.score
    if octaves <= 0.0 or gain <= 0.0:
        return last
    return max(front, key=lambda trial: (trial.score - first.score) / gain - math.log2(trial.kib / first.kib) / octaves)
