"""Hand the motion to a run: known beforehand, or found while the stream passes."""

from __future__ import annotations

import bisect
import itertools
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

import numpy as np

from tiegocancel.errors import ConfigError
from tiegocancel.estimation.estimate import Estimator, MotionEstimate, trajectory_of
from tiegocancel.events import Events
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.schedule import FRACTION_BITS, MotionSchedule, fixed_point
from tiegocancel.motion.times import EXTRAPOLATE_US
from tiegocancel.motion.trajectory import Trajectory

__all__ = ["FixedMotion", "MotionFeed", "ScheduledMotion", "TrackedMotion", "fixed_schedule"]

MAX_ENTRIES = 1 << 20

Wrapped = TypeVar("Wrapped", bound=Estimator)


class MotionFeed(Protocol):
    """Give the schedule that the next chunk is decided with."""

    source: str
    changes: bool
    """Whether the motion changes from chunk to chunk, so that only schedules of it can be had."""
    waits: bool
    """Whether nothing is predicted before the first time at which the motion is known."""

    def advance(self, chunk: Events) -> None:
        """Look at a chunk before it is decided; what is learnt holds from its own time on."""
        ...

    def schedule(self, horizon_us: int, *, start_us: int, stop_us: int, step_us: int) -> MotionSchedule:
        """Return the displacements from ``start_us`` to ``stop_us``."""
        ...

    def backwards(self, horizon_us: int, *, start_us: int, stop_us: int, step_us: int) -> MotionSchedule:
        """Return the same of the motion run the other way."""
        ...

    @property
    def trajectory(self) -> Trajectory | None:
        """The motion so far, ``None`` while nothing is known."""
        ...


class FixedMotion:
    """Pass on a motion that is known beforehand; before the first row of a causal one nothing is predicted."""

    changes = False

    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory = trajectory
        self.source = trajectory.source
        self.waits = _is_causal(trajectory)

    def advance(self, chunk: Events) -> None:
        """Learn nothing."""

    def schedule(self, horizon_us: int, *, start_us: int, stop_us: int, step_us: int) -> MotionSchedule:
        """Return the displacements from ``start_us`` on, all of them."""
        return self._begun(fixed_schedule(self.trajectory, horizon_us, start_us, step_us), start_us)

    def backwards(self, horizon_us: int, *, start_us: int, stop_us: int, step_us: int) -> MotionSchedule:
        """Return the same of the motion run the other way."""
        return self._begun(fixed_schedule(self.trajectory.reversed(), horizon_us, start_us, step_us), start_us)

    def _begun(self, schedule: MotionSchedule, start_us: int) -> MotionSchedule:
        """Put in front that nothing is known yet, where a causal motion begins after ``start_us``."""
        return _after_unknown(start_us, schedule) if self.waits else schedule


class ScheduledMotion:
    """Pass on a schedule as it was read, to the bit; raise ``ValueError`` for one that cannot be run backwards."""

    changes = False
    waits = False

    def __init__(self, schedule: MotionSchedule, horizon_us: int, *, source: str) -> None:
        from tiegocancel.motion.affine import AffineTrajectory
        from tiegocancel.motion.generator import inverse

        self.source = source
        self._schedule = schedule
        back = fixed_point(inverse(schedule.coefficients / float(1 << FRACTION_BITS)))
        self._backwards = MotionSchedule(schedule.t_us, back, schedule.horizon_us)
        self.trajectory = AffineTrajectory.from_schedule(schedule, horizon_us, source=source)

    def advance(self, chunk: Events) -> None:
        """Learn nothing."""

    def schedule(self, horizon_us: int, *, start_us: int, stop_us: int, step_us: int) -> MotionSchedule:
        """Return the schedule, whole."""
        return self._schedule

    def backwards(self, horizon_us: int, *, start_us: int, stop_us: int, step_us: int) -> MotionSchedule:
        """Return the schedule of the inverse displacements, rounded."""
        return self._backwards


