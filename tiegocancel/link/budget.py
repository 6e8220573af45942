"""Say what a stream asks of a line: bytes a second, utilisation, the queue it needs, what a given FIFO loses."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.link.protocols.protocol import Encoder

__all__ = ["LinkBudget", "LinkMeter", "WireMeter", "link_budget"]

_BIN_US = 1000
_SLICE_US = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkBudget:
    """What a line of ``line_bytes_per_s`` has to do for a stream.

    ``bytes`` of ``events`` over ``span_s``; ``bytes_per_s`` their mean. ``utilisation`` is the mean demand over what
    the line carries, ``peak_1ms`` and ``peak_10ms`` the most of any millisecond and of any ten (above 1: more than it
    carries). ``queue_bytes``: what must wait at most before the line, so that nothing is lost; ``delay_s``: how long
    the last of it waits. ``lost_events`` do not fit a FIFO of ``fifo_bytes``.
    """

    events: int
    bytes: int
    span_s: float
    line_bytes_per_s: float
    fifo_bytes: int
    bytes_per_s: float
    bytes_per_event: float
    utilisation: float
    peak_1ms: float
    peak_10ms: float
    queue_bytes: int
    delay_s: float
    lost_events: int

    @property
    def lost_share(self) -> float:
        """Share of the events that the FIFO loses."""
        return self.lost_events / self.events if self.events else 0.0

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name, and bits a second."""
        return {**asdict(self), "bits_per_s": 8 * self.bytes_per_s, "lost_share": self.lost_share}


def link_budget(
    t_us: NDArray[np.int64],
    sizes: NDArray[np.float64],
    *,
    line_bytes_per_s: float,
    fifo_bytes: int = 4096,
    span_us: int | None = None,
) -> LinkBudget:
    """Return the budget of events at ``t_us`` int64[n], never decreasing, of ``sizes`` float64[n] bytes each.

    ``span_us`` is the time that the means are over, by default from the first to the last event.
    """
    meter = LinkMeter(line_bytes_per_s, fifo_bytes)
    meter.add(t_us, sizes)
    return meter.budget(span_us)


