"""Look up what the sweep measured, and average over windows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.study.sweep import Row
from tiegocancel.study.thesis.point import Point

__all__ = ["Curve", "Results", "share"]

FEWEST = 50
"""A share of fewer events is none."""


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """``y`` ± ``sd`` over windows at each ``x``, NaN where there is nothing; at most ``windows`` had something."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    sd: NDArray[np.float64]
    windows: int

    def at(self, x: float) -> float | None:
        """Return ``y`` at ``x``, ``None`` where nothing was measured."""
        found = np.flatnonzero(np.isclose(self.x, x))
        if not len(found) or not np.isfinite(self.y[found[0]]):
            return None
        return float(self.y[found[0]])


def share(row: Row, group: str = "", count: str = "suppressed") -> float:
    """Return the share of a group's events that were suppressed (or ``pairs``); NaN of fewer than 50 events."""
    events = row.get(f"{group}events", 0)
    return row[f"{group}{count}"] / events if events >= FEWEST else float("nan")


class Results:
    """Rows by point."""

    def __init__(self, rows: Mapping[Point, Row], windows: int) -> None:
        self.rows, self.windows = rows, windows

    @property
    def labelled(self) -> bool:
        """Tell whether events carry labels."""
        return any("mover_events" in row for row in self.rows.values())

    def row(self, point: Point) -> Row | None:
        """Return the row of a point, ``None`` when it was not measured."""
        return self.rows.get(point)

    def over_windows(self, point: Point) -> list[Row]:
        """Return the rows of a point in every window where it was measured."""
        found = (self.rows.get(point.at(window=window)) for window in range(self.windows))
        return [row for row in found if row is not None]

    def mean(self, point: Point, value: Callable[[Row], float] = share) -> float | None:
        """Return the mean of a value over windows, ``None`` where no window has it."""
        values = self._finite(point, value)
        return float(np.mean(values)) if values else None

    def curve(
        self, x: Iterable[float], point_at: Callable[[Any], Point], value: Callable[[Row], float] = share
    ) -> Curve:
        """Return a value against ``x``, where ``point_at(x)`` is the point to look up."""
        xs = list(x)
        values = [self._finite(point_at(place), value) for place in xs]
        return Curve(
            x=np.array(xs, np.float64),
            y=np.array([np.mean(some) if some else np.nan for some in values]),
            sd=np.array([np.std(some, ddof=1) if len(some) > 1 else (0.0 if some else np.nan) for some in values]),
            windows=max((len(some) for some in values), default=0),
        )

    def _finite(self, point: Point, value: Callable[[Row], float]) -> list[float]:
        values: Sequence[float | None] = [value(row) for row in self.over_windows(point)]
        return [number for number in values if number is not None and np.isfinite(number)]
