"""Carry decoded rows between a format's decoder and the checks that all formats share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import EGO, MAX_TIME_US, NOISE

__all__ = ["Block", "place_namer"]


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Decoded rows in file order, not yet checked against the sensor's size nor sorted.

    ``t`` int64[n] in µs; ``x`` and ``y`` are integers of any width, [n] px; ``p`` uint8[n] in {0, 1};
    ``label`` integers [n] or ``None``. ``where(i)`` names the place of row ``i`` in the file.
    """

    t: NDArray[np.int64]
    x: NDArray[Any]
    y: NDArray[Any]
    p: NDArray[np.uint8]
    where: Callable[[int], str]
    label: NDArray[Any] | None = None

    def __len__(self) -> int:
        return len(self.t)

    def head(self, count: int) -> Block:
        """Return the first ``count`` rows."""
        label = None if self.label is None else self.label[:count]
        return Block(self.t[:count], self.x[:count], self.y[:count], self.p[:count], self.where, label)

    def labelled(self, label: NDArray[Any]) -> Block:
        """Return the same rows with ``label`` [n]."""
        return Block(self.t, self.x, self.y, self.p, self.where, label)

    def first_fault(self, width: int, height: int) -> tuple[int, str] | None:
        """Return the first row that a sensor of this size cannot have sent, and what is wrong with it."""
        if not len(self):
            return None
        faults: list[tuple[int, str]] = []
        for name, column, low, high in (
            ("x", self.x, 0, width - 1),
            ("y", self.y, 0, height - 1),
            ("t", self.t, -MAX_TIME_US, MAX_TIME_US),
            ("label", self.label, EGO, NOISE),
        ):
            if column is None or (int(column.min()) >= low and int(column.max()) <= high):
                continue
            row = int(np.argmax((column < low) | (column > high)))
            faults.append((row, f"{name} is {column[row]}, expected {_range_of(name, low, high, width, height)}"))
        return min(faults) if faults else None


def _range_of(name: str, low: int, high: int, width: int, height: int) -> str:
    """Say which values a column may hold and, for a coordinate, whose fault another value is."""
    if name in "xy":
        return f"{low} to {high} on a sensor of {width}x{height} px"
    return "a time within ±2^60 µs" if name == "t" else f"{low} to {high}"


def place_namer(unit: str, places: Sequence[int] | NDArray[Any]) -> Callable[[int], str]:
    """Return a function that names the place of row ``i``: ``unit`` (row, byte) and ``places[i]``."""
    return lambda row: f"{unit} {int(places[row])}"
