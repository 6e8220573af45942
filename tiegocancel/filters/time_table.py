"""Keep one packed time a cell in 32 bits for streams of any length."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["TimeTable"]


class TimeTable:
    """Hold ``cells`` uint32[size], a relative time above ``flag_bits`` of flags; a cell of time 0 means long ago.

    Events lie between ``span_us`` and twice as much after the base, so that "long ago" is at least ``span_us`` before
    any of them: a filter that looks back less far needs no valid bit. The base moves when an event would lie later;
    times that end below it become 0, which is what keeps a wrapped time from ever looking recent.
    """

    def __init__(self, size: int, *, span_us: int, flag_bits: int = 0) -> None:
        if size >= 1 << 31:
            raise ValueError(f"a table of {size} cells is beyond 2^31")
        self.cells = np.zeros(size, np.uint32)
        self._span_us, self._flag_bits = span_us, flag_bits
        self._base_us: int | None = None

    def launches(self, t: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
        """Cut a chunk where the base must move; yield first row, number of rows and base of each launch."""
        first = 0
        while first < len(t):
            now_us = int(t[first])
            base_us = self._base_us
            if base_us is None or now_us >= base_us + 2 * self._span_us:
                base_us = self._move_base(now_us - self._span_us)
            limit = base_us + 2 * self._span_us
            last = len(t) if int(t[-1]) < limit else int(np.searchsorted(t, limit, side="left"))
            yield first, last - first, base_us
            first = last

    def _move_base(self, base_us: int) -> int:
        """Count from ``base_us`` on; the flags stay."""
        if self._base_us is not None:
            shift = min(base_us - self._base_us, (1 << 32 - self._flag_bits) - 1)
            times = self.cells >> np.uint32(self._flag_bits)
            times -= np.minimum(times, np.uint32(shift))
            self.cells &= np.uint32((1 << self._flag_bits) - 1)
            self.cells |= times << np.uint32(self._flag_bits)
        self._base_us = base_us
        return base_us
