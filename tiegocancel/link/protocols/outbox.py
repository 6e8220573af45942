"""Gather decoded columns and text until a feed returns them, in the user's axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.protocol import LinkCounters, TextLine

__all__ = ["Outbox"]

Columns = tuple[NDArray[np.int64], NDArray[Any], NDArray[Any], NDArray[Any]]


class Outbox:
    """Turn raw columns into events: axes exchanged and mirrored, beyond the sensor left out and counted.

    Times that fall behind the last one are lifted to it: a link's events are in order, and what is not was spoilt.
    """

    def __init__(self, width: int, height: int, options: ProtocolOptions) -> None:
        self.width = width
        self.height = height
        self.last_us: int | None = None
        self._options = options
        self._ahead_us = 0
        self.time_us = 0
        self._parts: list[Columns] = []
        self._lines: list[TextLine] = []

    def put(self, t: NDArray[np.int64], x: NDArray[Any], y: NDArray[Any], p: NDArray[Any]) -> None:
        """Add columns [n] as the device sent them."""
        if len(t):
            t = t + self._ahead_us if self._ahead_us else t
            self.time_us = int(t[-1])
            self._parts.append((t, x, y, p))

    def go_on_from(self, t_us: int) -> None:
        """Let the clock of what comes, which began anew at ``t_us``, go on from the last event."""
        self._ahead_us = self.time_us - t_us

    def resize(self, width: int, height: int) -> None:
        """Change the size of the sensor of what comes; take what came before."""
        self.width, self.height = width, height

    def put_line(self, t_us: int, text: str) -> None:
        """Add a line of text, at the time of the event before it."""
        self._lines.append(TextLine(t_us, text))

    def take_lines(self) -> list[TextLine]:
        """Return and forget the lines."""
        lines, self._lines = self._lines, []
        return lines

    def take(self, counters: LinkCounters) -> Events:
        """Return and forget the events; count them, and those outside."""
        if not self._parts:
            return Events.empty(self.width, self.height)
        parts, self._parts = self._parts, []
        columns = parts[0] if len(parts) == 1 else [np.concatenate(column) for column in zip(*parts, strict=True)]
        t, x, y, p = columns
        if self._options.swap_xy:
            x, y = y, x
        inside = (x < self.width) & (y < self.height)
        if not inside.all():
            counters.outside += int(np.count_nonzero(~inside))
            t, x, y, p = t[inside], x[inside], y[inside], p[inside]
        if self._options.flip_x:
            x = self.width - 1 - x.astype(np.int32)
        if self._options.flip_y:
            y = self.height - 1 - y.astype(np.int32)
        if len(t):
            if self.last_us is not None and t[0] < self.last_us:
                t = np.maximum(t, self.last_us)
            t = np.maximum.accumulate(t)
            self.last_us = int(t[-1])
        counters.events += len(t)
        return Events(t, x, y, p, self.width, self.height)
