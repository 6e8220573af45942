"""Let a pixel rest after each event."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.filters.config import FilterConfig
from tiegocancel.filters.time_table import TimeTable

__all__ = ["Refractory"]


class Refractory:
    """Remove an event that comes less than ``refractory_us`` after the last one kept at its pixel.

    Removed events do not prolong the rest, so a busy pixel still fires once a period; this is the dead time of the
    pixel itself (Lichtsteiner et al. 2008), made longer. With ``refractory_by_polarity`` each polarity rests alone.
    """

    name = "refractory"

    def __init__(self, config: FilterConfig, *, width: int, height: int) -> None:
        self._period_us, self._by_polarity = config.refractory_us, config.refractory_by_polarity
        self._width = width
        self._table = TimeTable(width * height << self._by_polarity, span_us=1 << 30)

    def process(self, events: Events, kept: NDArray[np.uint8]) -> None:
        """Clear ``kept`` uint8[n] where an event is removed; those that are 0 already are not seen."""
        from tiegocancel.kernels.filters import refractory

        for first, count, base_us in self._table.launches(events.t):
            refractory(
                by_polarity=self._by_polarity,
                count=count,
                first=first,
                base_us=base_us,
                period_us=self._period_us,
                width=self._width,
                t=events.t,
                x=events.x,
                y=events.y,
                p=events.p,
                cells=self._table.cells,
                kept=kept,
            )
