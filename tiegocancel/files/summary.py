"""Sum up a recording chunk by chunk."""

from __future__ import annotations

import numpy as np

from tiegocancel.events import Events

__all__ = ["RecordingSummary"]

_BIN_US = 1_000


class RecordingSummary:
    """Count events, polarities and the busiest millisecond of a stream of chunks in order.

    ``events`` and ``on_events`` are counts; ``first_us`` and ``last_us`` times, ``None`` without events;
    ``peak_events_ms`` is the most events in one of the milliseconds counted from the first event.
    """

    def __init__(self) -> None:
        self.events = 0
        self.on_events = 0
        self.first_us: int | None = None
        self.last_us: int | None = None
        self.peak_events_ms = 0
        self._bin = 0
        self._in_bin = 0

    def add(self, chunk: Events) -> None:
        """Take in the next chunk."""
        if not len(chunk):
            return
        if self.first_us is None:
            self.first_us = int(chunk.t[0])
        self.last_us = int(chunk.t[-1])
        self.events += len(chunk)
        self.on_events += int(np.count_nonzero(chunk.p))
        bins = (chunk.t - self.first_us) // _BIN_US
        starts = np.concatenate([[0], np.flatnonzero(np.diff(bins)) + 1])
        counts = np.diff(np.append(starts, len(bins)))
        if int(bins[0]) == self._bin:
            counts[0] += self._in_bin
        self.peak_events_ms = max(self.peak_events_ms, int(counts.max()))
        self._bin, self._in_bin = int(bins[-1]), int(counts[-1])

    @property
    def span_us(self) -> int:
        """Time from the first to the last event."""
        return 0 if self.first_us is None or self.last_us is None else self.last_us - self.first_us

    @property
    def mean_hz(self) -> float | None:
        """Events a second over the span, ``None`` where it is 0."""
        return self.events * 1e6 / self.span_us if self.span_us else None

    @property
    def peak_hz(self) -> float:
        """Events a second in the busiest millisecond."""
        return self.peak_events_ms * 1e6 / _BIN_US

    @property
    def on_share(self) -> float | None:
        """Share of ON events, ``None`` without events."""
        return self.on_events / self.events if self.events else None
