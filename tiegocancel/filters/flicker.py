"""Mute pixels that see a light flicker."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.filters.config import FilterConfig
from tiegocancel.filters.time_table import TimeTable

__all__ = ["Flicker"]


class Flicker:
    """Count at each pixel how often ON has followed OFF with a period of the band.

    An onset is an ON event whose pixel fired OFF before. From onset to onset, a period between the two of
    ``flicker_gaps_us`` raises the pixel's count by one, up to ``flicker_periods``; any other lowers it by one. At
    ``flicker_periods`` the pixel is muted, at 0 it is heard again, and without an onset for ``flicker_silence_us``
    all is forgotten. Every event of a muted pixel is removed, the onset that muted it included.

    A pixel's period from its like transitions: Pfrommer, "Frequency Cam" (2022), who reconstructs the brightness
    before he looks for them; a band of 50 to 500 Hz at most is what Prophesee's anti-flicker block in the sensor has.
    What it costs: whatever else happens at a muted pixel is lost, and a texture that crosses a pixel with a period of
    the band looks like a lamp: of the built-in disc nothing at 3.6 rad/s, 1.4 % at 20 rad/s with the default band and
    13 % with 50 to 500 Hz. So the band should be narrow and the count four or more.
    """

    name = "flicker"

    def __init__(self, config: FilterConfig, *, width: int, height: int) -> None:
        self._periods = config.flicker_periods
        self._shortest_us, self._longest_us = config.flicker_gaps_us
        self._silence_us = config.flicker_silence_us
        self._width = width
        self._table = TimeTable(width * height, span_us=1 << 25, flag_bits=6)

    def process(self, events: Events, kept: NDArray[np.uint8]) -> None:
        """Clear ``kept`` uint8[n] where an event is removed; those that are 0 already are not seen."""
        from tiegocancel.kernels.filters import flicker

        for first, count, base_us in self._table.launches(events.t):
            flicker(
                count=count,
                first=first,
                base_us=base_us,
                periods=self._periods,
                shortest_us=self._shortest_us,
                longest_us=self._longest_us,
                silence_us=self._silence_us,
                width=self._width,
                t=events.t,
                x=events.x,
                y=events.y,
                p=events.p,
                cells=self._table.cells,
                kept=kept,
            )
