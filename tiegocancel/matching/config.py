"""Hold the parameters of one canceller."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

__all__ = ["MAX_GATE_US", "MAX_HORIZONS", "MAX_TOLERANCE_PX", "CancelConfig", "Polarity"]

Polarity = Literal["opposite", "equal", "ignore"]

MAX_GATE_US = (1 << 28) - 1
"""Bound of horizon and temporal gate (268 s): twice their sum must fit the 30-bit relative times of a packed cell."""

MAX_TOLERANCE_PX = 64.0
MAX_RING_CAPACITY = 1 << 28
MAX_HORIZONS = 4
MAX_SHIFT_PX = 1 << 16
"""A component of a shift counts for no more than this where shifts are compared."""

_NO_SHIFT_SQUARED = 1 << 34


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelConfig:
    """Predict ``horizon_us`` ahead, match within ``tolerance_us`` and ``tolerance_px``, both inclusive.

    ``polarity``: ``opposite`` lets an event meet predictions of its own polarity (the anti-event opposes it),
    ``equal`` those of the other, ``ignore`` all. ``ring_capacity`` bounds the pending predictions. The rest makes the
    canceller selective and small, see ``semantics.md``; the defaults are the plain rule:

    - ``more_horizons_us``: further horizons, rising, above ``horizon_us``; an event's support counts those that agree.
    - ``carry``: most support that an event hands on to its prediction; ``need``: least support that suppresses.
    - ``uses``: hits that a cell can bear, 0 for any number.
    - ``early_us`` and ``late_us``: the gate in time before and after the predicted time, ``tolerance_us`` unless given.
    - ``tick_bits``: the clock counts ``2^tick_bits`` µs; horizons and gates are whole ticks.
    - ``bin_bits``: a cell serves ``2^bin_bits`` × ``2^bin_bits`` px; ``set_bits`` (columns, rows) keeps only
      ``2^(columns + rows)`` sets of ``ways`` cells instead of one cell for every bin.
    - ``least_shift_px``: a prediction nearer than this to its event is not made.
    - ``motion_at``: predict with the motion of the ``event``'s time, or with that of the time when the ``gate`` opens.
    - ``choose_px``: predict each event over one horizon alone, the shortest that moves it so far, and give each horizon
      a ring of its own; 0 predicts over all. ``more_ring_capacities``: of the further horizons' rings, else all alike.
    - ``spread_us`` and ``spread_px``: the gate in space grows with speed, ``spread_px + speed · spread_us``, up to
      ``tolerance_px`` (thesis, eq. 5.5); both 0: it is ``tolerance_px`` everywhere.
    - ``line_px``: an event must lie so near, in x and in y, to the line along which its prediction moves through its
      gate in time; 0 asks for nothing. ``fraction_bits`` of the predicted place are kept for it below the pixel.
    - ``off_late_us`` and ``off_tolerance_px``: gates of OFF predictions, those of ON unless given.

    Raise ``ValueError`` with field, rule and value.
    """

    horizon_us: int = 8000
    tolerance_us: int = 1000
    tolerance_px: float = 2.0
    polarity: Polarity = "opposite"
    ring_capacity: int = 65_536
    more_horizons_us: tuple[int, ...] = ()
    carry: int = 0
    need: int = 1
    uses: int = 1
    early_us: int | None = None
    late_us: int | None = None
    tick_bits: int = 0
    bin_bits: int = 0
    set_bits: tuple[int, int] | None = None
    ways: int = 8
    least_shift_px: float = 0.0
    motion_at: Literal["event", "gate"] = "event"
    choose_px: float = 0.0
    more_ring_capacities: tuple[int, ...] = ()
    spread_us: int = 0
    spread_px: float = 0.0
    line_px: float = 0.0
    fraction_bits: int = 0
    off_late_us: int | None = None
    off_tolerance_px: float | None = None

    def __post_init__(self) -> None:
        for name, low, high in (
            ("horizon_us", 0, MAX_GATE_US),
            ("tolerance_us", 0, MAX_GATE_US),
            ("ring_capacity", 1, MAX_RING_CAPACITY),
            ("carry", 0, 15),
            ("uses", 0, 15),
            ("tick_bits", 0, 16),
            ("bin_bits", 0, 4),
            ("ways", 1, 64),
            ("spread_us", 0, MAX_GATE_US),
            ("fraction_bits", 0, 3),
        ):
            object.__setattr__(self, name, _whole(name, getattr(self, name), low, high))
        for name in ("early_us", "late_us", "off_late_us"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _whole(name, getattr(self, name), 0, MAX_GATE_US))
        for name in ("tolerance_px", "least_shift_px", "choose_px", "spread_px", "line_px", "off_tolerance_px"):
            if name != "off_tolerance_px" or self.off_tolerance_px is not None:
                object.__setattr__(self, name, _distance(name, getattr(self, name)))
        if self.polarity not in ("opposite", "equal", "ignore"):
            raise ValueError(f"polarity must be 'opposite', 'equal' or 'ignore', not {self.polarity!r}")
        if self.motion_at not in ("event", "gate"):
            raise ValueError(f"motion_at must be 'event' or 'gate', not {self.motion_at!r}")
        more = tuple(_whole("more_horizons_us", value, 0, MAX_GATE_US) for value in self.more_horizons_us)
        object.__setattr__(self, "more_horizons_us", more)
        if len(more) >= MAX_HORIZONS or any(b <= a for a, b in pairwise(self.horizons_us)):
            raise ValueError(f"more_horizons_us must be at most 3, rising from horizon_us, not {list(more)}")
        self._check_choice()
        if self.fraction_bits and not self.lines:
            raise ValueError(f"fraction_bits needs line_px, and must be 0, not {self.fraction_bits}")
        object.__setattr__(self, "need", _whole("need", self.need, 1, len(more) + 1 + self.carry))
        if self.set_bits is not None:
            if len(self.set_bits) != 2:
                raise ValueError(f"set_bits must be two numbers, for columns and rows, not {self.set_bits!r}")
            object.__setattr__(self, "set_bits", tuple(_whole("set_bits", value, 0, 16) for value in self.set_bits))
        tick = 1 << self.tick_bits
        if not self.is_plain and self.early_gate_us >= self.horizon_us:
            raise ValueError(
                f"early_us must be below horizon_us when the canceller is selective, not {self.early_gate_us}"
            )
        for name, value in (
            *(("horizon_us", horizon) for horizon in self.horizons_us),
            ("early_us", self.early_gate_us),
            *zip(("late_us", "off_late_us"), reversed(self.late_gates_us), strict=True),
        ):
            if value % tick:
                near = value // tick * tick
                raise ValueError(
                    f"{name} must be whole ticks of {tick} µs (tick_bits): {near} or {near + tick}, not {value}"
                )

    def _check_choice(self) -> None:
        """Refuse a choice among horizons that cannot be made, and capacities that nothing asks for."""
        capacities = tuple(
            _whole("more_ring_capacities", value, 1, MAX_RING_CAPACITY) for value in self.more_ring_capacities
        )
        object.__setattr__(self, "more_ring_capacities", capacities)
        if self.chooses and not self.more_horizons_us:
            raise ValueError(f"choose_px needs more_horizons_us to choose from, and must be 0, not {self.choose_px:g}")
        if self.chooses and self.motion_at == "gate":
            raise ValueError("choose_px needs motion_at = 'event': the choice is made when the event is stored")
        if capacities and (not self.chooses or len(capacities) != len(self.more_horizons_us)):
            raise ValueError(
                "more_ring_capacities must be one for each of more_horizons_us, under choose_px, "
                f"not {list(capacities)}"
            )

    @property
    def horizons_us(self) -> tuple[int, ...]:
        """All horizons, rising."""
        return (self.horizon_us, *self.more_horizons_us)

    def without_motion(self) -> CancelConfig:
        """Return what zero motion is tried with: the same gates and cells, and nothing that is 0 by construction.

        A least shift would forbid every prediction of "same place"; and without motion every event chooses the longest
        horizon, so that its ring holds for so long what all rings hold for theirs.
        """
        rings: tuple[int, ...] = ()
        if self.chooses:
            longest_us = self.horizons_us[-1]
            pairs = zip(self.ring_capacities, self.horizons_us, strict=True)
            room = sum(-(-held * longest_us // horizon_us) for held, horizon_us in pairs)
            rings = (min(room, MAX_RING_CAPACITY),) * len(self.more_horizons_us)
        return replace(self, least_shift_px=0.0, more_ring_capacities=rings)

    @property
    def chooses(self) -> bool:
        """Tell whether each event is predicted over one horizon of several alone."""
        return self.choose_squared_px > 0

    @property
    def ring_capacities(self) -> tuple[int, ...]:
        """Capacity of each ring: of the one that all horizons share, or of each horizon's own where events choose."""
        if not self.chooses:
            return (self.ring_capacity,)
        return (self.ring_capacity, *(self.more_ring_capacities or (self.ring_capacity,) * len(self.more_horizons_us)))

    @property
    def early_gates_us(self) -> tuple[int, int]:
        """The early gate of OFF and of ON predictions: one and the same, see *OFF* in ``semantics.md``."""
        return self.early_gate_us, self.early_gate_us

    @property
    def late_gates_us(self) -> tuple[int, int]:
        """How long after its predicted time an event may come, inclusive: of OFF and of ON predictions."""
        on = self.tolerance_us if self.late_us is None else self.late_us
        return on if self.off_late_us is None else self.off_late_us, on

    @property
    def early_gate_us(self) -> int:
        """How long before its predicted time an event may come, inclusive; then a prediction moves to its cell."""
        return self.tolerance_us if self.early_us is None else self.early_us

    @property
    def late_gate_us(self) -> int:
        """The wider late gate."""
        return max(self.late_gates_us)

    @property
    def is_plain(self) -> bool:
        """Tell whether everything beyond the plain rule is left out."""
        return (
            not self.more_horizons_us
            and (self.carry, self.need, self.uses, self.tick_bits, self.bin_bits) == (0, 1, 1, 0, 0)
            and {self.early_gate_us, *self.late_gates_us} == {self.tolerance_us}
            and self.reaches_squared_px[0] == self.reaches_squared_px[1]
            and not self.spreads
            and not self.lines
            and self.set_bits is None
            and self.least_shift_squared_px == 0
            and self.motion_at == "event"
        )

    @property
    def reaches_squared_px(self) -> tuple[int, int]:
        """Largest ``dx² + dy²`` inside the spatial gate of OFF and of ON; the slack lets ``sqrt(13)`` reach 13."""
        off_px = self.tolerance_px if self.off_tolerance_px is None else self.off_tolerance_px
        return math.floor(float(off_px) ** 2 + 1e-9), math.floor(float(self.tolerance_px) ** 2 + 1e-9)

    @property
    def reach_squared_px(self) -> int:
        """Largest ``dx² + dy²`` that is looked at, the wider of the two gates."""
        return max(self.reaches_squared_px)

    @property
    def choose_squared_px(self) -> int:
        """Least ``dx² + dy²`` that makes a horizon the chosen one."""
        return math.ceil(float(self.choose_px) ** 2 - 1e-9)

    @property
    def spreads(self) -> bool:
        """Tell whether the gate in space grows with speed."""
        return self.spread_us > 0 or self.spread_px > 0

    @property
    def lines(self) -> bool:
        """Tell whether events must lie near the line along which their prediction moves."""
        return self.line_px > 0

    @property
    def line_limit(self) -> int:
        """Largest residual from that line, in ``2^-(fraction_bits + 1)`` px times the ticks of the shortest horizon."""
        ticks = self.horizon_us >> self.tick_bits
        return math.floor(self.line_px * (2 << self.fraction_bits) * ticks + 1e-9)

    @property
    def spread_shifts_squared(self) -> tuple[int, ...]:
        """Least squared shift over the shortest horizon at which each of ``offsets`` is looked at.

        The gate is ``spread_px + shift · spread_us / horizon_us``, so that an offset ``d`` away needs a shift of
        ``(d − spread_px) · horizon_us / spread_us``, squared and rounded up to a whole number; where that is beyond
        any shift, ``2^34``.
        """
        least = []
        for dx, dy in self.offsets:
            beyond_px = math.hypot(dx, dy) - self.spread_px - 1e-9
            if not self.spreads or beyond_px <= 0:
                least.append(0)
            else:
                needed_px = beyond_px * self.horizon_us / self.spread_us if self.spread_us else math.inf
                least.append(math.ceil(min(needed_px**2, _NO_SHIFT_SQUARED)))
        return tuple(least)

    @property
    def least_shift_squared_px(self) -> int:
        """Least ``dx² + dy²`` of a prediction that is made."""
        return math.ceil(float(self.least_shift_px) ** 2 - 1e-9)

    @property
    def offsets(self) -> tuple[tuple[int, int], ...]:
        """Window of the spatial gate as ``(dx, dy)``, nearest first, then row-major: the order of preference."""
        limit = self.reach_squared_px
        side = math.isqrt(limit)
        window = [
            (dx, dy) for dy in range(-side, side + 1) for dx in range(-side, side + 1) if dx * dx + dy * dy <= limit
        ]
        return tuple(sorted(window, key=lambda offset: (offset[0] ** 2 + offset[1] ** 2, offset[1], offset[0])))

    @property
    def warm_up_us(self) -> int:
        """Time after the first event in which predictions cannot all have been met.

        The longest horizon and the late gate, as many times as support must be carried on to reach ``need``.
        """
        agreeing = 1 if self.chooses else len(self.horizons_us)
        rounds = max(self.need - agreeing + 1, 1) if self.carry else 1
        return self.horizons_us[-1] * rounds + self.late_gate_us


def _whole(name: str, value: object, low: int, high: int) -> int:
    """Return a whole number between two bounds."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not low <= int(value) <= high:  # type: ignore[call-overload]
        raise ValueError(f"{name} must be an integer from {low} to {high}, not {value!r}")
    return int(value)  # type: ignore[call-overload, no-any-return]


def _distance(name: str, value: object) -> float:
    """Return a distance on the sensor."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not 0 <= value <= MAX_TOLERANCE_PX:
        raise ValueError(f"{name} must be a number from 0 to {MAX_TOLERANCE_PX:g}, not {value!r}")
    return float(value)
