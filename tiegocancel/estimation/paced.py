"""Keep an estimator on a live stream from taking more time than there is."""

from __future__ import annotations

import time
from collections.abc import Callable

from tiegocancel.estimation.estimate import Estimator, MotionEstimate
from tiegocancel.events import Events

__all__ = ["PacedEstimator"]


class PacedEstimator:
    """Let an estimator look at whole stretches of a stream, and at fewer of them where it is too slow for all.

    It is given at most ``share`` of the stream's own time: a stretch of ``stretch_us`` at least, then nothing until
    what that took is made good. What it does not see it cannot tell, so that the motion soon counts as unknown and
    nothing is suppressed: a slow machine lets events through, it does not lag. ``skipped`` of ``events`` were not
    looked at.
    ``now_s`` is the clock that the estimator is timed by.
    """

    def __init__(
        self,
        estimator: Estimator,
        *,
        share: float = 0.5,
        stretch_us: int = 60_000,
        now_s: Callable[[], float] = time.perf_counter,
    ) -> None:
        if not 0.0 < share <= 1.0:
            raise ValueError(f"share must lie in (0, 1], not {share}")
        self._estimator, self._share, self._stretch_us, self._now_s = estimator, share, stretch_us, now_s
        self._saved_s = 0.0
        self._last_us: int | None = None
        self._since_us: int | None = None
        self.events = self.skipped = 0

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the rows that became due, none where it is skipped."""
        if not len(events):
            return []
        first_us, last_us = int(events.t[0]), int(events.t[-1])
        before_us = first_us if self._last_us is None else self._last_us
        self._last_us = last_us
        # At most one stretch is saved up: a quiet minute does not pay for a slow one.
        most_s = self._share * self._stretch_us * 1e-6
        self._saved_s = min(self._saved_s + self._share * (last_us - before_us) * 1e-6, most_s)
        self.events += len(events)
        if self._since_us is None and self._saved_s >= 0.0:
            self._since_us = first_us
        if self._since_us is None:
            self.skipped += len(events)
            return []
        started_s = self._now_s()
        rows = self._estimator.process(events)
        self._saved_s -= self._now_s() - started_s
        if self._saved_s < 0.0 and last_us - self._since_us >= self._stretch_us:
            self._since_us = None
        return rows

    def notes(self) -> list[str]:
        """Say how much was not looked at."""
        if not self.skipped:
            return []
        return [
            f"the motion was looked for in {1 - self.skipped / self.events:.0%} of the events: the machine is too slow "
            "for all (a longer --step-us or fewer --window-events take less)"
        ]
