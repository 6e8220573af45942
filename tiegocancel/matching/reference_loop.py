"""Run Algorithm 1 event by event, with the data structures that it names: slow, and as near to the page as it gets."""

from __future__ import annotations

import heapq
from collections import deque

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.forecast import Forecast
from tiegocancel.matching.pairing import pair_up
from tiegocancel.matching.reference import ReferenceResult, finish
from tiegocancel.matching.reference_config import ReferenceConfig
from tiegocancel.motion.rotation import RotationTrajectory

__all__ = ["run_printed_loop"]


def run_printed_loop(events: Events, motion: RotationTrajectory, config: ReferenceConfig) -> ReferenceResult:
    """Return what :func:`tiegocancel.matching.reference.run_reference` returns; ``release`` must be ``printed``."""
    if config.release != "printed":
        raise ValueError(f"release must be 'printed' in the printed loop, not {config.release!r}")
    loop = _Loop(Forecast.of(events, motion, config), config)
    for row in range(len(events)):
        loop.take(row)
    return finish(loop.forecast, loop.matches, loop.stale)


class _Loop:
    """Hold PredQ, RealBuf and the two indices into it; comments give the lines of the algorithm."""

    def __init__(self, forecast: Forecast, config: ReferenceConfig) -> None:
        self.forecast, self.config = forecast, config
        self.matches: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]] = []
        self.stale = 0
        self._pred_q: list[tuple[int, int]] = []  # 1: min-heap keyed by t'; equal times leave in the order of events
        self._real_buf: deque[int] = deque()  # 2

    def take(self, row: int) -> None:
        """Take one event: lines 3 to 23."""
        now = int(self.forecast.t_us[row])
        if self.forecast.made[row]:  # 4, 5
            heapq.heappush(self._pred_q, (int(self.forecast.due_us[row]), row))  # 6
        self._real_buf.append(row)  # 7
        while self._pred_q and self._pred_q[0][0] <= now:  # 8
            popped = self._pop_all_within(now)  # 9
            if not popped:
                continue
            window = self._window(popped)  # 10
            if not len(window):
                continue
            real, source, far = pair_up(window, np.array(popped, np.int64), self.forecast, self.config)  # 11 to 19
            self.matches.append((real, source, far))  # 20
            gone = set(real.tolist())
            if gone:
                self._real_buf = deque(j for j in self._real_buf if j not in gone)  # 21

    def _pop_all_within(self, now: int) -> list[int]:
        """Pop all predictions up to ``now + ε_t``; return those not older than ``now − ε_t``."""
        popped = []
        while self._pred_q and self._pred_q[0][0] <= now + self.config.tolerance_us:
            due_us, row = heapq.heappop(self._pred_q)
            if due_us >= now - self.config.tolerance_us:
                popped.append(row)
            else:
                self.stale += 1
        return popped

    def _window(self, popped: list[int]) -> NDArray[np.int64]:
        """Advance L and R: drop what is too old for every later prediction, return what is within ε_t of one popped."""
        t, gate_us = self.forecast.t_us, self.config.tolerance_us
        first_us = int(self.forecast.due_us[popped[0]]) - gate_us
        last_us = int(self.forecast.due_us[popped[-1]]) + gate_us
        while self._real_buf and t[self._real_buf[0]] < first_us:
            self._real_buf.popleft()
        return np.array([row for row in self._real_buf if t[row] <= last_us], np.int64)
