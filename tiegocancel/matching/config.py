"""Hold the parameters of one canceller."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

__all__ = ["MAX_GATE_US", "MAX_TOLERANCE_PX", "CancelConfig", "Polarity"]

Polarity = Literal["opposite", "equal", "ignore"]

MAX_GATE_US = (1 << 28) - 1
"""Bound of horizon and temporal gate (268 s): twice their sum must fit the 30-bit relative times of a packed cell."""

MAX_TOLERANCE_PX = 64.0
MAX_RING_CAPACITY = 1 << 28


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelConfig:
    """Predict ``horizon_us`` ahead, match within ``tolerance_us`` and ``tolerance_px``, both inclusive.

    ``polarity``: ``opposite`` lets an event meet predictions of its own polarity (the anti-event opposes it),
    ``equal`` those of the other, ``ignore`` all. ``ring_capacity`` bounds the pending predictions.
    Raise ``ValueError`` with field, rule and value.
    """

    horizon_us: int = 8000
    tolerance_us: int = 1000
    tolerance_px: float = 2.0
    polarity: Polarity = "opposite"
    ring_capacity: int = 65_536

    def __post_init__(self) -> None:
        for name, low, high in (
            ("horizon_us", 0, MAX_GATE_US),
            ("tolerance_us", 0, MAX_GATE_US),
            ("ring_capacity", 1, MAX_RING_CAPACITY),
        ):
            value = getattr(self, name)
            whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
            if not whole or not low <= value <= high:
                raise ValueError(f"{name} must be an integer from {low} to {high}, not {value!r}")
            object.__setattr__(self, name, int(value))
        reach = self.tolerance_px
        if (
            isinstance(reach, bool)
            or not isinstance(reach, int | float | np.number)
            or not 0 <= reach <= MAX_TOLERANCE_PX
        ):
            raise ValueError(f"tolerance_px must be a number from 0 to {MAX_TOLERANCE_PX:g}, not {reach!r}")
        object.__setattr__(self, "tolerance_px", float(reach))
        if self.polarity not in ("opposite", "equal", "ignore"):
            raise ValueError(f"polarity must be 'opposite', 'equal' or 'ignore', not {self.polarity!r}")

    @property
    def reach_squared_px(self) -> int:
        """Largest ``dx² + dy²`` inside the spatial gate; the slack lets ``sqrt(13)`` reach 13."""
        return math.floor(float(self.tolerance_px) ** 2 + 1e-9)

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
        """Time after the first event in which no prediction can have been met: horizon plus temporal gate."""
        return self.horizon_us + self.tolerance_us
