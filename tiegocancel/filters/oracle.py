"""State the four rules plainly, one event at a time: the models that every implementation must equal bit for bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.filters.config import FilterConfig
from tiegocancel.filters.counters import FilterCounters

__all__ = ["OracleBackground", "OracleChain", "OracleFlicker", "OracleHotPixel", "OracleRefractory"]


class _Rule(Protocol):
    def keep(self, t: int, x: int, y: int, p: int) -> bool: ...


class OracleHotPixel:
    """Hold each pixel's counter in µs: an event adds ``hot_leak_us``, each µs takes one away."""

    def __init__(self, config: FilterConfig) -> None:
        self._config = config
        self._counters: dict[tuple[int, int], tuple[int, int]] = {}  # level after the last event, its time

    def keep(self, t: int, x: int, y: int, p: int) -> bool:
        """Count the event; tell whether its pixel is not hot."""
        limit = self._config.hot_events * self._config.hot_leak_us
        level, last = self._counters.get((x, y), (0, t))
        level = min(max(level - (t - last), 0) + self._config.hot_leak_us, 2 * limit)
        self._counters[x, y] = (level, t)
        return level <= limit


@dataclass(slots=True)
class _Light:
    """What a pixel knows of its light."""

    onset_us: int | None = None
    polarity: int = 0
    count: int = 0
    muted: bool = False


class OracleFlicker:
    """Follow each pixel's onsets."""

    def __init__(self, config: FilterConfig) -> None:
        self._config = config
        self._lights: dict[tuple[int, int], _Light] = {}

    def keep(self, t: int, x: int, y: int, p: int) -> bool:
        """Follow the event; tell whether its pixel does not flicker."""
        shortest, longest = self._config.flicker_gaps_us
        light = self._lights.setdefault((x, y), _Light())
        if light.onset_us is None or t - light.onset_us > self._config.flicker_silence_us:
            light.count, light.muted = 0, False
        if p == 1 and light.polarity == 0:
            regular = light.onset_us is not None and shortest <= t - light.onset_us <= longest
            light.count = min(light.count + 1, self._config.flicker_periods) if regular else max(light.count - 1, 0)
            if light.count == self._config.flicker_periods:
                light.muted = True
            elif light.count == 0:
                light.muted = False
            light.onset_us = t
        light.polarity = p
        return not light.muted


class OracleRefractory:
    """Remember each pixel's last event that was kept."""

    def __init__(self, config: FilterConfig) -> None:
        self._config = config
        self._kept_us: dict[tuple[int, int, int], int] = {}

    def keep(self, t: int, x: int, y: int, p: int) -> bool:
        """Tell whether the pixel has rested long enough; only then does it rest anew."""
        key = (x, y, p if self._config.refractory_by_polarity else 0)
        if key in self._kept_us and t - self._kept_us[key] < self._config.refractory_us:
            return False
        self._kept_us[key] = t
        return True


class OracleBackground:
    """Remember each pixel's last event."""

    def __init__(self, config: FilterConfig) -> None:
        self._config = config
        self._last_us: dict[tuple[int, int], int] = {}

    def keep(self, t: int, x: int, y: int, p: int) -> bool:
        """Tell whether enough neighbours fired lately; then remember the event."""
        reach = range(-self._config.background_radius_px, self._config.background_radius_px + 1)
        lasts = [self._last_us.get((x + dx, y + dy)) for dy in reach for dx in reach if dx or dy]
        support = sum(last is not None and t - last <= self._config.background_us for last in lasts)
        self._last_us[x, y] = t
        return support >= self._config.background_support


_RULES: dict[str, Callable[[FilterConfig], _Rule]] = {
    "hot_pixel": OracleHotPixel,
    "flicker": OracleFlicker,
    "refractory": OracleRefractory,
    "background": OracleBackground,
}


class OracleChain:
    """Ask the rules that are on, in order, until one removes the event."""

    def __init__(self, config: FilterConfig) -> None:
        self._rules: dict[str, _Rule] = {name: _RULES[name](config) for name in config.active}
        self._counts = dict(FilterCounters())

    @property
    def counters(self) -> FilterCounters:
        """Return the counts so far."""
        return FilterCounters(**self._counts)

    def process(self, events: Events) -> NDArray[np.bool_]:
        """Decide every event of a chunk; chunks may be cut anywhere."""
        kept = np.ones(len(events), np.bool_)
        for i in range(len(events)):
            t, x, y, p = int(events.t[i]), int(events.x[i]), int(events.y[i]), int(events.p[i])
            by = next((name for name, rule in self._rules.items() if not rule.keep(t, x, y, p)), "kept")
            kept[i] = by == "kept"
            self._counts[by] += 1
            self._counts["events"] += 1
        return kept
