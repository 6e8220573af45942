"""Try one operating point on a labelled stretch: true motion, no motion, reversed motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import EGO, MOVER, Events
from tiegocancel.firmware_sim.state import state_bits
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.study.feed import MotionFeed
from tiegocancel.study.plan_candidates import reads_per_event

__all__ = ["Bound", "Course", "Trial"]

HEADROOM = 1.25
"""Ring capacity over the most entries that were ever pending."""

_PREFIX_SHARE = 1 / 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Bound:
    """What is known of a trial that is under way: at least ``kib`` and ``reads``, ``margin`` = ego − mover so far.

    ``whole`` tells whether the true motion has been run to the end; then no score above ``margin`` can come out.
    """

    kib: float
    reads: int
    margin: float
    whole: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What one operating point does: shares of events suppressed and what a device must hold and read.

    ``ego`` and ``mover`` under the true motion, ``zero`` and ``reversed`` ego events under those motions. The ring of
    ``config`` holds the most entries that were pending, and a quarter more.
    """

    name: str
    config: CancelConfig
    ego: float
    mover: float
    zero: float
    reversed: float
    high_water: int
    kib: float
    reads: int

    @property
    def score(self) -> float:
        """Ego events suppressed, less the worst of the mover's loss and what wrong motions suppress."""
        return self.ego - max(self.mover, self.zero, self.reversed)

    @property
    def selectivity(self) -> float:
        """``J`` = share of ego events suppressed − share of mover events suppressed."""
        return self.ego - self.mover

    def to_json(self) -> dict[str, Any]:
        """Return everything as JSON holds it."""
        return asdict(self) | {"score": self.score, "selectivity": self.selectivity}


class Course:
    """Run operating points over the same events; those before ``counted_from_us`` count for none of them.

    ``events`` are labelled ego and mover. The control without motion makes the predictions that move too little as
    well (``least_shift_px``): left out, they would make it 0 for every gate, and it would show nothing.
    """

    def __init__(self, events: Events, feed: MotionFeed, *, counted_from_us: int, step_us: int) -> None:
        if events.label is None:
            raise ValueError("events must carry labels, or nothing tells ego from mover")
        self.events, self.counted_from_us = events, counted_from_us
        self._feed = feed
        self._span = {"start_us": int(events.t[0]), "stop_us": int(events.t[-1]), "step_us": step_us}
        self._counted = events.t >= counted_from_us
        self._schedules: dict[tuple[int, bool], MotionSchedule] = {}

    def counted(self, label: int) -> int:
        """Return how many events of a label count."""
        return int(np.count_nonzero(self._counted & (self.events.label == label)))

    def serves(self, config: CancelConfig) -> bool:
        """Tell whether an operating point is warm before events count."""
        return int(self.events.t[0]) + config.warm_up_us <= self.counted_from_us

    def run(self, name: str, config: CancelConfig, *, hopeless: Callable[[Bound], bool] | None = None) -> Trial | None:
        """Return the trial; ``None`` as soon as ``hopeless`` says of what is known so far that it is not worth it."""
        config = replace(config, ring_capacity=self._most_pending(config))
        events = self.events
        cut = self._prefix()
        canceller = self._canceller(config, self._motion(config, backwards=False))
        suppressed = canceller.process(events[:cut]).suppressed
        for whole in (False, True):
            if whole:
                suppressed = np.concatenate([suppressed, canceller.process(events[cut:]).suppressed])
            ego, mover = self._share(suppressed, EGO), self._share(suppressed, MOVER)
            sized = _sized(config, canceller.most_held)
            kib = state_bits(sized, width=events.width, height=events.height).total_kib
            reads = reads_per_event(config)
            if hopeless is not None and hopeless(Bound(kib=kib, reads=reads, margin=ego - mover, whole=whole)):
                return None
        # Gates and cells are the same; only what "too near" discards must not hide what the gates let through.
        zero = self._canceller(config.without_motion(), MotionSchedule.still()).process(events).suppressed
        back = self._canceller(config, self._motion(config, backwards=True)).process(events).suppressed
        return Trial(
            name=name,
            config=sized,
            ego=ego,
            mover=mover,
            zero=self._share(zero, EGO),
            reversed=self._share(back, EGO),
            high_water=canceller.counters.ring_high_water,
            kib=kib,
            reads=reads,
        )

    def _prefix(self) -> int:
        """Return the row up to which a first look goes."""
        first = int(np.searchsorted(self.events.t, self.counted_from_us, side="left"))
        return first + math.ceil(_PREFIX_SHARE * (len(self.events) - first))

    def _share(self, suppressed: NDArray[np.bool_], label: int) -> float:
        """Return the share suppressed among the counted events of a label, 0 where there are none."""
        assert self.events.label is not None
        seen = len(suppressed)
        chosen = self._counted[:seen] & (self.events.label[:seen] == label)
        return float(suppressed[chosen].mean()) if chosen.any() else 0.0

    def _canceller(self, config: CancelConfig, motion: MotionSchedule | Schedules) -> Canceller:
        return Canceller(config, motion, width=self.events.width, height=self.events.height, track_source=False)

    def _motion(self, config: CancelConfig, *, backwards: bool) -> Schedules:
        """Return the schedules of all horizons, made once each."""
        for horizon_us in config.horizons_us:
            if (horizon_us, backwards) not in self._schedules:
                made = self._feed.backwards if backwards else self._feed.schedule
                self._schedules[horizon_us, backwards] = made(horizon_us, **self._span)
        return tuple(self._schedules[horizon_us, backwards] for horizon_us in config.horizons_us)

    def _most_pending(self, config: CancelConfig) -> int:
        """Return a capacity that cannot overflow: the most events within the longest horizon."""
        t = self.events.t
        span_us = config.horizons_us[-1] + (2 << config.tick_bits)
        oldest = np.searchsorted(t, t - span_us, side="left")
        return int((np.arange(len(t)) - oldest).max()) + 1


def _sized(config: CancelConfig, most_held: tuple[int, ...]) -> CancelConfig:
    """Return the configuration with rings for what they held, and :data:`HEADROOM`."""
    first, *more = (max(math.ceil(HEADROOM * held), 1) for held in most_held)
    return replace(config, ring_capacity=first, more_ring_capacities=tuple(more))
