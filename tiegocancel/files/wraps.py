"""Follow a clock of limited width past its wraps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Unwrapper"]


class Unwrapper:
    """Turn 32-bit times into int64 µs that go on after a wrap, from block to block.

    A fall of more than 3/4 of ``period_us`` is a wrap; a smaller one is disorder and stays. ``wraps`` counts them.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us = period_us
        self._last = -1
        self._offset_us = 0
        self.wraps = 0

    def unwrap(self, times: NDArray[Any]) -> NDArray[np.int64]:
        """Return times [n] of the clock as times of the recording."""
        if not len(times):
            return np.zeros(0, np.int64)
        clock = times.astype(np.int64)
        first = self._last if self._last >= 0 else int(clock[0])
        wrapped = np.diff(clock, prepend=first) < -(self._period_us // 4 * 3)
        offsets = self._offset_us + np.cumsum(wrapped) * self._period_us
        self._last, self._offset_us = int(clock[-1]), int(offsets[-1])
        self.wraps += int(np.count_nonzero(wrapped))
        return clock + offsets
