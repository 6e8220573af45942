"""Read a gyroscope's samples from text: CSV by column name, or the bare columns of the public event-camera data set."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

from tiegocancel.errors import InputError
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.events import MAX_TIME_US
from tiegocancel.files.source import open_source
from tiegocancel.motion.rotation import MAX_OMEGA_RAD_S

__all__ = ["read_text_gyro"]

_TIMES = {
    f"{noun}{suffix}": scale
    for noun in ("timestamp", "time", "t")
    for suffix, scale in (("", "1e6"), ("_s", "1e6"), ("_ms", "1e3"), ("_us", "1"), ("_ns", "1e-3"))
}
"""Names of the time column and the factor to µs; a name without unit is in seconds."""

_NOUNS = ("gyro", "gyroscope", "omega", "angular_velocity")
_UNITS = {"rad_s": 1.0, "mrad_s": 1e-3, "deg_s": math.radians(1.0), "dps": math.radians(1.0)}
_BARE = ("t", "ax", "ay", "az", "gx", "gy", "gz")
_EXPECTED = "gyro_x_rad_s, gyro_y_rad_s and gyro_z_rad_s (or …_deg_s), or gyro_z_rad_s alone"


@dataclass(frozen=True, slots=True)
class _Columns:
    """Names and places of the columns that are read, and the factors to µs and rad/s; a place of −1 reads as 0."""

    names: tuple[str, str, str, str]
    places: tuple[int, int, int, int]
    time_to_us: Decimal
    to_rad_s: float


def read_text_gyro(path: Path, *, keep_going: bool = False) -> GyroSamples:
    """Read CSV with a header, or rows ``t ax ay az gx gy gz`` in s, m/s² and rad/s without one.

    CSV: separators are comma, semicolon or tab; time as ``timestamp``, ``time`` or ``t`` in s, or with its unit
    (``t_us``); rates as ``gyro_x_rad_s``, ``gyro_x_deg_s`` …, one unit for all axes, never without a unit. A file of z
    alone is a gyroscope of one axis: x and y are 0. Other columns are ignored.
    """
    rows = _rows(path)
    first = next(rows, None)
    if first is None:
        raise InputError(path, "", f"is empty; expected a header row with timestamp, {_EXPECTED}")
    line, cells = first
    notes: list[str] = []
    if _is_number(cells[0]):
        if len(cells) != len(_BARE):
            problem = f"has {len(cells)} fields and no header; expected {' '.join(_BARE)}"
            raise InputError(path, f"row {line}", problem)
        columns = _Columns(("t", "gx", "gy", "gz"), (0, 4, 5, 6), Decimal("1e6"), 1.0)
        notes.append("no header: columns taken as t ax ay az gx gy gz in s, m/s² and rad/s")
        pending: tuple[int, list[str]] | None = first
        width = len(_BARE)
    else:
        header = [cell.removeprefix("#").strip() for cell in cells]
        columns = _columns(path, [name.lower() for name in header], notes)
        pending, width = None, len(header)
    times: list[int] = []
    rates: list[tuple[float, float, float]] = []
    try:
        for line, cells in _chained(pending, rows):
            if len(cells) != width:
                raise InputError(path, f"row {line}", f"has {len(cells)} fields; expected {width}")
            time = _time_us(path, line, columns, cells)
            rates.append((_rate(path, line, columns, cells, 1), _rate(path, line, columns, cells, 2),
                          _rate(path, line, columns, cells, 3)))  # fmt: skip
            times.append(time)
    except InputError as fault:
        if not (keep_going and times):
            raise
        notes.append(f"stopped at a fault: {fault.where}: {fault.problem}")
    if not times:
        raise InputError(path, "", "holds a header and no rows; expected at least one")
    return GyroSamples.from_unsorted(times, rates, source=path.name, notes=notes)


def _chained(
    first: tuple[int, list[str]] | None, rest: Iterator[tuple[int, list[str]]]
) -> Iterator[tuple[int, list[str]]]:
    if first is not None:
        yield first
    yield from rest


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows that are not blank, each with its line number in the file, the first being 1."""
    with open_source(path) as source:
        try:
            text = source.read().decode("utf-8-sig")
        except OSError as error:
            raise InputError(path, "", f"cannot be read: {error.strerror or error}") from None
        except UnicodeDecodeError as error:
            raise InputError(path, f"byte {error.start}", "is not UTF-8 text; expected CSV") from None
    lines = text.splitlines()
    header = next((line for line in lines if line.strip()), "")
    separator = max(",;\t", key=header.count)
    if header.count(separator) == 0 or (separator == "\t" and _is_number(header.split()[0])):
        for number, line in enumerate(lines, start=1):
            if line.strip():
                yield number, line.split()
        return
    reader = csv.reader(lines, delimiter=separator)
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                yield reader.line_num, [cell.strip() for cell in row]
    except csv.Error as error:
        raise InputError(path, f"row {reader.line_num}", f"is not CSV: {error}") from None


