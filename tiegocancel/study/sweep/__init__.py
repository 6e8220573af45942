"""Run many independent jobs: in this process, in several, or on a cluster, with one resumable list of results."""

from tiegocancel.study.sweep.engine import Batch, Engine, Task
from tiegocancel.study.sweep.inline import Inline
from tiegocancel.study.sweep.job import Job, Row, job_key
from tiegocancel.study.sweep.pace import Pace
from tiegocancel.study.sweep.processes import Processes
from tiegocancel.study.sweep.run import SweepResult, run_sweep
from tiegocancel.study.sweep.store import ResultStore
from tiegocancel.study.sweep.table import write_table

__all__ = [
    "Batch",
    "Engine",
    "Inline",
    "Job",
    "Pace",
    "Processes",
    "ResultStore",
    "Row",
    "SweepResult",
    "Task",
    "job_key",
    "run_sweep",
    "write_table",
]
