"""Propose operating points of the canceller for a recording whose edges move at a known speed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from tiegocancel.matching.config import CancelConfig

__all__ = ["Pace", "Proposal", "grid", "neighbour", "reads_per_event"]

_TICK_PX = 0.5
_CHOICES: dict[str, tuple[Any, ...]] = {
    "travel_px": (3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 20.0),
    "gate_px": (1.0, 1.5, 2.0, 2.5, 3.0, 3.5),
    "radius_squared": (0, 1, 2, 4),
    "bin_bits": (0, 1, 2),
    "carry": (0, 1, 3, 7),
    "need": (1, 2, 3, 4, 5, 6),
    "uses": (0, 1),
    "sets": (None, 1, 0, -1, -2),
    "ways": (4, 8),
    "second": (1.0, 1.33, 2.0),
    "choose_px": (0.0, 3.0, 4.0, 5.0, 6.0),
    "line_px": (0.0, 2.0, 1.5, 1.25, 1.0),
}
"""What each field may be, neighbours side by side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """Say how fast a recording goes: ``us_per_px`` that an edge at the rim needs for a pixel, ``rate_hz`` of events."""

    us_per_px: float
    rate_hz: float

    def __post_init__(self) -> None:
        for name in ("us_per_px", "rate_hz"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ValueError(f"{name} must be positive and finite, not {value!r}")

    @property
    def tick_bits(self) -> int:
        """A tick of at most half a pixel: an edge crosses the lattice no more sharply than that."""
        return min(max(math.floor(math.log2(max(_TICK_PX * self.us_per_px, 1.0))), 0), 16)

    def ticks_us(self, travel_px: float) -> int:
        """Return the time for a distance in whole ticks, at least one."""
        tick = 1 << self.tick_bits
        return max(round(travel_px * self.us_per_px / tick), 1) * tick


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """Name an operating point in the recording's own measure.

    ``travel_px`` at the rim within the horizon, ``gate_px`` within each side of the gate in time, ``radius_squared``
    of the gate in space, ``second`` / first horizon (1: only one). ``sets``: doublings of the number of sets beyond
    what the open predictions fill at the mean rate, ``None`` for a cell each. ``choose_px``: where there are two
    horizons, each event takes the first that moves it so far. The rest is ``CancelConfig``'s.
    """

    travel_px: float = 12.0
    gate_px: float = 2.5
    radius_squared: int = 1
    bin_bits: int = 1
    carry: int = 3
    need: int = 4
    uses: int = 0
    sets: int | None = 0
    ways: int = 8
    second: float = 1.0
    choose_px: float = 0.0
    line_px: float = 0.0

    def config(self, pace: Pace, *, ring_capacity: int = 1 << 20) -> CancelConfig:
        """Return the configuration; raise ``ValueError`` where the fields contradict each other."""
        horizon_us, gate_us = pace.ticks_us(self.travel_px), pace.ticks_us(self.gate_px)
        more_us = pace.ticks_us(self.travel_px * self.second)
        return CancelConfig(
            horizon_us=horizon_us,
            more_horizons_us=(more_us,) if more_us > horizon_us else (),
            early_us=gate_us,
            late_us=gate_us,
            tolerance_us=gate_us,
            tolerance_px=math.sqrt(self.radius_squared),
            carry=self.carry,
            need=self.need,
            uses=self.uses,
            tick_bits=pace.tick_bits,
            bin_bits=self.bin_bits,
            set_bits=self._set_bits(2 * gate_us * 1e-6 * pace.rate_hz),
            ways=self.ways,
            least_shift_px=1.0,
            choose_px=self.choose_px if more_us > horizon_us else 0.0,
            line_px=self.line_px,
            ring_capacity=ring_capacity,
        )

    def _set_bits(self, open_predictions: float) -> tuple[int, int] | None:
        """Return the columns and rows of sets whose cells hold so many predictions, ``None`` for a cell each."""
        if self.sets is None:
            return None
        bits = round(math.log2(max(open_predictions / self.ways, 1.0))) + self.sets
        bits = min(max(bits, 0), 20)
        return bits - bits // 2, bits // 2


def grid() -> Iterator[Proposal]:
    """Yield the proposals that every search begins with, the most telling first."""
    near = Proposal()
    own = replace(near, radius_squared=0, need=3)
    dense = replace(near, radius_squared=2, bin_bits=0, sets=None)
    for travel_px in (12.0, 8.0, 10.0, 6.0, 4.0, 16.0):
        for shape in (near, own, dense):
            yield replace(shape, travel_px=travel_px)
        if travel_px in (8.0, 10.0):
            yield replace(near, travel_px=6.0, second=2.0, choose_px=4.0 if travel_px == 8.0 else 3.0)
        # Support takes several horizons to build up; a short recording has time for the plain latch only.
        if travel_px in (8.0, 4.0):
            yield replace(dense, travel_px=travel_px, carry=0, need=1, gate_px=1.0)
    for line_px in (1.5, 1.0):
        yield replace(near, travel_px=12.0, line_px=line_px)
    for shape in (near, own):
        for changes in ({"sets": -1}, {"sets": None}, {"gate_px": 2.0}, {"need": 2}, {"carry": 7, "need": 6}):
            yield replace(shape, travel_px=10.0, **changes)


def neighbour(proposal: Proposal, rng: np.random.Generator) -> Proposal:
    """Return the proposal with one or two fields moved to a value beside their own."""
    names = [field.name for field in fields(proposal)]
    for _ in range(int(rng.integers(1, 3))):
        name = names[int(rng.integers(len(names)))]
        choices = _CHOICES[name]
        place = choices.index(getattr(proposal, name)) + (1 if rng.random() < 0.5 else -1)
        proposal = replace(proposal, **{name: choices[min(max(place, 0), len(choices) - 1)]})
    horizons = 1 if proposal.second <= 1.0 else 2
    return replace(proposal, need=min(proposal.need, horizons + proposal.carry))


def reads_per_event(config: CancelConfig) -> int:
    """Return the most words of the table that the gate in space makes one event read; a set's ways are one word."""
    side = 1 << config.bin_bits
    return max(
        len({((x + dx) >> config.bin_bits, (y + dy) >> config.bin_bits) for dx, dy in config.offsets})
        for x in range(side)
        for y in range(side)
    )
