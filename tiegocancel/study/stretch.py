"""Keep a bounded stretch of a run for its pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events

__all__ = ["Densest", "Stretch"]

_FIRST_WAIT_US = 1_000_000


class Stretch:
    """Collect events and decisions from ``start_us`` on: ``span_us``, longer where events are few.

    It goes on until it holds ``enough`` events, but never over more than ``longest_us`` nor over more than ``most``
    events. ``rows`` = (low, high), both included, keeps those rows alone.
    """

    def __init__(
        self,
        start_us: int,
        *,
        span_us: int,
        longest_us: int,
        enough: int,
        most: int,
        rows: tuple[int, int] | None = None,
    ) -> None:
        self.start_us, self.rows = start_us, rows
        self._span_us, self._longest_us, self._enough, self._most = span_us, longest_us, enough, most
        self._parts: list[Events] = []
        self._suppressed: list[NDArray[np.bool_]] = []
        self._count = 0
        self._full = False

    def __len__(self) -> int:
        return self._count

    @property
    def full(self) -> bool:
        """Tell whether the stretch has ended."""
        return self._full

    def add(self, events: Events, suppressed: NDArray[np.bool_]) -> None:
        """Take what belongs to the stretch from a chunk."""
        if self._full or not len(events) or int(events.t[-1]) < self.start_us:
            return
        beyond = int(events.t[-1]) > self.start_us + self._longest_us
        if self.rows is not None:
            inside = (events.y >= self.rows[0]) & (events.y <= self.rows[1])
            events, suppressed = events.select(inside), suppressed[inside]
        if len(events):
            first = int(np.searchsorted(events.t, self.start_us, side="left"))
            last = self._end(events, first)
            self._full = last < len(events)
            self._parts.append(events[first:last])
            self._suppressed.append(suppressed[first:last].copy())
            self._count += last - first
        self._full |= beyond

    def _end(self, events: Events, first: int) -> int:
        """Return the row at which the stretch ends in this chunk."""
        stop_us = self.start_us + self._span_us
        missing = max(self._enough - self._count, 0)
        if missing and first < len(events):
            stop_us = max(stop_us, int(events.t[min(first + missing, len(events)) - 1]))
        stop_us = min(stop_us, self.start_us + self._longest_us)
        return min(int(np.searchsorted(events.t, stop_us, side="right")), first + self._most - self._count)

    def events(self) -> Events | None:
        """Return the events, ``None`` when there are none."""
        return Events.concatenate(self._parts) if self._count else None

    def suppressed(self) -> NDArray[np.bool_]:
        """Return bool[n]: which of them were suppressed."""
        return np.concatenate(self._suppressed) if self._suppressed else np.zeros(0, np.bool_)


class Densest:
    """Keep, of stretches that begin 0, 1, 3, 7, 15, … s after ``start_us``, the one with the most events.

    A recording may begin in stillness; its pictures should not. Takes what :class:`Stretch` takes.
    """

    def __init__(self, start_us: int, *, rows: tuple[int, int] | None = None, **limits: int) -> None:
        self.rows = rows
        self._limits = limits
        self._best = self._current = Stretch(start_us, rows=rows, **limits)
        self._wait_us = _FIRST_WAIT_US

    def add(self, events: Events, suppressed: NDArray[np.bool_]) -> None:
        """Take what belongs to a stretch from a chunk."""
        while True:
            self._current.add(events, suppressed)
            if len(self._current) > len(self._best):
                self._best = self._current
            if not self._current.full:
                return
            self._current = Stretch(self._current.start_us + self._wait_us, rows=self.rows, **self._limits)
            self._wait_us *= 2

    def events(self) -> Events | None:
        """Return the events of the densest stretch, ``None`` when there are none."""
        return self._best.events()

    def suppressed(self) -> NDArray[np.bool_]:
        """Return bool[n]: which of them were suppressed."""
        return self._best.suppressed()
