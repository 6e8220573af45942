"""Jobs for the tests of sweeps, at the top level of a module so that other processes find them."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tiegocancel.study.sweep import Job, Row


def square(context: Any, jobs: Sequence[Job]) -> list[Row]:
    """Square the numbers; leave a line for each call in the file that ``context`` names."""
    if context is not None:
        with Path(context).open("a") as log:
            log.write("".join(f"{job['n']}\n" for job in jobs))
    return [{"square": job["n"] ** 2, "worker": os.getpid()} for job in jobs]


def slow_square(context: Any, jobs: Sequence[Job]) -> list[Row]:
    """Square the numbers, a little later, so that somebody can be killed on the way."""
    time.sleep(0.05 * len(jobs))
    return square(context, jobs)


def die_once(context: Any, jobs: Sequence[Job]) -> list[Row]:
    """Kill the own process at job 7, the first time: ``context`` is a folder that remembers."""
    mark = Path(context) / "died"
    if any(job["n"] == 7 for job in jobs) and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return square(None, jobs)


def die_always(context: Any, jobs: Sequence[Job]) -> list[Row]:
    """Kill the own process."""
    os.kill(os.getpid(), signal.SIGKILL)
    return []


def fail(context: Any, jobs: Sequence[Job]) -> list[Row]:
    """Fail at job 5 and beyond."""
    if any(job["n"] >= 5 for job in jobs):
        raise ValueError(f"job {jobs[0]['n']} cannot be done")
    return square(context, jobs)


def too_few(context: Any, jobs: Sequence[Job]) -> list[Row]:
    """Return no rows."""
    return []
