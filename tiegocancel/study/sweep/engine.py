"""Say what a sweep runs and what runs it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from tiegocancel.study.sweep.job import Job, Row

__all__ = ["Batch", "Engine", "Task", "checked"]

Batch = tuple[Job, ...]
"""Jobs that are run by one call, because together they cost less."""


@dataclass(frozen=True, slots=True)
class Task:
    """Run a batch: ``function(context, jobs)`` returns a row for each job, in their order.

    ``function`` is at the top level of a module and ``context`` can be pickled, so that both reach other processes;
    keep the context small (paths, settings) and cache what it stands for inside the function's module.
    """

    function: Callable[[Any, Sequence[Job]], Sequence[Row]]
    context: Any = None

    def __call__(self, batch: Batch) -> list[Row]:
        """Return the rows of a batch, one for each job."""
        return checked(batch, self.function(self.context, batch))


class Engine(Protocol):
    """Run batches somewhere."""

    def run(self, task: Task, batches: Sequence[Batch], stop: Callable[[], bool]) -> Iterator[tuple[Batch, list[Row]]]:
        """Yield each batch with its rows, in any order, each once; begin no further batch once ``stop()`` is true.

        An exception of the task ends the run with that exception. A worker that dies is replaced, and what it had
        begun is run again.
        """
        ...


def checked(batch: Batch, rows: Sequence[Row]) -> list[Row]:
    """Return the rows; raise ``ValueError`` when there are not as many as jobs."""
    if len(rows) != len(batch):
        raise ValueError(f"a task must return a row for each job: {len(rows)} for {len(batch)}")
    return list(rows)
