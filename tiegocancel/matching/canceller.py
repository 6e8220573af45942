"""Cancel a stream chunk by chunk: the host of the matching kernel and the owner of its state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules, SelectiveEngine, schedules_for
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.motion.trajectory import Trajectory

__all__ = ["Canceller", "Counters", "Decisions"]

_LAUNCH_SPAN_US = 1 << 29  # relative event times stay below this, relative predictions below twice it


@dataclass(frozen=True, slots=True, kw_only=True)
class Counters:
    """Count what happened since the start of the stream; reads as attributes or as a mapping.

    ``events`` decided; ``suppressed`` of them; ``predicted``: predictions that entered the ring; ``outside``: discarded
    beyond the sensor; ``overflow``: discarded because the ring was full; ``overwritten``: replaced in their cell while
    their gate was still open; ``ring_high_water``: most predictions ever pending.
    ``still``: not made because they would move too little. ``events = predicted + outside + overflow + still`` always
    holds.
    """

    events: int = 0
    suppressed: int = 0
    predicted: int = 0
    outside: int = 0
    overflow: int = 0
    overwritten: int = 0
    ring_high_water: int = 0
    still: int = 0

    def keys(self) -> Iterator[str]:
        """Name the counts, so that ``dict(counters)`` works."""
        return (field.name for field in fields(self))

    def __getitem__(self, name: str) -> int:
        if name not in self.keys():
            raise KeyError(name)
        return int(getattr(self, name))


@dataclass(frozen=True, slots=True, eq=False)
class Decisions:
    """Decide a chunk: ``suppressed`` bool[n]; ``source`` int64[n] or ``None`` when it is not tracked.

    ``source`` is the index in the whole stream of the event whose prediction was used, −1 where there is none;
    ``horizon`` uint8[n] which of several horizons that prediction was made for, ``None`` with one; ``support`` uint8[n]
    the support ``S`` that each event met, suppressed or not, ``None`` from the kernel of the plain rule.
    """

    suppressed: NDArray[np.bool_]
    source: NDArray[np.int64] | None = None
    horizon: NDArray[np.uint8] | None = None
    support: NDArray[np.uint8] | None = None


class Canceller:
    """Suppress the events that meet a prediction, exactly as ``semantics.md`` says.

    ``motion`` is a :class:`MotionSchedule` (integer path), one for each horizon where there are several, or a
    trajectory (float path, for studies, and the plain rule alone); it may be replaced between chunks, as an online
    estimator does.
    State is constant: 8 bytes for each of ``ring_capacity`` predictions and 4 bytes a pixel (16 and 12 with
    ``track_source``). Chunk borders and thread counts change nothing. Not thread-safe: one thread owns the kernels.
    """

    def __init__(
        self,
        config: CancelConfig,
        motion: MotionSchedule | Schedules | Trajectory,
        *,
        width: int,
        height: int,
        track_source: bool = True,
    ) -> None:
        frame = Events.empty(width, height)  # the one place that knows which sensor sizes are valid
        self.config = config
        self.motion = motion
        self._engine: SelectiveEngine | None = None
        self.width, self.height, self.track_source = frame.width, frame.height, track_source
        self._last_us: int | None = None
        if not config.is_plain:
            self._engine = SelectiveEngine(config, width=self.width, height=self.height)
            return
        border = max(abs(dx) for dx, _ in config.offsets)
        self._stride = self.width + border
        self._origin = border * self._stride + border
        table = (self.height + 2 * border) * self._stride + border
        if table >= 1 << 31:
            raise ValueError(f"a table of {table} cells for {width}×{height} px is beyond 2^31")
        tracked = table if track_source else 1
        self._cells = np.zeros(table, np.uint32)
        self._ring = np.zeros(config.ring_capacity, np.uint64)
        self._cursors = np.zeros(9, np.int64)
        self._base_us: int | None = None
        self._ahead = np.zeros(1, np.int32)  # where a chunk's predictions go; kept, for it costs time to map
        self._arguments: dict[str, Any] = {
            "horizon_us": config.horizon_us,
            "gate_us": config.tolerance_us,
            "stride": self._stride,
            "origin": self._origin,
            "capacity": config.ring_capacity,
            "offsets": np.array([dy * self._stride + dx for dx, dy in config.offsets], np.int32),
            "cells": self._cells,
            "cell_source": np.zeros(tracked, np.int64),
            "ring": self._ring,
            "ring_source": np.zeros(config.ring_capacity if track_source else 1, np.int64),
            "cursors": self._cursors,
        }

    @property
    def motion(self) -> MotionSchedule | Schedules | Trajectory:
        """The motion that the next chunk is decided with; a schedule must have been made for its horizon."""
        return self._motion

    @motion.setter
    def motion(self, motion: MotionSchedule | Schedules | Trajectory) -> None:
        if isinstance(motion, MotionSchedule | tuple):
            schedules_for(self.config, motion)
        elif not self.config.is_plain:
            raise ValueError(
                "a selective canceller runs schedules; a trajectory (the float path) serves the plain rule"
            )
        self._motion = motion

    @property
    def counters(self) -> Counters:
        """Return the counts so far."""
        counts = [*self._cursors[2:].tolist(), 0] if self._engine is None else self._engine.counts.tolist()
        return Counters(**dict(zip((field.name for field in fields(Counters)), counts, strict=True)))

    @property
    def pending(self) -> int:
        """Number of predictions in the ring."""
        return int(self._cursors[1]) if self._engine is None else self._engine.pending

    @property
    def most_held(self) -> tuple[int, ...]:
        """Most that each ring ever held: of the one ring, or of each horizon's own where events choose among them."""
        return (self.counters.ring_high_water,) if self._engine is None else self._engine.most_held

    def prepare(self) -> None:
        """Compile the kernel now instead of at the first event; it decides nothing."""
        one = Events([0], [0], [0], [0], self.width, self.height)  # type: ignore[arg-type]
        if self._engine is not None:
            self._engine.run(one[:0], self._schedules())
            return
        self._predict(one)
        self._launch(one, 0, 0, np.zeros(1, np.uint8), np.zeros(1, np.int64), base_us=0)

    def process(self, events: Events) -> Decisions:
        """Decide every event of a chunk; chunks may be cut anywhere and may be empty.

        Raise ``ValueError`` when the sensor size differs or the chunk begins before the end of the one before.
        """
        if (events.width, events.height) != (self.width, self.height):
            raise ValueError(
                f"events of {events.width}×{events.height} px do not fit a canceller of {self.width}×{self.height} px"
            )
        count = len(events)
        if self._engine is not None:
            return self._select(events)
        suppressed = np.empty(count, np.uint8)
        source = np.empty(count if self.track_source else 1, np.int64)
        if count:
            self._check_order(events)
            self._predict(events)
            for first, last, base_us in self._launches(events.t):
                self._launch(events, first, last, suppressed, source, base_us=base_us)
                self._last_us = int(events.t[last - 1])
        return Decisions(suppressed=suppressed.view(np.bool_), source=source if self.track_source else None)

    def _select(self, events: Events) -> Decisions:
        """Decide a chunk by the selective rule."""
        assert self._engine is not None
        if len(events):
            self._check_order(events)
            self._last_us = int(events.t[-1])
        suppressed, source, horizon, support = self._engine.run(events, self._schedules())
        return Decisions(
            suppressed=suppressed.view(np.bool_),
            source=source if self.track_source else None,
            horizon=horizon if self.track_source else None,
            support=support,
        )

    def _schedules(self) -> Schedules:
        """Return the motion, a schedule for each horizon."""
        assert isinstance(self._motion, MotionSchedule | tuple)
        return schedules_for(self.config, self._motion)

    def _check_order(self, events: Events) -> None:
        """Refuse a chunk from before the last one: times never decrease in a stream."""
        if self._last_us is not None and int(events.t[0]) < self._last_us:
            raise ValueError(f"the chunk begins at {events.t[0]} µs, before the last event at {self._last_us} µs")

    def _launches(self, t: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
        """Cut a chunk where the relative times would leave their bits, moving the base in between.

        Yield first and last row of each launch, and the base of its times.
        """
        first = 0
        while first < len(t):
            base_us = self._base_us
            if base_us is None or int(t[first]) >= base_us + _LAUNCH_SPAN_US:
                base_us = self._move_base(int(t[first]))
            limit = base_us + _LAUNCH_SPAN_US
            last = len(t) if int(t[-1]) < limit else int(np.searchsorted(t, limit, side="left"))
            yield first, last, base_us
            first = last

    def _launch(
        self,
        events: Events,
        first: int,
        last: int,
        suppressed: NDArray[np.uint8],
        source: NDArray[np.int64],
        *,
        base_us: int,
    ) -> None:
        """Hand rows ``first`` to ``last`` to the kernel."""
        from tiegocancel.kernels.match import cancel

        cancel(
            polarity=self.config.polarity,
            offsets=self._arguments["offsets"],
            track_source=self.track_source,
            state={
                **self._arguments,
                "count": last - first,
                "first": first,
                "base_us": base_us,
                "t": events.t,
                "x": events.x,
                "y": events.y,
                "p": events.p,
                "ahead": self._ahead,
                "suppressed": suppressed,
                "source": source,
            },
        )

    def _predict(self, events: Events) -> None:
        """Fill ``_ahead`` with the cell of each event's prediction, −1 beyond the sensor."""
        if len(self._ahead) < len(events):
            self._ahead = np.empty(len(events), np.int32)
        if isinstance(self.motion, MotionSchedule | tuple):
            self._predict_by_schedule(events, self._schedules()[0])
            return
        ahead_x, ahead_y = self.motion.predict(events.t, events.x, events.y, self.config.horizon_us)
        inside = (ahead_x >= 0) & (ahead_x < self.width) & (ahead_y >= 0) & (ahead_y < self.height)
        self._ahead[: len(events)] = np.where(inside, self._origin + ahead_y * self._stride + ahead_x, -1)

    def _predict_by_schedule(self, events: Events, schedule: MotionSchedule) -> None:
        """Let the kernel apply each entry to the run of events that use it."""
        from tiegocancel.kernels.predict import predict

        first, last = (int(entry) for entry in schedule.entry_at(events.t[[0, -1]]))
        inner = np.searchsorted(events.t, schedule.t_us[first + 1 : last + 1], side="left")
        predict(
            width=self.width,
            height=self.height,
            stride=self._stride,
            origin=self._origin,
            segments=np.concatenate([[0], inner, [len(events)]]).astype(np.int64),
            coefficients=np.ascontiguousarray(schedule.coefficients[first : last + 1]),
            x=events.x,
            y=events.y,
            ahead=self._ahead,
        )

    def _move_base(self, now_us: int) -> int:
        """Count relative times from just before ``now_us`` on, drop every prediction that is dead; return the base.

        A prediction is dead once ``t' + ε_t < now``: times never decrease. Dropping it before its bits wrap is what
        keeps an alias from ever matching, and it changes no decision and no counter.
        """
        base = now_us - self.config.tolerance_us
        if self._base_us is not None:
            shift = base - self._base_us
            ages = self._cells >> np.uint32(2)
            dead = ages < shift
            self._cells[dead] = 0
            alive = self._cells != 0
            self._cells[alive] -= np.uint32(min(shift, (1 << 30) - 1)) << np.uint32(2)
            self._rebase_ring(shift)
        self._base_us = base
        return base

    def _rebase_ring(self, shift: int) -> None:
        """Pop the dead at the head (predictions fall due in order) and shift the rest."""
        head, pending = int(self._cursors[0]), int(self._cursors[1])
        slots = (head + np.arange(pending)) % self.config.ring_capacity
        due = (self._ring[slots] & np.uint64(0xFFFFFFFF)) >> np.uint64(2)
        dead = int(np.searchsorted(due, np.uint64(shift), side="left"))
        self._ring[slots[dead:]] -= np.uint64(shift if dead < pending else 0) << np.uint64(2)
        self._cursors[0] = (head + dead) % self.config.ring_capacity
        self._cursors[1] = pending - dead
