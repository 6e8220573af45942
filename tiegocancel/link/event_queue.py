"""Hand events from the thread that reads a line to the one that decides: a bounded queue that counts its losses."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.link.protocols.protocol import TextLine

__all__ = ["Arrival", "EventQueue", "Policy", "QueueCounters", "QueueOptions"]

Policy = Literal["block", "drop-oldest", "thin"]


@dataclass(frozen=True, slots=True, kw_only=True)
class QueueOptions:
    """Bound what waits between the two threads.

    ``capacity_events`` held at most. When processing falls behind, ``policy`` says what gives: ``block`` lets the
    reader wait, so that the line's flow control or the system's buffer takes it up; ``drop-oldest`` throws away what
    waited longest; ``thin`` keeps every 2nd, 4th or 8th event of what comes while the queue is more than 1/2, 3/4 or
    7/8 full. An event is held for ``hold_s`` at most before it is handed on, and less where ``chunk_events`` are there
    before.
    """

    capacity_events: int = 1 << 20
    policy: Policy = "block"
    hold_s: float = 0.005
    chunk_events: int = 1 << 16

    def __post_init__(self) -> None:
        if self.policy not in get_args(Policy):
            raise ConfigError(f"policy must be one of {', '.join(get_args(Policy))}, not {self.policy!r}")
        if not 0.0 <= self.hold_s <= 10.0:
            raise ConfigError(f"hold_s must be from 0 to 10 s, not {self.hold_s}")
        if self.chunk_events < 1:
            raise ConfigError(f"chunk_events must be at least 1, not {self.chunk_events}")
        if not self.chunk_events <= self.capacity_events <= 1 << 28:
            raise ConfigError(
                f"capacity_events must be from chunk_events ({self.chunk_events}) to 2^28, not {self.capacity_events}"
            )


@dataclass(slots=True, kw_only=True)
class QueueCounters:
    """Count what passed a queue: ``accepted = handed on + dropped + what waits``; ``thinned`` were never accepted.

    ``dropped`` by ``drop-oldest``, ``thinned`` by ``thin``; ``blocked_s``: how long ``block`` made the reader wait;
    ``high_water``: most events that ever waited.
    """

    accepted: int = 0
    dropped: int = 0
    thinned: int = 0
    blocked_s: float = 0.0
    high_water: int = 0

    def to_json(self) -> dict[str, Any]:
        """Return the counts by name."""
        return asdict(self)


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """What one read gave: ``events``, the text ``lines`` among them, and when the bytes were there, in s."""

    events: Events
    lines: list[TextLine]
    arrived_s: float


class EventQueue:
    """Pass arrivals from one writer to one reader; at most ``capacity_events`` wait, whatever the policy."""

    def __init__(self, options: QueueOptions) -> None:
        self.options = options
        self.counters = QueueCounters()
        self._held: deque[Arrival] = deque()
        self._count = 0
        self._closed = False
        self._kept_phase = 0
        self._changed = threading.Condition()

    def __len__(self) -> int:
        return self._count

    @property
    def closed(self) -> bool:
        """Tell whether the writer has ended; what waits may still be taken."""
        return self._closed

    def put(self, arrival: Arrival) -> bool:
        """Take an arrival in; return ``False`` when the queue was closed while this waited for room."""
        with self._changed:
            if self.options.policy == "thin":
                arrival = self._thinned(arrival)
            rest = arrival
            while len(rest.events) or rest.lines:
                room = self.options.capacity_events - self._count
                if room <= 0 and self.options.policy == "drop-oldest":
                    self._drop(min(len(rest.events), self.options.capacity_events))
                    continue
                if room <= 0 and not self._wait_for_room():
                    return False
                room = self.options.capacity_events - self._count
                self._append(Arrival(rest.events[:room], rest.lines, rest.arrived_s))
                rest = Arrival(rest.events[room:], [], rest.arrived_s)
        return not self._closed

    def take(self, wait_s: float) -> list[Arrival]:
        """Return everything that waits, once the oldest was held for ``hold_s`` or a chunk is full, or it is closed.

        Return nothing when nothing came within ``wait_s``.
        """
        deadline_s = time.perf_counter() + wait_s
        with self._changed:
            while not self._held and not self._closed:
                left_s = deadline_s - time.perf_counter()
                if left_s <= 0:
                    return []
                self._changed.wait(left_s)
            while self._held and not self._closed and self._count < self.options.chunk_events:
                left_s = self._held[0].arrived_s + self.options.hold_s - time.perf_counter()
                if left_s <= 0:
                    break
                self._changed.wait(left_s)
            taken, self._count = list(self._held), 0
            self._held.clear()
            self._changed.notify_all()
            return taken

    def close(self) -> None:
        """End it: nothing more comes in, a writer that waits returns."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _append(self, arrival: Arrival) -> None:
        self._held.append(arrival)
        self._count += len(arrival.events)
        self.counters.accepted += len(arrival.events)
        self.counters.high_water = max(self.counters.high_water, self._count)
        # The reader sleeps until a first arrival or a full chunk; between them its own clock wakes it.
        if len(self._held) == 1 or self._count >= self.options.chunk_events:
            self._changed.notify_all()

    def _wait_for_room(self) -> bool:
        """Wait until something was taken; return ``False`` when the queue is closed instead."""
        started_s = time.perf_counter()
        while self._count >= self.options.capacity_events and not self._closed:
            self._changed.wait(0.1)
        self.counters.blocked_s += time.perf_counter() - started_s
        return not self._closed

    def _drop(self, count: int) -> None:
        """Throw away the oldest events, lines stay."""
        while count > 0 and self._held:
            oldest = self._held.popleft()
            gone = min(count, len(oldest.events))
            count -= gone
            self._count -= gone
            self.counters.dropped += gone
            if gone < len(oldest.events):
                self._held.appendleft(Arrival(oldest.events[gone:], oldest.lines, oldest.arrived_s))
                return
            if oldest.lines and self._held:
                heir = self._held.popleft()
                self._held.appendleft(Arrival(heir.events, oldest.lines + heir.lines, heir.arrived_s))

    def _thinned(self, arrival: Arrival) -> Arrival:
        """Keep every k-th event by how full the queue is, and no more than there is room for."""
        fill = self._count / self.options.capacity_events
        step = 1 if fill <= 0.5 else 2 if fill <= 0.75 else 4 if fill <= 0.875 else 8
        events = arrival.events
        kept = events
        if step > 1:
            kept = events[(-self._kept_phase) % step :: step]
            self._kept_phase = (self._kept_phase + len(events)) % step
        kept = kept[: self.options.capacity_events - self._count]
        self.counters.thinned += len(events) - len(kept)
        return Arrival(kept, arrival.lines, arrival.arrived_s)
