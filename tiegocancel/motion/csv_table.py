"""Read a CSV table of numbers over time by column name, and say where a bad one is wrong."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import InputError
from tiegocancel.events import MAX_TIME_US

__all__ = ["CsvTable", "merged_rows", "quoted", "sorted_rows", "time_cell"]

_TIME_COLUMNS = {
    f"{noun}{suffix}": scale
    for noun in ("timestamp", "time", "t")
    for suffix, scale in (("", "1e6"), ("_s", "1e6"), ("_ms", "1e3"), ("_us", "1"), ("_ns", "1e-3"))
}
"""Accepted names of the time column and the factor to µs; a name without unit is in seconds."""

_SAME_INSTANT_SHARE = 0.02
_SAME_INSTANT_MAX_US = 1000


@dataclass(frozen=True, slots=True, eq=False)
class CsvTable:
    """Hold the cells of a file: ``names`` as written in the header, ``rows`` with their line numbers from 1."""

    path: str | Path
    names: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]

    @classmethod
    def read(cls, path: str | Path, expected: str) -> CsvTable:
        """Read a UTF-8 file whose first row that is not blank names the columns; ``expected`` says which, for messages.

        The separator is comma, semicolon or tab. Raise ``InputError`` for what is not such a file, for a name given
        twice and for a file without rows.
        """
        rows = _cells(path)
        if not rows:
            raise InputError(path, "", f"is empty; expected a header row with {expected}")
        names = tuple(name.strip() for name in rows[0][1])
        lower = [name.lower() for name in names]
        repeated = sorted({name for name in lower if name and lower.count(name) > 1})
        if repeated:
            raise InputError(path, "header", f"names column {repeated[0]!r} twice; expected each name once")
        return cls(path, names, tuple(rows[1:]))

    def place(self, *names: str) -> int | None:
        """Return the place of the first of ``names`` that the header has, ignoring case."""
        lower = [name.lower() for name in self.names]
        return next((lower.index(name) for name in names if name in lower), None)

    def needed(self, *names: str) -> int:
        """Return the place of the first of ``names``; raise ``InputError`` naming the first when all are absent."""
        place = self.place(*names)
        if place is None:
            raise InputError(self.path, "header", f"lacks the column {names[0]}: found {quoted(self.names)}")
        return place

    def time_place(self) -> int:
        """Return the place of the time column; raise ``InputError`` when there is none.

        ``timestamp``, ``time`` or ``t`` in s, or with the unit in the name (``t_us``, ``timestamp_ms`` …).
        """
        # A file may carry the same time twice in two units; the plain name comes first.
        place = self.place(*_TIME_COLUMNS)
        if place is None:
            problem = f"lacks a time column: expected timestamp (s) or t_us, found {quoted(self.names)}"
            raise InputError(self.path, "header", problem)
        return place

    def times_us(self, place: int) -> NDArray[np.int64]:
        """Return the times of the time column int64[K], K ≥ 1, to the nearest µs, exact in decimal."""
        if not self.rows:
            raise InputError(self.path, "", "holds a header and no rows; expected at least one")
        scale = Decimal(_TIME_COLUMNS[self.names[place].lower()])
        return np.array([self._time_us(index, place, scale) for index in range(len(self.rows))], np.int64)

    def numbers(self, place: int, bound: float, rows: NDArray[np.int64] | None = None) -> NDArray[np.float64]:
        """Return a column float64[K], or of ``rows`` alone; every number must be finite and within ``±bound``."""
        chosen = range(len(self.rows)) if rows is None else rows.tolist()
        return np.array([self._number(index, place, bound) for index in chosen], np.float64)

    def cell(self, index: int, place: int) -> str:
        """Return one cell without the blanks around it."""
        line, row = self.rows[index]
        if len(row) <= place:
            problem = f"has {len(row)} fields; expected {len(self.names)} as in the header"
            raise InputError(self.path, f"row {line}", problem)
        return row[place].strip()

    def fail(self, index: int, place: int, expected: str) -> InputError:
        """Return the error for the cell: where it is, what was expected, what it holds."""
        line, row = self.rows[index]
        where = f"row {line}, column {self.names[place]}"
        return InputError(self.path, where, f"expected {expected}, found {row[place]!r}")

    def _time_us(self, index: int, place: int, scale: Decimal) -> int:
        try:
            value = Decimal(self.cell(index, place).replace("_", "?"))
        except InvalidOperation:
            value = Decimal("NaN")
        if not value.is_finite():
            raise self.fail(index, place, "a finite number")
        limit = MAX_TIME_US / scale
        if not -limit <= value <= limit:  # compared, not computed with: abs() of 1e999999999 overflows
            raise self.fail(index, place, "a time within ±2^60 µs")
        return int((value * scale).to_integral_value())

    def _number(self, index: int, place: int, bound: float) -> float:
        try:
            value = float(self.cell(index, place).replace("_", "?"))
        except ValueError:
            value = float("nan")
        if value != value or abs(value) == float("inf"):
            raise self.fail(index, place, "a finite number")
        if abs(value) > bound:
            raise self.fail(index, place, f"a number within ±{bound:g}")
        return value


def time_cell(t_us: int) -> str:
    """Write a time in seconds with six decimals, exactly."""
    seconds, micros = divmod(abs(t_us), 1_000_000)
    return f"{'-' if t_us < 0 else ''}{seconds}.{micros:06d}"


def sorted_rows(
    t_us: NDArray[np.int64], values: NDArray[np.float64], notes: list[str]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Sort by time, stably, and note how many rows were behind a later one."""
    late = int(np.count_nonzero(t_us < np.maximum.accumulate(t_us)))
    if late:
        order = np.argsort(t_us, kind="stable")
        t_us, values = t_us[order], values[order]
        notes.append(f"rows were not in the order of time: {late} of {len(t_us)} moved")
    return t_us, values


