"""Run a sweep in this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from tiegocancel.study.sweep.engine import Batch, Task
from tiegocancel.study.sweep.job import Row

__all__ = ["Inline"]


class Inline:
    """Run batches one after the other, here: what a batched kernel with threads of its own wants."""

    def run(self, task: Task, batches: Sequence[Batch], stop: Callable[[], bool]) -> Iterator[tuple[Batch, list[Row]]]:
        """Yield each batch with its rows."""
        for batch in batches:
            if stop():
                return
            yield batch, task(batch)
