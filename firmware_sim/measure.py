"""Gather what a simulation shows: latencies, cycles an event, levels of the FIFOs, rates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.simulator import CoreTrace

__all__ = ["Distribution", "Gauge", "Level"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Distribution:
    """Least, mean, median, 99th percentile and greatest of a number; NaN of nothing."""

    least: float
    mean: float
    p50: float
    p99: float
    most: float

    @classmethod
    def of(cls, values: NDArray[np.int64] | NDArray[np.float64]) -> Distribution:
        """Describe an array."""
        if not len(values):
            return cls(least=np.nan, mean=np.nan, p50=np.nan, p99=np.nan, most=np.nan)
        p50, p99 = np.percentile(values, [50, 99])
        return cls(
            least=float(values.min()),
            mean=float(values.mean()),
            p50=float(p50),
            p99=float(p99),
            most=float(values.max()),
        )

    def scaled(self, factor: float) -> Distribution:
        """Return it in another unit."""
        return Distribution(
            least=self.least * factor,
            mean=self.mean * factor,
            p50=self.p50 * factor,
            p99=self.p99 * factor,
            most=self.most * factor,
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Level:
    """How many events a FIFO held: most in each of ``bins`` equal stretches of time, and in all.

    ``mean`` is over time.
    """

    most_by_time: NDArray[np.int64]
    high_water: int
    mean: float


@dataclass(slots=True)
class Gauge:
    """Take traces chunk after chunk; describe them together at the end."""

    _parts: list[CoreTrace] = field(default_factory=list)

    def take(self, trace: CoreTrace) -> None:
        """Take the trace of one chunk."""
        self._parts.append(trace)

    def column(self, name: str) -> NDArray[np.int64]:
        """Return one column of all traces, dropped events left out."""
        if not self._parts:
            return np.zeros(0, np.int64)
        return np.concatenate([getattr(part, name)[~part.dropped] for part in self._parts])

    def fate(self, name: str) -> NDArray[np.bool_]:
        """Return ``suppressed`` or ``dropped`` of all events."""
        return np.concatenate([getattr(part, name) for part in self._parts] or [np.zeros(0, np.bool_)])

    @property
    def drops(self) -> int:
        """Events that found the input FIFO full."""
        return sum(int(part.dropped.sum()) for part in self._parts)

    def latency(self) -> Distribution:
        """Describe cycles from arrival to decision."""
        return Distribution.of(self.column("decided") - self.column("arrival"))

    def stages(self) -> dict[str, Distribution]:
        """Describe where an event's cycles go: waiting at the input, predicting, draining, matching.

        A firmware does the last three in one, its ``decision``.
        """
        taken, first, issued = self.column("taken"), self.column("first"), self.column("issued")
        if (taken == issued).all():
            return {
                "input FIFO": Distribution.of(taken - self.column("arrival")),
                "decision": Distribution.of(self.column("decided") - issued),
            }
        return {
            "input FIFO": Distribution.of(taken - self.column("arrival")),
            "predict": Distribution.of(first - taken),
            "drain": Distribution.of(issued - first),
            "match": Distribution.of(self.column("decided") - issued),
        }

    def pace(self) -> Distribution:
        """Describe cycles from one match's issue to the next one's: of a saturated core, its cycles an event."""
        return Distribution.of(np.diff(self.column("issued")))

    def input_level(self, bins: int = 200) -> Level:
        """Return the level of the input FIFO."""
        return _level(self.column("arrival"), self.column("taken"), bins)

    def ring_level(self, bins: int = 200) -> Level:
        """Return the level of the rings, at decisions."""
        decided, held = self.column("decided"), self.column("held")
        if not len(held):
            return Level(most_by_time=np.zeros(bins, np.int64), high_water=0, mean=0.0)
        start, stop = int(decided[0]), int(decided[-1]) + 1
        most = np.zeros(bins, np.int64)
        np.maximum.at(most, np.minimum((decided - start) * bins // (stop - start), bins - 1), held)
        weights = np.diff(decided, append=stop)
        return Level(most_by_time=most, high_water=int(held.max()), mean=float((held * weights).sum()) / (stop - start))

    def output_level(self, bins: int = 200) -> Level:
        """Return the level of the output FIFO: residuals decided and not yet taken by the link."""
        residual = ~self.fate("suppressed")[~self.fate("dropped")]
        return _level(self.column("decided")[residual], self.column("left")[residual], bins)


def _level(enter: NDArray[np.int64], leave: NDArray[np.int64], bins: int) -> Level:
    """Return the level of a queue from the cycles in which its members enter and leave, both rising."""
    if not len(enter):
        return Level(most_by_time=np.zeros(bins, np.int64), high_water=0, mean=0.0)
    # Just after its own entry a member finds itself and those before it that have not left before that cycle.
    held = np.arange(1, len(enter) + 1) - np.searchsorted(leave, enter, side="left")
    start, stop = int(enter[0]), int(leave[-1]) + 1
    which = np.minimum((enter - start) * bins // max(stop - start, 1), bins - 1)
    most = np.zeros(bins, np.int64)
    np.maximum.at(most, which, held)
    return Level(
        most_by_time=most, high_water=int(held.max()), mean=float((leave - enter).sum()) / max(stop - start, 1)
    )
