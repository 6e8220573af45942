"""Count the bits that the filters must hold on a device."""

from __future__ import annotations

from dataclasses import dataclass

from tiegocancel.filters.config import FilterConfig

__all__ = ["FilterStateBits", "filter_state_bits"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterStateBits:
    """Bits of each filter's table, 0 where it is off; ``time`` is the width of a stamp."""

    time: int
    hot_pixel: int
    flicker: int
    refractory: int
    background: int

    @property
    def total(self) -> int:
        """All tables together."""
        return self.hot_pixel + self.flicker + self.refractory + self.background

    @property
    def total_kib(self) -> float:
        """All tables in KiB, before rounding to the memory blocks of a part."""
        return self.total / 8192


def filter_state_bits(config: FilterConfig, *, width: int, height: int, time_bits: int = 30) -> FilterStateBits:
    """Return the state of ``config`` for a sensor of ``width`` × ``height`` px with time stamps of ``time_bits``.

    A cell is one stamp; flicker adds polarity, mute and count, refractory by polarity has two. A stamp narrower than
    the time wraps, and a scrub must clear it before it looks recent again: twice the longest look-back must fit, or
    ``ValueError`` says how many bits that takes.
    """
    looks_us = {
        "hot_pixel": 2 * config.hot_events * config.hot_leak_us,
        "flicker": config.flicker_silence_us,
        "refractory": config.refractory_us,
        "background": config.background_us,
    }
    least = max((2 * looks_us[name] + 1).bit_length() for name in config.active) if config.active else 1
    if not least <= time_bits <= 64:
        raise ValueError(f"time_bits must be from {least} to 64 for these filters, not {time_bits}")
    cell = {
        "hot_pixel": time_bits,
        "flicker": time_bits + 2 + config.flicker_periods.bit_length(),
        "refractory": time_bits << config.refractory_by_polarity,
        "background": time_bits,
    }
    bits = {name: cell[name] * width * height if name in config.active else 0 for name in cell}
    return FilterStateBits(time=time_bits, **bits)
