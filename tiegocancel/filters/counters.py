"""Count what the filters did."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

__all__ = ["FilterCounters"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterCounters:
    """Count since the start of the stream; reads as attributes or as a mapping.

    ``events`` seen, ``kept`` of them, then those that each filter removed from what the filters before it had left.
    ``events = kept + hot_pixel + flicker + refractory + background`` always holds.
    """

    events: int = 0
    kept: int = 0
    hot_pixel: int = 0
    flicker: int = 0
    refractory: int = 0
    background: int = 0

    def keys(self) -> Iterator[str]:
        """Name the counts, so that ``dict(counters)`` works."""
        return (field.name for field in fields(self))

    def __getitem__(self, name: str) -> int:
        if name not in self.keys():
            raise KeyError(name)
        return int(getattr(self, name))
