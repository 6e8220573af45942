"""Parse blocks of text rows: whole columns at once where they are plain, line by line where they are not."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Context, Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import InputError
from tiegocancel.events import MAX_TIME_US
from tiegocancel.files.block import Block
from tiegocancel.files.decimals import parse_decimals
from tiegocancel.files.text_header import MAX_LINE_BYTES, NUMBER, split_row
from tiegocancel.files.values import RowMaker

__all__ = ["TextRows"]

_PLACES = {"s": 6, "ms": 3, "us": 0, "ns": 0}
_NANOSECONDS_A_MICROSECOND = 1_000
_MAX_COORDINATE = 1 << 31
_EXACT = Context(prec=MAX_LINE_BYTES + 2_000)
"""Decimal arithmetic that keeps every digit a line can hold."""

_OTHER, _DIGIT, _POINT, _SIGN, _BLANK, _COMMA, _SEMICOLON, _NEWLINE = range(8)
_CLASS = np.zeros(256, np.uint8)
for _characters, _class in (
    (b"0123456789", _DIGIT),
    (b".", _POINT),
    (b"+-", _SIGN),
    (b" \t\r", _BLANK),
    (b",", _COMMA),
    (b";", _SEMICOLON),
    (b"\n", _NEWLINE),
):
    _CLASS[np.frombuffer(_characters, np.uint8)] = _class


class TextRows:
    """Parse rows whose ``columns`` (letters t x y p, ``-`` for another) are parted by ``delimiter``.

    ``time_unit`` is s, ms, us or ns. Carries the polarity rule of the file from block to block.
    """

    def __init__(self, path: Path, columns: str, time_unit: str, delimiter: str) -> None:
        self._path = path
        self._columns = columns
        self._unit = time_unit
        self._delimiter = delimiter
        self._maker = RowMaker(path, "us")

    def parse(self, data: bytes, first_line: int) -> tuple[Block, InputError | None]:
        """Parse whole lines, the first of which is row ``first_line``; return rows before a fault, and the fault."""
        plain = self._parse_plain(np.frombuffer(data, np.uint8))
        if plain is None:
            return self._parse_lines(data, first_line)
        numbers, lines = plain
        return self._maker.block(
            numbers["t"], numbers["x"], numbers["y"], numbers["p"], lambda row: f"row {first_line + int(lines[row])}"
        )

    def _parse_plain(self, text: NDArray[np.uint8]) -> tuple[dict[str, NDArray[np.int64]], NDArray[np.int64]] | None:
        """Parse rows of plain decimal numbers; ``None`` when any row is something else."""
        kinds = _CLASS[text]
        filled = (kinds >= _DIGIT) & (kinds <= _SIGN)
        if bool((kinds == _OTHER).any()):
            return None
        edges = np.flatnonzero(np.diff(np.concatenate([[False], filled, [False]]).view(np.int8)))
        starts, stops = edges[::2], edges[1::2]
        ends = np.flatnonzero(kinds == _NEWLINE)
        bounds = np.concatenate([[0], np.searchsorted(starts, ends), [len(starts)]])
        counts = np.diff(bounds)
        lines = np.flatnonzero(counts)
        width = len(self._columns)
        if bool((counts[lines] != width).any()):
            return None
        if not self._is_sound(kinds, starts, stops, ends, lines):
            return None
        numbers: dict[str, NDArray[np.int64]] = {}
        for place, key in enumerate(self._columns):
            if key == "-":
                continue
            places = _PLACES[self._unit] if key == "t" else 0
            parsed = parse_decimals(text, starts[place::width], stops[place::width], places)
            # A fraction of a nanosecond would be rounded twice, and a fraction of a pixel is a fault.
            may_round = key == "t" and self._unit != "ns"
            if parsed is None or not (may_round or bool(parsed[1].all())):
                return None
            numbers[key] = parsed[0]
        if self._unit == "ns":
            half = _NANOSECONDS_A_MICROSECOND // 2
            numbers["t"] = np.sign(numbers["t"]) * ((np.abs(numbers["t"]) + half) // _NANOSECONDS_A_MICROSECOND)
        return numbers, lines

    def _is_sound(
        self,
        kinds: NDArray[np.uint8],
        starts: NDArray[np.int64],
        stops: NDArray[np.int64],
        ends: NDArray[np.int64],
        lines: NDArray[np.int64],
    ) -> bool:
        """Check that signs lead, that a number has one point at most, and that each delimiter parts two fields."""
        width = len(self._columns)
        if int(np.count_nonzero(kinds == _SIGN)) != int(np.count_nonzero(kinds[starts] == _SIGN)):
            return False
        points = np.flatnonzero(kinds == _POINT)
        if len(points) > 1 and bool((np.diff(np.searchsorted(starts, points, side="right")) == 0).any()):
            return False
        delimiter = {",": _COMMA, ";": _SEMICOLON}.get(self._delimiter)
        marks = np.flatnonzero((kinds == _COMMA) | (kinds == _SEMICOLON))
        if delimiter is None:
            return not len(marks)
        # Exactly one delimiter behind each field of a row but its last: anything else is an empty field.
        if len(marks) != len(lines) * (width - 1) or bool((kinds[marks] != delimiter).any()):
            return False
        inner = np.ones(len(starts), np.bool_)
        inner[width - 1 :: width] = False
        following = np.concatenate([starts[1:], [len(kinds)]])
        return bool(((marks >= stops[inner]) & (marks < following[inner])).all())

    def _parse_lines(self, data: bytes, first_line: int) -> tuple[Block, InputError | None]:
        """Parse line by line: comments, exponents, and the exact place of a fault."""
        found: dict[str, list[int]] = {key: [] for key in "txyp"}
        lines: list[int] = []
        fault: InputError | None = None
        for number, line in enumerate(data.split(b"\n"), first_line):
            text = line.decode("utf-8", "replace").split("#")[0].strip()
            if not text:
                continue
            try:
                row = self._numbers(text)
            except ValueError as error:
                fault = InputError(self._path, f"row {number}", str(error))
                break
            lines.append(number)
            for key, value in row.items():
                found[key].append(value)
        t, x, y, p = (np.array(found[key], np.int64) for key in "txyp")
        block, earlier = self._maker.block(t, x, y, p, lambda row: f"row {lines[row]}")
        return block, earlier or fault

    def _numbers(self, text: str) -> dict[str, int]:
        """Parse one row; raise ``ValueError`` saying what is wrong with it."""
        fields, delimiter = split_row(text)
        if len(fields) != len(self._columns) or delimiter != self._delimiter:
            parted = f"parted by {self._delimiter!r}" if self._delimiter else "parted by white space"
            raise ValueError(f"found {text[:60]!r}, expected {len(self._columns)} fields {parted}")
        row: dict[str, int] = {}
        for key, field in zip(self._columns, fields, strict=True):
            if key == "-":
                continue
            if not NUMBER.fullmatch(field):
                raise ValueError(f"{key} is {field[:40]!r}, expected a number")
            number = Decimal(field)
            if key == "t":
                number = _in_microseconds(number, self._unit)
            elif number != number.to_integral_value() or abs(number) >= _MAX_COORDINATE:
                raise ValueError(f"{key} is {field[:40]!r}, expected a whole number")
            row[key] = int(number)
        return row


def _in_microseconds(number: Decimal, unit: str) -> Decimal:
    """Convert a time exactly, halves away from zero; raise ``ValueError`` beyond ±2^60 µs."""
    shifted = number.scaleb(_PLACES[unit] - (3 if unit == "ns" else 0), _EXACT)
    if abs(shifted) > MAX_TIME_US:
        raise ValueError(f"t is {str(number)[:40]}, expected a time within ±2^60 µs")
    return shifted.quantize(Decimal(1), ROUND_HALF_UP, _EXACT)
