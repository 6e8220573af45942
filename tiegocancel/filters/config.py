"""Hold the parameters of the filters that a stream passes before it is cancelled."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["MAX_PERIODS", "MAX_RADIUS_PX", "MAX_SPAN_US", "FilterConfig"]

MAX_SPAN_US = (1 << 28) - 1
"""Bound of periods and windows (268 s): twice as much must fit the relative times of a packed cell."""

MAX_RADIUS_PX = 8
MAX_PERIODS = 15
MAX_HZ = 100_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterConfig:
    """Switch on and tune four filters, applied in this order; 0, the default, leaves each one out.

    Hot pixels: ``hot_events`` in ``hot_window_us`` are what a pixel may fire. Flicker: ``flicker_periods`` in a row
    between ``flicker_min_hz`` and ``flicker_max_hz`` mute a pixel; the band is that of lamps on 50 and 60 Hz mains.
    Refractory: a pixel rests for ``refractory_us`` after an event that was kept, each polarity for itself with
    ``refractory_by_polarity``. Background activity: ``background_support`` pixels no farther than
    ``background_radius_px`` in x and in y must have fired within ``background_us``.
    Each module of this package states its rule. Raise ``ValueError`` with field, rule and value.
    """

    hot_events: int = 0
    hot_window_us: int = 100_000
    flicker_periods: int = 0
    flicker_min_hz: float = 90.0
    flicker_max_hz: float = 130.0
    refractory_us: int = 0
    refractory_by_polarity: bool = False
    background_us: int = 0
    background_radius_px: int = 1
    background_support: int = 1

    def __post_init__(self) -> None:
        for name, low, high in (
            ("hot_window_us", 1, MAX_SPAN_US),
            ("hot_events", 0, self.hot_window_us),
            ("flicker_periods", 0, MAX_PERIODS),
            ("refractory_us", 0, MAX_SPAN_US),
            ("background_us", 0, MAX_SPAN_US),
            ("background_radius_px", 1, MAX_RADIUS_PX),
            ("background_support", 1, (2 * self.background_radius_px + 1) ** 2 - 1),
        ):
            self._check_whole(name, low, high)
        for name, least in (("flicker_min_hz", 1.0), ("flicker_max_hz", self.flicker_min_hz)):
            value = getattr(self, name)
            number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
            if not number or not least <= value <= MAX_HZ:
                raise ValueError(f"{name} must be a number from {least:g} to {MAX_HZ:g}, not {value!r}")
            object.__setattr__(self, name, float(value))
        if not isinstance(self.refractory_by_polarity, bool):
            raise ValueError(f"refractory_by_polarity must be true or false, not {self.refractory_by_polarity!r}")

    def _check_whole(self, name: str, low: int, high: int) -> None:
        """Refuse what is no integer of the range; store a plain int."""
        value = getattr(self, name)
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not whole or not low <= value <= high:
            raise ValueError(f"{name} must be an integer from {low} to {high}, not {value!r}")
        object.__setattr__(self, name, int(value))

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the filters that are on, in the order in which events pass them."""
        switches = {
            "hot_pixel": self.hot_events,
            "flicker": self.flicker_periods,
            "refractory": self.refractory_us,
            "background": self.background_us,
        }
        return tuple(name for name, value in switches.items() if value)

    @property
    def hot_leak_us(self) -> int:
        """Time in which a hot pixel's counter leaks one event, in whole µs."""
        return self.hot_window_us // max(self.hot_events, 1)

    @property
    def flicker_gaps_us(self) -> tuple[int, int]:
        """Shortest and longest period that counts as flicker, both inclusive."""
        return math.floor(1e6 / self.flicker_max_hz), math.ceil(1e6 / self.flicker_min_hz)

    @property
    def flicker_silence_us(self) -> int:
        """Time without an onset after which a pixel's flicker is forgotten: four of the longest periods."""
        return 4 * self.flicker_gaps_us[1]
