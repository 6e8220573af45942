"""Read what the first lines of a text recording say: comments, sensor size, column names and the unit of time."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tiegocancel.errors import InputError
from tiegocancel.files.source import open_source

__all__ = ["MAX_LINE_BYTES", "NUMBER", "TextHeader", "read_text_header", "split_row"]

MAX_LINE_BYTES = 1 << 16
_MAX_HEADER_LINES = 1000
_MAX_SIZE_DIGITS = 9
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_COLUMN_NAMES = {
    "t": "t", "ts": "t", "time": "t", "timestamp": "t", "timestamps": "t",
    "x": "x", "col": "x", "column": "x",
    "y": "y", "row": "y",
    "p": "p", "pol": "p", "polarity": "p", "on": "p",
}  # fmt: skip
_UNIT_NAMES = {
    "s": "s", "sec": "s", "secs": "s", "second": "s", "seconds": "s",
    "ms": "ms", "millisecond": "ms", "milliseconds": "ms",
    "us": "us", "µs": "us", "μs": "us", "usec": "us", "microsecond": "us", "microseconds": "us",
    "ns": "ns", "nanosecond": "ns", "nanoseconds": "ns",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class TextHeader:
    """What precedes the first row of numbers.

    ``columns`` as letters t x y p with ``-`` for another column, empty where no line names them; ``time_unit`` or
    empty; ``size`` in px or ``None``; ``delimiter`` is ``,``, ``;`` or empty for white space; ``data_offset`` in
    bytes and ``lines`` before the first row; ``first_row`` its fields.
    """

    columns: str
    time_unit: str
    size: tuple[int, int] | None
    delimiter: str
    data_offset: int
    lines: int
    first_row: tuple[str, ...]


def read_text_header(path: Path) -> TextHeader:
    """Read up to the first row of numbers; raise :class:`InputError` when there is none.

    A header line names the columns (``x,y,p,t_us``, ``t x y p``, ``time (ms)``), as a comment too. One line of two
    whole numbers before rows of four is the sensor's size, as in some public data sets.
    """
    columns, time_unit, named, size = "", "", False, None
    with open_source(path) as source:
        offset = 0
        for number in range(1, _MAX_HEADER_LINES + 1):
            line = source.readline(MAX_LINE_BYTES + 1)
            if not line:
                raise InputError(path, f"byte {offset}", "ends without a row of numbers, expected rows of t, x, y, p")
            if len(line) > MAX_LINE_BYTES:
                raise InputError(
                    path, f"row {number}", f"longer than {MAX_LINE_BYTES} bytes, expected a row of t, x, y, p"
                )
            text = line.decode("utf-8-sig" if number == 1 else "utf-8", "replace").strip()
            comment = text.startswith(("#", "%"))
            fields, delimiter = split_row(text.lstrip("#%").strip() if comment else text)
            if not comment and fields and all(NUMBER.fullmatch(field) for field in fields):
                if len(fields) == 2 and size is None and all(field.isdecimal() for field in fields):
                    if max(map(len, fields)) > _MAX_SIZE_DIGITS:
                        raise InputError(
                            path, f"row {number}", f"found {text[:40]!r}, expected a sensor size or rows of t, x, y, p"
                        )
                    size = (int(fields[0]), int(fields[1]))
                else:
                    mark = len(_BYTE_ORDER_MARK) if line.startswith(_BYTE_ORDER_MARK) else 0
                    return TextHeader(columns, time_unit, size, delimiter, offset + mark, number - 1, fields)
            elif fields:
                found, unit = _column_names(fields)
                if found:
                    columns, time_unit, named = found, unit, True
                elif not comment:
                    raise InputError(path, f"row {number}", f"found {text[:40]!r}, expected {_expected(named)}")
            offset += len(line)
    raise InputError(path, f"row {_MAX_HEADER_LINES}", "no row of numbers so far, expected rows of t, x, y, p")


def split_row(text: str) -> tuple[tuple[str, ...], str]:
    """Split a line at commas, else semicolons, else white space; return the fields and the delimiter."""
    for delimiter in (",", ";"):
        if delimiter in text:
            return tuple(field.strip() for field in text.split(delimiter)), delimiter
    return tuple(text.split()), ""


def _expected(named: bool) -> str:
    return "numbers" if named else "numbers, or a header that names t, x, y and p"


def _column_names(fields: tuple[str, ...]) -> tuple[str, str]:
    """Return the columns that a header names and the unit of time; empty when it does not name all of them."""
    columns, time_unit = "", ""
    merged: list[str] = []
    for field in fields:
        # "time (ms)" in a header split at white space comes in two pieces.
        if merged and re.fullmatch(r"[\[(].*[\])]", field):
            merged[-1] += field
        else:
            merged.append(field)
    for field in merged:
        name, unit = _name_and_unit(field)
        columns += _COLUMN_NAMES.get(name, "-")
        if _COLUMN_NAMES.get(name) == "t":
            time_unit = unit
    sound = all(columns.count(key) == 1 for key in "txyp")
    return (columns, time_unit) if sound else ("", "")


def _name_and_unit(field: str) -> tuple[str, str]:
    """Split ``t_us``, ``timestamp[ns]`` or ``time (s)`` into name and unit."""
    words = [word for word in re.split(r"[\s_\[\]().:/-]+", field.strip().strip("\"'").lower()) if word]
    if len(words) > 1 and words[-1] in _UNIT_NAMES:
        return "_".join(words[:-1]), _UNIT_NAMES[words[-1]]
    if len(words) > 1 and words[-1] == "px":
        words.pop()
    return "_".join(words), ""