def merged_rows(
    t_us: NDArray[np.int64], values: NDArray[np.float64], notes: list[str], *, equal_only: bool = False
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Replace rows of one instant by their median.

    A tracker of several blobs writes a burst of rows every period; interpolating through a burst would jump from
    blob to blob. Rows closer than 2 % of the usual period (the 95th percentile of the gaps, 1 ms at most) are one
    instant; for evenly spaced rows that joins only equal times, as ``equal_only`` does for all.
    """
    gaps = np.diff(t_us)
    period_us = float(np.percentile(gaps, 95)) if len(gaps) and not equal_only else 0.0
    tolerance_us = min(_SAME_INSTANT_MAX_US, int(period_us * _SAME_INSTANT_SHARE))
    starts = [0]
    for index, time in enumerate(t_us.tolist()):
        if time - int(t_us[starts[-1]]) > tolerance_us:
            starts.append(index)
    if len(starts) == len(t_us):
        return t_us, values
    groups = list(zip(starts, [*starts[1:], len(t_us)], strict=True))
    notes.append(f"{len(t_us)} rows at {len(groups)} instants (within {tolerance_us} µs): the median of each was taken")
    middle = np.array([int(t_us[first]) + int(np.median(t_us[first:stop] - t_us[first])) for first, stop in groups])
    return middle, np.array([np.median(values[first:stop], axis=0) for first, stop in groups])


def quoted(names: tuple[str, ...] | list[str]) -> str:
    """Join names for a message, a few of them."""
    shown = ", ".join(repr(name) for name in names[:6])
    return shown + (f" and {len(names) - 6} more" if len(names) > 6 else "")


def _cells(path: str | Path) -> list[tuple[int, list[str]]]:
    """Return the rows that are not blank, each with its line number in the file, the first being 1."""
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(path, "", f"cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "is not UTF-8 text; expected a CSV file") from error
    lines = text.splitlines()
    header = next((line for line in lines if line.strip()), "")
    # The separator that the header uses most; a comma when it uses none.
    separator = max(",;\t", key=header.count)
    reader = csv.reader(lines, delimiter=separator)
    try:
        return [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(path, f"row {reader.line_num}", f"is not CSV: {error}") from error
