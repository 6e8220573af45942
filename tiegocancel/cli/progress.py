"""Show progress on stderr, on a terminal only."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tiegocancel.events import Events

__all__ = ["event_progress"]


@contextlib.contextmanager
def event_progress(task: str, expected_us: int | None) -> Iterator[Callable[[Events], None]]:
    """Yield a function that takes each chunk as it is done; ``expected_us`` of stream time makes it a bar."""
    if not sys.stderr.isatty():
        yield lambda chunk: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[events]:,} events"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        row = progress.add_task(task, total=expected_us, events=0)
        start_us: int | None = None
        events = 0

        def advance(chunk: Events) -> None:
            nonlocal start_us, events
            events += len(chunk)
            start_us = int(chunk.t[0]) if start_us is None else start_us
            progress.update(row, completed=int(chunk.t[-1]) - start_us, events=events)

        yield advance
