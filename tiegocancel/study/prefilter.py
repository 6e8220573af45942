"""Pass a stream through the filters before it is estimated or cancelled, and remember what they did."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import Any

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.filters import FilterChain, FilterConfig, FilterCounters, FilterStateBits, filter_state_bits

__all__ = ["Prefilter", "filter_numbers", "filter_text"]


class Prefilter:
    """Yield what the filters keep; without filters the chunks pass as they are.

    ``counters`` and ``state`` are ``None`` while nothing is filtered.
    """

    def __init__(self, config: FilterConfig) -> None:
        self._config = config
        self._chain: FilterChain | None = None

    @property
    def counters(self) -> FilterCounters | None:
        """What was counted so far."""
        return None if self._chain is None else self._chain.counters

    @property
    def state(self) -> FilterStateBits | None:
        """What a device must hold for the filters."""
        if self._chain is None:
            return None
        return filter_state_bits(self._config, width=self._chain.width, height=self._chain.height)

    def kept(self, chunks: Iterable[Events]) -> Iterator[Events]:
        """Yield the events of each chunk that no filter removes; chunks may be cut anywhere."""
        if not self._config.active:
            yield from chunks
            return
        for chunk in chunks:
            if self._chain is None:
                self._chain = FilterChain(self._config, width=chunk.width, height=chunk.height)
            yield chunk.select(self._chain.process(chunk))

    def check_something_left(self) -> None:
        """Raise ``ConfigError`` when events came and the filters removed them all."""
        counters = self.counters
        if counters is not None and counters.events and not counters.kept:
            raise ConfigError(f"the filters ({', '.join(self._config.active)}) removed all {counters.events:,} events")


def filter_numbers(counters: FilterCounters | None, state: FilterStateBits | None) -> dict[str, Any] | None:
    """Return counters and bits of state for JSON, ``None`` where nothing was filtered."""
    if counters is None or state is None:
        return None
    return {**dict(counters), "state_bits": asdict(state), "kib": state.total_kib}


def filter_text(counters: FilterCounters, state: FilterStateBits) -> str:
    """Say in a line what the filters removed; filters that removed nothing are left out."""
    names = {"hot_pixel": "hot pixels", "flicker": "flicker", "refractory": "refractory", "background": "background"}
    parts = [f"{label} {counters[name]:,}" for name, label in names.items() if counters[name]]
    removed = counters.events - counters.kept
    told = f" ({', '.join(parts)})" if parts else ""
    return f"{removed:,} of {counters.events:,} events removed{told}; state {state.total_kib:,.0f} KiB"
