"""Hold the parameters of one canceller."""

from __future__ import annotations

import math
from dataclasses import dataclass
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
        ):
            object.__setattr__(self, name, _whole(name, getattr(self, name), low, high))
        for name in ("early_us", "late_us"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _whole(name, getattr(self, name), 0, MAX_GATE_US))
        for name in ("tolerance_px", "least_shift_px"):
            object.__setattr__(self, name, _distance(name, getattr(self, name)))
        if self.polarity not in ("opposite", "equal", "ignore"):
            raise ValueError(f"polarity must be 'opposite', 'equal' or 'ignore', not {self.polarity!r}")
        if self.motion_at not in ("event", "gate"):
            raise ValueError(f"motion_at must be 'event' or 'gate', not {self.motion_at!r}")
        more = tuple(_whole("more_horizons_us", value, 0, MAX_GATE_US) for value in self.more_horizons_us)
        object.__setattr__(self, "more_horizons_us", more)
        if len(more) >= MAX_HORIZONS or any(b <= a for a, b in pairwise(self.horizons_us)):
            raise ValueError(f"more_horizons_us must be at most 3, rising from horizon_us, not {list(more)}")
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
            ("late_us", self.late_gate_us),
        ):
            if value % tick:
                near = value // tick * tick
                raise ValueError(
                    f"{name} must be whole ticks of {tick} µs (tick_bits): {near} or {near + tick}, not {value}"
                )

    @property
    def horizons_us(self) -> tuple[int, ...]:
        """All horizons, rising."""
        return (self.horizon_us, *self.more_horizons_us)

    @property
    def early_gate_us(self) -> int:
        """How long before its predicted time an event may come, inclusive."""
        return self.tolerance_us if self.early_us is None else self.early_us

    @property
    def late_gate_us(self) -> int:
        """How long after its predicted time an event may come, inclusive."""
        return self.tolerance_us if self.late_us is None else self.late_us

    @property
    def is_plain(self) -> bool:
        """Tell whether everything beyond the plain rule is left out."""
        return (
            not self.more_horizons_us
            and (self.carry, self.need, self.uses, self.tick_bits, self.bin_bits) == (0, 1, 1, 0, 0)
            and (self.early_gate_us, self.late_gate_us) == (self.tolerance_us, self.tolerance_us)
            and self.set_bits is None
            and self.least_shift_squared_px == 0
            and self.motion_at == "event"
        )

    @property
    def reach_squared_px(self) -> int:
        """Largest ``dx² + dy²`` inside the spatial gate; the slack lets ``sqrt(13)`` reach 13."""
        return math.floor(float(self.tolerance_px) ** 2 + 1e-9)

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
        rounds = max(self.need - len(self.horizons_us) + 1, 1) if self.carry else 1
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
