"""Run a sweep in several processes of this machine."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from typing import Any

from tiegocancel.errors import TiegoCancelError
from tiegocancel.study.sweep.engine import Batch, Task
from tiegocancel.study.sweep.job import Row

__all__ = ["MAX_ATTEMPTS", "Processes"]

MAX_ATTEMPTS = 4
"""A batch that was under way in so many deaths of a worker is taken for their cause."""

_AHEAD = 2  # batches handed out for each worker: one to run and one to go on with

_installed: Task | None = None


class Processes:
    """Run batches in ``workers`` fresh processes (spawn: never fork a process that has started the kernels).

    Each worker uses one thread of its own. A worker that dies takes the pool with it; a new pool goes on with what was
    not finished.
    """

    def __init__(self, workers: int) -> None:
        if not 1 <= workers <= 1024:
            raise ValueError(f"workers must be from 1 to 1024, not {workers}")
        self.workers = workers

    def run(self, task: Task, batches: Sequence[Batch], stop: Callable[[], bool]) -> Iterator[tuple[Batch, list[Row]]]:
        """Yield each batch with its rows, as they finish."""
        waiting: deque[tuple[Batch, int]] = deque((batch, 1) for batch in batches)
        while waiting and not stop():
            with ProcessPoolExecutor(
                self.workers, mp_context=get_context("spawn"), initializer=_install, initargs=(task,)
            ) as pool:
                try:
                    yield from self._until_broken(pool, waiting, stop)
                finally:
                    pool.shutdown(wait=False, cancel_futures=True)

    def _until_broken(
        self, pool: ProcessPoolExecutor, waiting: deque[tuple[Batch, int]], stop: Callable[[], bool]
    ) -> Iterator[tuple[Batch, list[Row]]]:
        """Run until all is done, or until the pool breaks: then what was under way is back in ``waiting``."""
        under_way: dict[Future[list[Row]], tuple[Batch, int]] = {}
        broken = False
        while (waiting and not broken and not stop()) or under_way:
            while waiting and not broken and not stop() and len(under_way) < _AHEAD * self.workers:
                batch, attempt = waiting.popleft()
                try:
                    under_way[pool.submit(_run_installed, batch)] = (batch, attempt)
                except BrokenProcessPool:
                    waiting.appendleft((batch, attempt))
                    broken = True
            done, _ = wait(under_way, return_when=FIRST_COMPLETED)
            for future in done:
                batch, attempt = under_way.pop(future)
                try:
                    rows = future.result()
                except BrokenProcessPool:
                    broken = True
                    if attempt >= MAX_ATTEMPTS:
                        raise TiegoCancelError(
                            f"sweep: a worker died {attempt} times while {len(batch)} jobs were under way, the first "
                            f"of them {dict(batch[0])}"
                        ) from None
                    waiting.append((batch, attempt + 1))
                else:
                    yield batch, rows


def _install(task: Task) -> None:
    """Keep the task in a new worker, which shares the machine with others and ends with its sweep."""
    global _installed
    # A worker of a sweep that was killed would wait for its next batch for ever.
    threading.Thread(target=_end_with, args=(parent_process(),), daemon=True).start()
    os.environ.setdefault("TIEGOCANCEL_THREADS", "1")
    _installed = task


def _end_with(parent: Any) -> None:
    """End this process when the one that started it does."""
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_installed(batch: Batch) -> list[Row]:
    assert _installed is not None  # the pool's initializer ran
    return _installed(batch)
