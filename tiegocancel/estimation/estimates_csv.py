"""Write motion estimates to a CSV file as they come, so that what was estimated survives what comes after."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Self

from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.motion.csv_table import time_cell

__all__ = ["COLUMNS", "TURNS", "EstimateWriter"]

COLUMNS = (
    "timestamp",
    "center_x",
    "center_y",
    "omega_rad_s",
    "omega_dot_rad_s2",
    "center_sigma_px",
    "omega_sigma_rad_s",
    "sharpness",
    "confident",
    "events_used",
    "doubt",
)
"""Columns of the file: time in s, px, rad/s, rad/s², 0 or 1 for ``confident``, and words."""

TURNS = ("omega_x_rad_s", "omega_y_rad_s", "omega_z_rad_s")
"""Columns of a camera that turns about three axes: its own turn about right, down and forward."""


class EstimateWriter:
    """Write a row for each estimate; the file reads back with ``RotationTrajectory.from_csv``.

    1. The constructor replaces ``path`` by a file with a header.
    2. :meth:`write` appends one estimate in one piece and hands it to the system at once: a program that dies leaves
       every row that was written, and none torn. (A machine that dies may lose the last ones.)
    3. :meth:`close`, or leaving a ``with`` block, closes the file.

    With ``turns`` rows have :data:`TURNS` too, and the file serves ``--motion`` with ``--calibration``.
    A centre that never was known and a sharpness that was not made are empty cells; an unknown deviation is ``inf``.
    Raise ``ValueError`` when times do not increase strictly, ``OSError`` from the file system.
    """

    def __init__(self, path: str | Path, *, turns: bool = False) -> None:
        self.path = Path(path)
        self._turns = turns
        self.count = 0
        self._last_us: int | None = None
        self._file = self.path.open("wb", buffering=0)  # unbuffered: a row is one write
        self._append((*COLUMNS, *TURNS) if turns else COLUMNS)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; more than once does no harm."""
        self._file.close()

    def write(self, *estimates: MotionEstimate) -> None:
        """Append estimates, in the order of time."""
        self.extend(estimates)

    def extend(self, estimates: Iterable[MotionEstimate]) -> None:
        """Append estimates one by one as they come."""
        for estimate in estimates:
            if self._last_us is not None and estimate.t_us <= self._last_us:
                raise ValueError(f"t_us must increase strictly: {estimate.t_us} µs after {self._last_us} µs")
            turn = estimate.turn_rad_s or (math.nan,) * len(TURNS)
            self._append(_cells(estimate) + [_number(axis) for axis in turn if self._turns])
            self._last_us = estimate.t_us
            self.count += 1

    def _append(self, cells: Iterable[str]) -> None:
        """Write one row."""
        row = io.StringIO()
        csv.writer(row, lineterminator="\n").writerow(cells)
        data = row.getvalue().encode()
        written = self._file.write(data)
        if written != len(data):
            raise OSError(f"{self.path}: only {written} of {len(data)} bytes of a row were written")


def _cells(estimate: MotionEstimate) -> list[str]:
    """Return the cells of a row, digits enough to read back the same numbers."""
    center = estimate.center_px if estimate.has_center else (math.nan, math.nan)
    return [
        time_cell(estimate.t_us),
        *(_number(place) for place in center),
        _number(estimate.omega_rad_s),
        _number(estimate.omega_dot_rad_s2),
        _number(estimate.center_sigma_px),
        _number(estimate.omega_sigma_rad_s),
        _number(estimate.sharpness),
        str(int(estimate.confident)),
        str(estimate.events_used),
        " ".join(estimate.doubt.split()),
    ]


def _number(value: float) -> str:
    """Write a number, and nothing for one that is not known."""
    return "" if math.isnan(value) else repr(float(value))
