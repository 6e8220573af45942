"""Show the progress of a sweep on stderr, with the time that is left, on a terminal only."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tiegocancel.study.sweep import Pace

__all__ = ["sweep_progress"]


@contextlib.contextmanager
def sweep_progress(task: str) -> Iterator[Callable[[Pace], None]]:
    """Yield a function that takes the pace after each batch."""
    if not sys.stderr.isatty():
        yield lambda pace: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[left]}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        row = progress.add_task(task, total=None, left="")

        def advance(pace: Pace) -> None:
            left = "" if pace.eta_s is None else f"{pace.eta_s:,.0f} s left"
            if pace.resumed:
                left += f", {pace.resumed:,} from before"
            progress.update(row, total=pace.total, completed=pace.done, left=left)

        yield advance
