"""Hold the events that parts are judged on, their motion at any horizon, and what is cancelled of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import EGO, MOVER, Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.study.feed import MotionFeed

__all__ = ["Cancelled", "Ground", "gather"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cancelled:
    """Shares of the events after the warm-up; dropped ones count as not cancelled.

    ``ego`` and ``mover`` are ``None`` where events carry no labels.
    """

    ratio: float
    ego: float | None = None
    mover: float | None = None

    @property
    def selectivity(self) -> float | None:
        """``J``: share of ego events suppressed − share of mover events suppressed."""
        return None if self.ego is None or self.mover is None else self.ego - self.mover

    @property
    def worth(self) -> float:
        """What a change is measured by: ``J`` where there are labels, the ratio otherwise."""
        return self.ratio if self.selectivity is None else self.selectivity


@dataclass(slots=True)
class Ground:
    """Events of one stretch and a feed of their motion; ``origin`` is where a region of interest begins, in px."""

    events: Events
    feed: MotionFeed
    step_us: int
    origin: tuple[int, int] = (0, 0)
    _known: dict[tuple[int, ...], Schedules] = field(default_factory=dict)
    _middle: Ground | None = None

    def motion(self, cancel: CancelConfig) -> Schedules:
        """Return a schedule for each horizon."""
        if cancel.horizons_us not in self._known:
            start_us, stop_us = int(self.events.t[0]), int(self.events.t[-1])
            made = [
                self.feed.schedule(horizon_us, start_us=start_us, stop_us=stop_us, step_us=self.step_us)
                for horizon_us in cancel.horizons_us
            ]
            self._known[cancel.horizons_us] = tuple(shifted(one, *self.origin) for one in made)
        return self._known[cancel.horizons_us]

    def middle(self) -> Ground:
        """Return the middle half of the sensor in each direction, in coordinates of its own."""
        if self._middle is None:
            self._middle = self._cut_middle()
        return self._middle

    def _cut_middle(self) -> Ground:
        width, height = max(self.events.width // 2, 1), max(self.events.height // 2, 1)
        left, top = (self.events.width - width) // 2, (self.events.height - height) // 2
        e = self.events
        inside = (e.x >= left) & (e.x < left + width) & (e.y >= top) & (e.y < top + height)
        kept = e.select(inside)
        events = Events(
            kept.t,
            (kept.x - left).astype(np.uint16),
            (kept.y - top).astype(np.uint16),
            kept.p,
            width,
            height,
            kept.label,
        )
        return Ground(events, self.feed, self.step_us, (self.origin[0] + left, self.origin[1] + top))

    def cancelled(self, suppressed: NDArray[np.bool_], cancel: CancelConfig) -> Cancelled:
        """Return what was cancelled after the warm-up; of everything where the stretch is no longer than that."""
        events = self.events
        late = events.t >= events.t[0] + cancel.warm_up_us
        if not late.any():
            late = np.ones(len(events), np.bool_)
        if events.label is None:
            return Cancelled(ratio=float(suppressed[late].mean()))
        ego, mover = late & (events.label == EGO), late & (events.label == MOVER)
        return Cancelled(
            ratio=float(suppressed[late].mean()),
            ego=float(suppressed[ego].mean()) if ego.any() else None,
            mover=float(suppressed[mover].mean()) if mover.any() else None,
        )


def gather(chunks: Iterable[Events], feed: MotionFeed, *, most: int, step_us: int) -> Ground | None:
    """Take up to ``most`` events from the beginning, with the motion followed as they pass; ``None`` of none."""
    parts, count = [], 0
    for chunk in chunks:
        part = chunk[: most - count]
        if not len(part):
            continue
        feed.advance(part)
        parts.append(part)
        count += len(part)
        if count >= most:
            break
    return Ground(Events.concatenate(parts), feed, step_us) if parts else None


def shifted(schedule: MotionSchedule, left: int, top: int) -> MotionSchedule:
    """Return the schedule in coordinates that begin at ``(left, top)``: exact, the displacement is affine."""
    if (left, top) == (0, 0):
        return schedule
    table = schedule.coefficients.copy()
    table[:, 2] += table[:, 0] * left + table[:, 1] * top
    table[:, 5] += table[:, 3] * left + table[:, 4] * top
    return MotionSchedule(schedule.t_us.copy(), table, schedule.horizon_us)
