"""Pass a stream through the filters that are on, chunk by chunk."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.filters.background import Background
from tiegocancel.filters.config import FilterConfig
from tiegocancel.filters.counters import FilterCounters
from tiegocancel.filters.flicker import Flicker
from tiegocancel.filters.hot_pixel import HotPixel
from tiegocancel.filters.refractory import Refractory

__all__ = ["FilterChain"]

_FILTERS = (HotPixel, Flicker, Refractory, Background)
"""In this order: a hot pixel must support no neighbour, and rests would hide how often and how regularly it fires."""


class _Filter(Protocol):
    """Remove events by clearing their bytes."""

    name: str

    def process(self, events: Events, kept: NDArray[np.uint8]) -> None:
        """Clear ``kept`` uint8[n] where an event is removed."""


class FilterChain:
    """Say of every event whether it is kept; what one filter removes, the next does not see.

    State is constant: 4 bytes a pixel for each filter that is on (8 for refractory by polarity). Chunk borders change
    nothing. Not thread-safe: one thread owns the kernels.
    """

    def __init__(self, config: FilterConfig, *, width: int, height: int) -> None:
        frame = Events.empty(width, height)  # the one place that knows which sensor sizes are valid
        self.config = config
        self.width, self.height = frame.width, frame.height
        self._filters: list[_Filter] = [
            kind(config, width=self.width, height=self.height) for kind in _FILTERS if kind.name in config.active
        ]
        self._events = self._kept = 0
        self._removed = dict.fromkeys(config.active, 0)
        self._last_us: int | None = None

    @property
    def counters(self) -> FilterCounters:
        """Return the counts so far."""
        return FilterCounters(events=self._events, kept=self._kept, **self._removed)

    def prepare(self) -> None:
        """Compile the kernels now instead of at the first event; it decides nothing and keeps no trace."""
        one = Events([0], [0], [0], [0], 1, 1)  # type: ignore[arg-type]
        for kind in _FILTERS:
            if kind.name in self.config.active:
                kind(self.config, width=1, height=1).process(one, np.ones(1, np.uint8))

    def process(self, events: Events) -> NDArray[np.bool_]:
        """Return bool[n], true where an event is kept; chunks may be cut anywhere and may be empty.

        Raise ``ValueError`` when the sensor size differs or the chunk begins before the end of the one before.
        """
        if (events.width, events.height) != (self.width, self.height):
            raise ValueError(
                f"events of {events.width}×{events.height} px do not fit a filter of {self.width}×{self.height} px"
            )
        kept = np.ones(len(events), np.uint8)
        if len(events):
            if self._last_us is not None and int(events.t[0]) < self._last_us:
                raise ValueError(f"the chunk begins at {events.t[0]} µs, before the last event at {self._last_us} µs")
            self._last_us = int(events.t[-1])
            left = len(events)
            for step in self._filters:
                step.process(events, kept)
                after = int(np.count_nonzero(kept))
                self._removed[step.name] += left - after
                left = after
            self._events += len(events)
            self._kept += left
        return kept.view(np.bool_)
