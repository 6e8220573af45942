"""Check what a simulated device is handed: events of its sensor, arrivals that rise from chunk to chunk."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events

__all__ = ["Intake"]


class Intake:
    """Remember the last arrival of a stream; a ``saturated`` device needs none, for the next event always waits."""

    def __init__(self, noun: str, *, width: int, height: int, saturated: bool) -> None:
        self._noun, self._width, self._height, self._saturated = noun, width, height, saturated
        self._last = -1

    def arrivals(self, events: Events, arrival: NDArray[np.int64] | None) -> NDArray[np.int64]:
        """Return the arrivals int64[n] of a chunk, contiguous; −1 for a saturated device.

        Raise ``ValueError`` where the sensor's size differs, and where arrivals are missing or do not rise by a cycle.
        """
        if (events.width, events.height) != (self._width, self._height):
            raise ValueError(
                f"events of {events.width}×{events.height} px do not fit a {self._noun} of "
                f"{self._width}×{self._height} px"
            )
        if self._saturated:
            return np.full(len(events), -1, np.int64)
        if arrival is None:
            raise ValueError(f"arrivals must be given unless the {self._noun} is saturated")
        if len(arrival) != len(events) or (len(arrival) and arrival[0] <= self._last) or (np.diff(arrival) < 1).any():
            raise ValueError("arrivals must rise by at least one cycle from event to event")
        if len(arrival):
            self._last = int(arrival[-1])
        return np.ascontiguousarray(arrival, np.int64)
