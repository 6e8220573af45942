"""Run a sweep on a Dask cluster, one that runs already or a local one."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Any

from tiegocancel.errors import ConfigError, MissingExtraError
from tiegocancel.study.sweep.engine import Batch, Task
from tiegocancel.study.sweep.job import Row

__all__ = ["Cluster"]

_CONNECT_S = 10


class Cluster:
    """Run batches on the workers of the scheduler at ``address`` (``tcp://host:8786``), or of ``client`` itself.

    Workers need this package and one thread each (``dask worker --nthreads 1``), because one thread owns the kernels.
    A worker that dies loses what it was doing and nothing else: the scheduler runs that again elsewhere.
    """

    def __init__(self, address: str | None = None, *, client: Any = None) -> None:
        if (address is None) == (client is None):
            raise ValueError("a cluster is given by its address or by its client, and not by both")
        self.address, self.client = address, client

    def run(self, task: Task, batches: Sequence[Batch], stop: Callable[[], bool]) -> Iterator[tuple[Batch, list[Row]]]:
        """Yield each batch with its rows, as they finish."""
        try:
            distributed: Any = import_module("distributed")
        except ImportError:
            raise MissingExtraError("a sweep on a cluster", "distributed", "cluster") from None
        client = self.client
        if client is None:
            try:
                client = distributed.Client(self.address, timeout=_CONNECT_S)
            except (OSError, ValueError) as error:
                raise ConfigError(f"--cluster {self.address}: no scheduler answers there: {error}") from error
        try:
            shared = client.scatter(task, broadcast=True)
            under_way: dict[Any, Batch] = {
                client.submit(_run_task, shared, batch, pure=False): batch for batch in batches
            }
            for future in distributed.as_completed(list(under_way)):
                if stop():
                    client.cancel(list(under_way))
                    return
                yield under_way.pop(future), future.result()
        finally:
            if self.client is None:
                client.close()


def _run_task(task: Task, batch: Batch) -> list[Row]:
    """Run on a worker, which shares its machine with others."""
    os.environ.setdefault("TIEGOCANCEL_THREADS", "1")
    return task(batch)
