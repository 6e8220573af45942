"""Run the canceller with its controls over a stream, and say what the numbers mean."""

from tiegocancel.study.result import INTERRUPTED, RunResult
from tiegocancel.study.run import run_stream
from tiegocancel.study.settings import Settings
from tiegocancel.study.verdict import Verdict, judge

__all__ = ["INTERRUPTED", "RunResult", "Settings", "Verdict", "judge", "run_stream"]
