"""Read and write a rotation trajectory as CSV: the file a tracker, an encoder or the fit leaves behind."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import InputError
from tiegocancel.events import MAX_TIME_US
from tiegocancel.motion.trajectory import MAX_CENTER_PX, MAX_OMEGA_RAD_S, RotationTrajectory

__all__ = ["read_trajectory", "write_trajectory"]

_TIME_COLUMNS = {
    f"{noun}{suffix}": scale
    for noun in ("timestamp", "time", "t")
    for suffix, scale in (("", "1e6"), ("_s", "1e6"), ("_ms", "1e3"), ("_us", "1"), ("_ns", "1e-3"))
}
"""Accepted names of the time column and the factor to µs; a name without unit is in seconds."""

_OTHER_UNITS = ("rpm", "rev", "rev_s", "rps", "hz", "deg", "deg_s", "dps", "degrees_s", "mrad_s", "krad_s")
_SAME_INSTANT_SHARE = 0.02
_SAME_INSTANT_MAX_US = 1000


@dataclass(frozen=True, slots=True)
class _Columns:
    """Places and names of the four columns in a row, and the factor from the time column to µs."""

    places: tuple[int, int, int, int]
    names: tuple[str, str, str, str]
    time_to_us: Decimal


def read_trajectory(path: str | Path) -> RotationTrajectory:
    """Read time, centre and angular velocity by column name; other columns are ignored.

    Time: ``timestamp``, ``time`` or ``t`` in s, or with the unit in the name (``t_us``, ``timestamp_ms`` …).
    Centre: ``center_x``, ``center_y`` in px (``_px`` may follow). Angular velocity: ``omega_rad_s``, or else the only
    column whose name starts with ``omega``; a name that ends in another unit is refused. Separators are comma,
    semicolon or tab. Rows are sorted by time, and rows of one instant (several blobs of one tracker) become
    their median; ``notes`` of the result say so. Raise ``InputError`` naming row and column of the first fault.
    """
    rows = _table(path)
    if not rows:
        raise InputError(path, "", "is empty; expected a header row with timestamp, center_x, center_y, omega_rad_s")
    header = [name.strip() for name in rows[0][1]]
    columns = _columns(path, header)
    t_us = np.empty(len(rows) - 1, np.int64)
    values = np.empty((len(rows) - 1, 3), np.float64)
    for index, (line, row) in enumerate(rows[1:]):
        if len(row) <= max(columns.places):
            raise InputError(path, f"row {line}", f"has {len(row)} fields; expected {len(header)} as in the header")
        t_us[index] = _time_us(path, line, columns, row[columns.places[0]])
        for place in (1, 2, 3):
            bound = MAX_OMEGA_RAD_S if place == 3 else MAX_CENTER_PX
            cell = row[columns.places[place]]
            values[index, place - 1] = _number(path, line, columns.names[place], cell, bound)
    if len(t_us) == 0:
        raise InputError(path, "", "holds a header and no rows; expected at least one")
    notes = [f"times from column {columns.names[0]}, angular velocity in rad/s from column {columns.names[3]}"]
    t_us, values = _sorted(t_us, values, notes)
    t_us, values = _merged(t_us, values, notes)
    return RotationTrajectory(
        t_us=t_us,
        center_px=values[:, :2],
        omega_rad_s=values[:, 2],
        source=Path(path).name,
        notes=tuple(notes),
    )


def write_trajectory(trajectory: RotationTrajectory, path: str | Path) -> None:
    """Write ``timestamp`` in s (six decimals, exact), ``center_x``, ``center_y`` in px and ``omega_rad_s``."""
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["timestamp", "center_x", "center_y", "omega_rad_s"])
        for time, center, omega in zip(
            trajectory.t_us.tolist(),
            trajectory.center_px.tolist(),
            trajectory.omega_rad_s.tolist(),
            strict=True,
        ):
            seconds, micros = divmod(abs(time), 1_000_000)
            writer.writerow([f"{'-' if time < 0 else ''}{seconds}.{micros:06d}", *map(repr, center), repr(omega)])


def _table(path: str | Path) -> list[tuple[int, list[str]]]:
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


def _columns(path: str | Path, header: list[str]) -> _Columns:
    """Find the four columns by name, ignoring case."""
    lower = [name.lower() for name in header]
    repeated = sorted({name for name in lower if name and lower.count(name) > 1})
    if repeated:
        raise InputError(path, "header", f"names column {repeated[0]!r} twice; expected each name once")
    times = [name for name in lower if name in _TIME_COLUMNS]
    # A file may carry the same time twice in two units; the plain name comes first in the table.
    time = min(times, key=list(_TIME_COLUMNS).index, default=None)
    if time is None:
        raise InputError(
            path, "header", f"lacks a time column: expected timestamp (s) or t_us, found {_quoted(header)}"
        )
    chosen = [lower.index(time)]
    for axis in ("x", "y"):
        found = [name for name in (f"center_{axis}", f"center_{axis}_px") if name in lower]
        if not found:
            raise InputError(path, "header", f"lacks the column center_{axis}: found {_quoted(header)}")
        chosen.append(lower.index(found[0]))
    omegas = [name for name in lower if name.startswith("omega")]
    if "omega_rad_s" in omegas:
        omegas = ["omega_rad_s"]
    if len(omegas) != 1:
        found_text = "more than one: " + _quoted(omegas) if omegas else _quoted(header)
        raise InputError(path, "header", f"lacks the column omega_rad_s, or one omega column: found {found_text}")
    if any(omegas[0].endswith(f"_{unit}") for unit in _OTHER_UNITS):
        raise InputError(path, "header", f"gives {header[lower.index(omegas[0])]!r}; expected rad/s, as omega_rad_s")
    chosen.append(lower.index(omegas[0]))
    cells = (chosen[0], chosen[1], chosen[2], chosen[3])
    names = (header[cells[0]], header[cells[1]], header[cells[2]], header[cells[3]])
    return _Columns(cells, names, Decimal(_TIME_COLUMNS[time]))


def _time_us(path: str | Path, line: int, columns: _Columns, cell: str) -> int:
    """Convert one time exactly, in decimal, to the nearest µs."""
    name = columns.names[0]
    try:
        value = Decimal(cell.strip().replace("_", "?"))
    except InvalidOperation:
        value = Decimal("NaN")
    if not value.is_finite():
        raise InputError(path, f"row {line}, column {name}", f"expected a finite number, found {cell!r}")
    limit = MAX_TIME_US / columns.time_to_us
    if not -limit <= value <= limit:  # compared, not computed with: abs() of 1e999999999 overflows
        raise InputError(path, f"row {line}, column {name}", f"expected a time within ±2^60 µs, found {cell!r}")
    return int((value * columns.time_to_us).to_integral_value())


def _number(path: str | Path, line: int, name: str, cell: str, bound: float) -> float:
    """Read one finite number within ``±bound``."""
    try:
        value = float(cell.strip().replace("_", "?"))
    except ValueError:
        value = float("nan")
    if value != value or abs(value) == float("inf"):
        raise InputError(path, f"row {line}, column {name}", f"expected a finite number, found {cell!r}")
    if abs(value) > bound:
        raise InputError(path, f"row {line}, column {name}", f"expected a number within ±{bound:g}, found {cell!r}")
    return value


def _sorted(
    t_us: NDArray[np.int64], values: NDArray[np.float64], notes: list[str]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Sort by time, stably, and note how many rows were behind a later one."""
    late = int(np.count_nonzero(t_us < np.maximum.accumulate(t_us)))
    if late:
        order = np.argsort(t_us, kind="stable")
        t_us, values = t_us[order], values[order]
        notes.append(f"rows were not in the order of time: {late} of {len(t_us)} moved")
    return t_us, values


def _merged(
    t_us: NDArray[np.int64], values: NDArray[np.float64], notes: list[str]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Replace rows of one instant by their median.

    A tracker of several blobs writes a burst of rows every period; interpolating through a burst would jump from
    blob to blob. Rows closer than 2 % of the usual period (the 95th percentile of the gaps, 1 ms at most) are one
    instant; for evenly spaced rows that joins only equal times.
    """
    gaps = np.diff(t_us)
    period_us = float(np.percentile(gaps, 95)) if len(gaps) else 0.0
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


def _quoted(names: list[str]) -> str:
    """Join names for a message, a few of them."""
    shown = ", ".join(repr(name) for name in names[:6])
    return shown + (f" and {len(names) - 6} more" if len(names) > 6 else "")
