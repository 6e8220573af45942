"""Run a sweep: what is not done yet, in batches, results appended as they come."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

from tiegocancel.interrupt import deferred_interrupt
from tiegocancel.study.sweep.engine import Batch, Engine, Task
from tiegocancel.study.sweep.job import Job, Row, job_key
from tiegocancel.study.sweep.pace import Pace, Stopwatch
from tiegocancel.study.sweep.store import ResultStore

__all__ = ["SweepResult", "run_sweep"]


@dataclass(frozen=True, slots=True)
class SweepResult:
    """``rows`` in the order of the jobs, ``None`` where an interrupt came first; how many were ``resumed`` and ``run``.

    Equal jobs are run once and share their row.
    """

    rows: tuple[Row | None, ...]
    resumed: int
    run: int
    interrupted: bool


def run_sweep(
    task: Task,
    jobs: Sequence[Job],
    engine: Engine,
    store: ResultStore,
    *,
    basis: str = "",
    batch_size: int = 1,
    together: Callable[[Job], Hashable] = lambda job: None,
    progress: Callable[[Pace], None] | None = None,
) -> SweepResult:
    """Run the jobs that ``store`` does not hold yet; return the rows of all.

    ``basis`` names the data and the code that a row depends on beside its job: rows of another basis are not taken.
    Batches hold up to ``batch_size`` jobs that ``together`` maps to one value, in their order. The first Ctrl-C ends
    the sweep after what is under way.
    """
    if batch_size < 1:
        raise ValueError(f"batch_size must be at least 1, not {batch_size}")
    keys = [job_key(job, basis) for job in jobs]
    missing = {key: job for key, job in zip(keys, jobs, strict=True) if key not in store.rows}
    resumed = len(set(keys)) - len(missing)
    watch = Stopwatch(len(set(keys)), resumed)
    run = 0
    with deferred_interrupt() as interrupt:
        if progress is not None:
            progress(watch.advance(0))
        batches = _batches(list(missing.values()), batch_size, together)
        for batch, rows in engine.run(task, batches, lambda: interrupt.wanted):
            store.add((job_key(job, basis), job, row) for job, row in zip(batch, rows, strict=True))
            run += len(rows)
            if progress is not None:
                progress(watch.advance(len(rows)))
        interrupted = interrupt.wanted
    return SweepResult(tuple(store.rows.get(key) for key in keys), resumed, run, interrupted)


def _batches(jobs: Sequence[Job], size: int, together: Callable[[Job], Hashable]) -> list[Batch]:
    """Cut jobs into batches of one kind each, kinds in the order in which they first come."""
    kinds: dict[Hashable, list[Job]] = {}
    for job in jobs:
        kinds.setdefault(together(job), []).append(job)
    return [tuple(kind[first : first + size]) for kind in kinds.values() for first in range(0, len(kind), size)]