def _columns(path: Path, header: list[str], notes: list[str]) -> _Columns:
    """Find time and rates by name, lower case."""
    repeated = sorted({name for name in header if name and header.count(name) > 1})
    if repeated:
        raise InputError(path, "header", f"names column {repeated[0]!r} twice; expected each name once")
    shown = ", ".join(repr(name) for name in header[:6]) + (" …" if len(header) > 6 else "")
    time = next((name for name in _TIMES if name in header), None)
    if time is None:
        raise InputError(path, "header", f"lacks a time column: expected timestamp (s) or t_us, found {shown}")
    found = [
        (noun, unit)
        for noun in _NOUNS
        for unit in _UNITS
        if f"{noun}_z_{unit}" in header
    ]  # fmt: skip
    if not found:
        bare = next((name for noun in _NOUNS for name in (f"{noun}_z", f"{noun}z") if name in header), None)
        if bare is not None:
            raise InputError(path, "header", f"gives {bare!r} without a unit; expected {_EXPECTED}")
        raise InputError(path, "header", f"lacks a gyroscope: expected {_EXPECTED}, found {shown}")
    noun, unit = found[0]
    names = [f"{noun}_{axis}_{unit}" for axis in "xyz"]
    missing = [name for name in names if name not in header]
    if len(missing) == 1:
        raise InputError(path, "header", f"lacks the column {missing[0]}: expected {_EXPECTED}, found {shown}")
    if missing:
        notes.append(f"a gyroscope of one axis: {names[2]}; x and y are taken as 0")
    notes.append(f"times from column {time}, rates from {names[2]}" + ("" if missing else " and its like"))
    places = [header.index(name) if name in header else -1 for name in names]
    return _Columns(
        (time, names[0], names[1], names[2]),
        (header.index(time), places[0], places[1], places[2]),
        Decimal(_TIMES[time]),
        _UNITS[unit],
    )


def _time_us(path: Path, line: int, columns: _Columns, cells: list[str]) -> int:
    """Convert one time exactly, in decimal, to the nearest µs."""
    cell = cells[columns.places[0]]
    try:
        value = Decimal(cell.replace("_", "?"))
    except InvalidOperation:
        value = Decimal("NaN")
    where = f"row {line}, column {columns.names[0]}"
    if not value.is_finite():
        raise InputError(path, where, f"expected a finite number, found {cell!r}")
    limit = MAX_TIME_US / columns.time_to_us
    if not -limit <= value <= limit:
        raise InputError(path, where, f"expected a time within ±2^60 µs, found {cell!r}")
    return int((value * columns.time_to_us).to_integral_value())


def _rate(path: Path, line: int, columns: _Columns, cells: list[str], which: int) -> float:
    """Read one finite rate and convert it to rad/s."""
    place = columns.places[which]
    if place < 0:
        return 0.0
    try:
        value = float(cells[place].replace("_", "?")) * columns.to_rad_s
    except ValueError:
        value = math.nan
    if not abs(value) <= MAX_OMEGA_RAD_S:
        where = f"row {line}, column {columns.names[which]}"
        raise InputError(
            path, where, f"expected a finite rate within ±{MAX_OMEGA_RAD_S:g} rad/s, found {cells[place]!r}"
        )
    return value


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