class TrackedMotion:
    """Estimate the motion from the events themselves, causally: each row holds from its own time on.

    Until the first row nothing is predicted. ``estimates`` keeps every row; ``sink``, where it is set, takes them too.
    ``notes`` are remarks on what the estimator is given, for the user. ``most_rows`` bounds the rows kept of a stream
    without end: the older half is forgotten whenever there are more.

    ``hold_us`` makes it fail open; a run sets it from its settings, 0 never does. A motion is used for at most
    ``hold_us`` after the last confident row, through doubtful rows and where rows are missing; then it is unknown, and
    nothing is predicted, until the next confident row. A motion that moves no pixel of the sensor within the horizon is
    rest, and predicts nothing either: "same place" would meet noise and whatever moves by itself.
    """

    changes = True
    waits = True

    def __init__(self, estimator: Estimator, *, source: str = "track", notes: Sequence[str] = ()) -> None:
        self.source = source
        self.notes = tuple(notes)
        self.estimates: list[MotionEstimate] = []
        self.sink: Callable[[list[MotionEstimate]], None] | None = None
        self.hold_us = 0
        self._size = (0, 0)
        self.most_rows: int | None = None
        self._estimator = estimator
        self._known: list[MotionEstimate] = []
        self._sure_us: list[int] = []

    def wrapped(self, wrap: Callable[[Estimator], Wrapped]) -> Wrapped:
        """Put something around the estimator, before the first chunk, and return it."""
        outer = wrap(self._estimator)
        self._estimator = outer
        return outer

    def advance(self, chunk: Events) -> None:
        """Take the rows that a chunk makes due."""
        self._size = (chunk.width, chunk.height)
        rows = self._estimator.process(chunk)
        self.estimates += rows
        if self.sink is not None:
            self.sink(rows)
        known = [row for row in rows if row.has_center]
        self._known += known
        self._sure_us += [row.t_us for row in known if row.confident]
        if self.most_rows is not None and len(self.estimates) > self.most_rows:
            for kept in (self.estimates, self._known, self._sure_us):
                del kept[: max(len(kept) - self.most_rows // 2, 0)]

    def schedule(self, horizon_us: int, *, start_us: int, stop_us: int, step_us: int) -> MotionSchedule:
        """Return the displacements that rows up to ``stop_us`` give."""
        return self._schedule(horizon_us, start_us, stop_us, step_us, backwards=False)

    def backwards(self, horizon_us: int, *, start_us: int, stop_us: int, step_us: int) -> MotionSchedule:
        """Return the same of the motion run the other way."""
        return self._schedule(horizon_us, start_us, stop_us, step_us, backwards=True)

    @property
    def trajectory(self) -> RotationTrajectory | None:
        """The motion so far, ``None`` while nothing is known."""
        return trajectory_of(self.estimates, source=self.source).noted(*self.notes) if self._known else None

    def _schedule(
        self, horizon_us: int, start_us: int, stop_us: int, step_us: int, *, backwards: bool
    ) -> MotionSchedule:
        if not self._known or self._known[0].t_us > stop_us:
            return MotionSchedule.unknown(start_us)
        first = max(_last_at(self._known, start_us), 0)
        rows = trajectory_of(self._known[first:], source=self.source)
        known = (rows.reversed() if backwards else rows).schedule(
            horizon_us, start_us=max(start_us, int(rows.t_us[0])), stop_us=max(stop_us, start_us), step_us=step_us
        )
        if self.hold_us:
            known = _outside(_without_rest(known, *self._size), self._doubtful(start_us, stop_us))
        return _after_unknown(start_us, known)

    def _doubtful(self, start_us: int, stop_us: int) -> list[tuple[int, int]]:
        """Return the stretches ``[from, to)`` in µs from ``start_us`` on in which no confident row is recent."""
        sure = self._sure_us
        first = bisect.bisect_right(sure, start_us) - 1
        begun = [] if first >= 0 else [(min(start_us, self._known[0].t_us), sure[0] if sure else stop_us + 1)]
        ends = [*sure[max(first, 0) :], stop_us + 1] if sure else []
        # The last time at which a row is used is its own plus the hold, inclusive.
        return begun + [(a + self.hold_us + 1, b) for a, b in itertools.pairwise(ends) if b - a > self.hold_us + 1]


def fixed_schedule(trajectory: Trajectory, horizon_us: int, start_us: int, step_us: int) -> MotionSchedule:
    """Return a trajectory's schedule from ``start_us`` to where nothing changes any more; refuse one too long."""
    start_us = min(max(start_us, int(trajectory.t_us[0])), int(trajectory.t_us[-1]))
    # A causal trajectory goes on changing after its last row, as far as that is carried on.
    stop_us = int(trajectory.t_us[-1]) + (EXTRAPOLATE_US + step_us if _is_causal(trajectory) else 0)
    entries = (stop_us - start_us) // step_us + 1
    if entries > MAX_ENTRIES:
        raise ConfigError(
            f"the motion of {trajectory.source} needs {entries:,} schedule entries, at most {MAX_ENTRIES:,} fit: "
            f"make --schedule-step-us longer than {step_us}, or --motion-path float"
        )
    return trajectory.schedule(horizon_us, start_us=start_us, stop_us=stop_us, step_us=step_us)


def _is_causal(trajectory: Trajectory) -> bool:
    """Tell whether each row holds from its own time on, and nothing is known before the first."""
    return getattr(trajectory, "interpolation", None) == "causal"


def _after_unknown(start_us: int, known: MotionSchedule) -> MotionSchedule:
    """Return a schedule with an unknown motion from ``start_us`` until its first entry."""
    if int(known.t_us[0]) <= start_us:
        return known
    unknown = MotionSchedule.unknown(start_us)
    return MotionSchedule(
        np.concatenate([unknown.t_us, known.t_us]),
        np.concatenate([unknown.coefficients, known.coefficients]),
        known.horizon_us,
    )


def _without_rest(schedule: MotionSchedule, width: int, height: int) -> MotionSchedule:
    """Return the schedule with an unknown motion where an entry moves no pixel by half a pixel or more.

    A displacement is affine: if the four corners stay, everything does.
    """
    corners = np.array([(x, y, 1) for x in (0, width - 1) for y in (0, height - 1)], np.int64).T
    half = 1 << (FRACTION_BITS - 1)
    moves = schedule.coefficients.reshape(-1, 2, 3) @ corners
    rest = (np.abs(moves) < half).all(axis=(1, 2))
    if not rest.any():
        return schedule
    coefficients = np.where(rest[:, None], MotionSchedule.unknown().coefficients, schedule.coefficients)
    return MotionSchedule(schedule.t_us, coefficients, schedule.horizon_us)


def _outside(schedule: MotionSchedule, stretches: list[tuple[int, int]]) -> MotionSchedule:
    """Return the schedule with an unknown motion in stretches ``[from, to)``; an entry must begin where each ends."""
    for first, last in stretches:
        unknown = MotionSchedule.unknown(first)
        low, high = np.searchsorted(schedule.t_us, [first, last], side="left")
        schedule = MotionSchedule(
            np.concatenate([schedule.t_us[:low], unknown.t_us, schedule.t_us[high:]]),
            np.concatenate([schedule.coefficients[:low], unknown.coefficients, schedule.coefficients[high:]]),
            schedule.horizon_us,
        )
    return schedule


def _last_at(rows: list[MotionEstimate], t_us: int) -> int:
    """Return the last row at or before a time, −1 if there is none."""
    return bisect.bisect_right(rows, t_us, key=lambda row: row.t_us) - 1