class LinkMeter:
    """Take a stream in chunks and return its budget; state is constant but for 8 bytes a millisecond of stream.

    The line is served first come, first served: an event's bytes arrive at once and leave at the line's rate. It is
    lost when the bytes that wait, its own among them, are more than the FIFO holds.
    """

    def __init__(self, line_bytes_per_s: float, fifo_bytes: int = 4096) -> None:
        if not 0.0 < line_bytes_per_s < float("inf"):
            raise ValueError(f"line_bytes_per_s must be above 0, not {line_bytes_per_s}")
        if fifo_bytes < 1:
            raise ValueError(f"fifo_bytes must be at least 1, not {fifo_bytes}")
        self.line_bytes_per_s, self.fifo_bytes = line_bytes_per_s, fifo_bytes
        self._per_us = line_bytes_per_s * 1e-6
        self._bins: NDArray[np.float64] = np.zeros(1024)
        self._first_us: int | None = None
        self._last_us = 0
        self._events = self._lost = 0
        self._bytes = self._waiting = self._highest = self._in_fifo = 0.0

    def add(self, t_us: NDArray[np.int64], sizes: NDArray[np.float64]) -> None:
        """Take events at ``t_us`` int64[n], never decreasing, of ``sizes`` float64[n] bytes each."""
        if not len(t_us):
            return
        if self._first_us is None:
            self._first_us = self._last_us = int(t_us[0])
        self._events += len(t_us)
        self._bytes += float(sizes.sum())
        self._count_bins((t_us - self._first_us) // _BIN_US, sizes)
        elapsed: NDArray[np.float64] = (t_us - self._last_us) * np.float64(self._per_us)
        # Lindley's recursion without a loop: the level falls to 0 wherever the running sum has a new minimum.
        level = self._waiting + np.cumsum(sizes) - elapsed
        floor = np.minimum(np.minimum.accumulate(level - sizes), 0.0)
        waiting = level - floor
        self._highest = max(self._highest, float(waiting.max()))
        lossless = self._in_fifo == self._waiting and float(waiting.max()) <= self.fifo_bytes
        self._waiting = float(waiting[-1])
        self._in_fifo = self._waiting if lossless else self._through_fifo(elapsed, sizes)
        self._last_us = int(t_us[-1])

    def budget(self, span_us: int | None = None) -> LinkBudget:
        """Return what was found so far."""
        first_us = self._last_us if self._first_us is None else self._first_us
        span_s = max((self._last_us - first_us if span_us is None else span_us) * 1e-6, 1e-6)
        used = self._bins[: (self._last_us - first_us) // _BIN_US + 1]
        tens = np.convolve(used, np.ones(min(10, len(used))), mode="valid")
        mean = self._bytes / span_s
        return LinkBudget(
            events=self._events,
            bytes=round(self._bytes),
            span_s=span_s,
            line_bytes_per_s=self.line_bytes_per_s,
            fifo_bytes=self.fifo_bytes,
            bytes_per_s=mean,
            bytes_per_event=self._bytes / self._events if self._events else 0.0,
            utilisation=mean / self.line_bytes_per_s,
            peak_1ms=float(used.max()) / (self._per_us * _BIN_US),
            peak_10ms=float(tens.max()) / (self._per_us * 10 * _BIN_US),
            queue_bytes=int(np.ceil(self._highest - 1e-9)),
            delay_s=self._highest / self.line_bytes_per_s,
            lost_events=self._lost,
        )

    def profile(self) -> NDArray[np.float64]:
        """Return the bytes of each millisecond from the first event on, float64[ms]."""
        if self._first_us is None:
            return np.zeros(0)
        return self._bins[: (self._last_us - self._first_us) // _BIN_US + 1].copy()

    def _count_bins(self, bins: NDArray[np.int64], sizes: NDArray[np.float64]) -> None:
        needed = int(bins[-1]) + 1
        if needed > len(self._bins):
            self._bins = np.concatenate([self._bins, np.zeros(max(needed - len(self._bins), len(self._bins)))])
        first = int(bins[0])
        counted = np.bincount(bins - first, weights=sizes)
        self._bins[first : first + len(counted)] += counted

    def _through_fifo(self, elapsed: NDArray[np.float64], sizes: NDArray[np.float64]) -> float:
        """Drop, event by event, what does not fit; return the bytes that wait in the end."""
        level, then = self._in_fifo, 0.0
        limit, lost = self.fifo_bytes + 1e-9, 0
        for now, size in zip(elapsed.tolist(), sizes.tolist(), strict=True):
            level -= now - then
            then = now
            if level < 0.0:
                level = 0.0
            if level + size <= limit:
                level += size
            else:
                lost += 1
        self._lost += lost
        return level


class WireMeter:
    """Measure events as a protocol sends them: a :class:`LinkMeter` behind an encoder.

    Bytes are those of the encoder, a millisecond of stream at a time, shared evenly by its events.
    """

    def __init__(self, encoder: Encoder, line_bytes_per_s: float, fifo_bytes: int = 4096) -> None:
        self._encoder = encoder
        self.meter = LinkMeter(line_bytes_per_s, fifo_bytes)
        self._extra = float(len(encoder.begin()))
        self.first_us: int | None = None
        self.last_us = 0

    def write(self, events: Events) -> None:
        """Take a chunk."""
        if not len(events):
            return
        self.first_us = int(events.t[0]) if self.first_us is None else self.first_us
        self.last_us = int(events.t[-1])
        cuts = np.flatnonzero(np.diff(events.t // _SLICE_US)) + 1
        sizes = np.empty(len(events))
        for first, last in zip([0, *cuts.tolist()], [*cuts.tolist(), len(events)], strict=True):
            total = len(self._encoder.encode(events[first:last])) + self._extra
            self._extra = 0.0
            sizes[first:last] = total / (last - first)
        self.meter.add(events.t, sizes)
