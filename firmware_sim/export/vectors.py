"""Hold golden vectors: events in, decisions out, and all that decides between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.config import CoreConfig

from tiegocancel.events import Events
from tiegocancel.matching.canceller import Counters
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules, schedules_for
from tiegocancel.matching.selective_oracle import SelectiveOracle
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["CoreCycles", "Vectors", "golden_vectors", "last_asked_us", "time_base_us"]

_PART_EVENTS = 4096


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CoreCycles:
    """What one core does with the events at one clock, drops included: arrays of their length.

    ``arrival`` and ``decided`` in cycles, 0 at the time of the first event; ``decided`` −1 where the event was dropped.
    ``suppressed`` is the core's decision, which drops and stamps without a sweep can change. Cells have stamps of
    ``stamp_bits``; ``scrub_cycles`` lie between two words of the sweep, 0 for none.
    """

    core: CoreConfig
    clock_hz: float
    stamp_bits: int
    scrub_cycles: int
    dropped: NDArray[np.bool_]
    suppressed: NDArray[np.bool_]
    arrival: NDArray[np.int64]
    decided: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Vectors:
    """One stretch of events with the decision of each, made by a canceller whose state was empty before the first.

    ``schedules`` are one for each horizon, cut to the entries that these events use; no entry lies before
    :func:`time_base_us`. ``support`` uint8[n] is ``S`` of the semantics, ``counters`` what the canceller has counted at
    the end. Raise ``ValueError`` for a stretch without
    events, for columns of another length and for schedules that do not serve the configuration.
    """

    config: CancelConfig
    events: Events
    schedules: Schedules
    suppressed: NDArray[np.bool_]
    support: NDArray[np.uint8]
    counters: Counters
    cycles: CoreCycles | None = None

    def __post_init__(self) -> None:
        count = len(self.events)
        if not count:
            raise ValueError("vectors need at least one event")
        columns = {"suppressed": self.suppressed, "support": self.support}
        if self.cycles is not None:
            columns |= {name: getattr(self.cycles, name) for name in ("dropped", "arrival", "decided")}
            columns["suppressed by the core"] = self.cycles.suppressed
        for name, column in columns.items():
            if column.shape != (count,):
                raise ValueError(f"{name} must have one value for each of {count} events, not {list(column.shape)}")
        schedules_for(self.config, self.schedules)
        if self.schedules[0].t_us[0] < self.time_base_us:
            raise ValueError(
                f"no schedule entry may lie before the time base of {self.time_base_us} µs, as that of "
                f"{self.schedules[0].t_us[0]} µs does"
            )

    @property
    def time_base_us(self) -> int:
        """The time that packets count from."""
        return time_base_us(self.events, self.config)

    def differences(self, other: Vectors) -> list[str]:
        """Name what is not the same in two sets of vectors."""
        pairs = (
            ("the configuration", self.config == other.config),
            ("the sensor", (self.events.width, self.events.height) == (other.events.width, other.events.height)),
            *((f"column {name}", _same(self.events, other.events, name)) for name in ("t", "x", "y", "p")),
            *((f"column {name}", _same(self, other, name)) for name in ("suppressed", "support")),
            ("the counters", self.counters == other.counters),
            ("the schedules", _same_schedules(self.schedules, other.schedules)),
            ("the cycles", _same_cycles(self.cycles, other.cycles)),
        )
        return [name for name, same in pairs if not same]


def time_base_us(events: Events, config: CancelConfig) -> int:
    """Return the last whole tick at or before the first event, so that ticks stay what they were, less a constant."""
    return int(events.t[0]) >> config.tick_bits << config.tick_bits


def last_asked_us(events: Events, config: CancelConfig) -> int:
    """Return the last time whose motion a stretch can ask for.

    Where the motion is that of a gate's opening, a gate opens at a tick, and its time lies within that tick.
    """
    return int(events.t[-1]) + ((1 << config.tick_bits) - 1 if config.motion_at == "gate" else 0)


def golden_vectors(
    events: Events,
    config: CancelConfig,
    motion: MotionSchedule | Schedules,
    *,
    progress: Callable[[Events], None] | None = None,
) -> Vectors:
    """Decide a stretch with the plain model of the whole rule, from an empty state on; ``progress`` takes its parts."""
    schedules = _cut(schedules_for(config, motion), events, config)
    model = SelectiveOracle(config, schedules, width=events.width, height=events.height)
    decisions = []
    for first in range(0, len(events), _PART_EVENTS):
        part = events[first : first + _PART_EVENTS]
        decisions.append(model.process(part))
        if progress is not None:
            progress(part)
    return Vectors(
        config=config,
        events=events,
        schedules=schedules,
        suppressed=np.concatenate([one.suppressed for one in decisions]),
        support=np.concatenate([one.support for one in decisions if one.support is not None]),
        counters=model.counters,
    )


def _cut(schedules: Schedules, events: Events, config: CancelConfig) -> Schedules:
    """Return the entries that a stretch uses, each for its horizon.

    The first one holds before its own time too, so it may begin at the time base.
    """
    if not len(events):
        raise ValueError("vectors need at least one event")
    base_us = time_base_us(events, config)
    first, last = schedules[0].entry_at(np.array([events.t[0], last_asked_us(events, config)], np.int64)).tolist()
    times = np.maximum(schedules[0].t_us[first : last + 1], base_us)
    return tuple(
        MotionSchedule(times, one.coefficients[first : last + 1], horizon_us)
        for one, horizon_us in zip(schedules, config.horizons_us, strict=True)
    )


def _same(one: object, other: object, name: str) -> bool:
    return np.array_equal(getattr(one, name), getattr(other, name))


def _same_schedules(one: Schedules, other: Schedules) -> bool:
    return len(one) == len(other) and all(
        a.horizon_us == b.horizon_us and _same(a, b, "t_us") and _same(a, b, "coefficients")
        for a, b in zip(one, other, strict=True)
    )


def _same_cycles(one: CoreCycles | None, other: CoreCycles | None) -> bool:
    if one is None or other is None:
        return one is other
    return all(
        _same(one, other, name)
        for name in ("core", "clock_hz", "stamp_bits", "scrub_cycles", "dropped", "suppressed", "arrival", "decided")
    )
