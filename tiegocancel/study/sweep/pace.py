"""Tell how far a sweep is and how long it will take."""

from __future__ import annotations

import time
from dataclasses import dataclass

__all__ = ["Pace", "Stopwatch"]


@dataclass(frozen=True, slots=True)
class Pace:
    """``done`` of ``total`` jobs, ``resumed`` of them from an earlier run; ``elapsed_s`` since this one began."""

    done: int
    total: int
    resumed: int
    elapsed_s: float

    @property
    def eta_s(self) -> float | None:
        """Seconds left at the pace of this run so far, ``None`` before its first job is done."""
        fresh = self.done - self.resumed
        return None if fresh <= 0 else self.elapsed_s / fresh * (self.total - self.done)


class Stopwatch:
    """Count jobs as they are done."""

    def __init__(self, total: int, resumed: int) -> None:
        self._total, self._resumed, self._done = total, resumed, resumed
        self._begin_s = time.perf_counter()

    def advance(self, jobs: int) -> Pace:
        """Take ``jobs`` more; return where the sweep is."""
        self._done += jobs
        return Pace(self._done, self._total, self._resumed, time.perf_counter() - self._begin_s)
