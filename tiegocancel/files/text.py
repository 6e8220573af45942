"""Read text recordings: one event a line, columns and unit declared by a header or by the user."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from tiegocancel.errors import ConfigError
from tiegocancel.files.block import Block
from tiegocancel.files.reader import EventReader
from tiegocancel.files.source import open_source
from tiegocancel.files.text_header import MAX_LINE_BYTES, read_text_header
from tiegocancel.files.text_rows import TextRows
from tiegocancel.files.values import UndecidedError, decide_columns

__all__ = ["TextReader"]

_BLOCK_BYTES = 1 << 20
_SAMPLE_BYTES = 1 << 16
_SECONDS = re.compile(r"\d+\.\d{6,}", re.ASCII)


class TextReader(EventReader):
    """Read rows ``x,y,p,t`` or ``t x y p``, separated by commas, semicolons or white space; ``#`` begins a comment.

    Polarity is {0, 1} or {−1, 1}. The unit of time is the header's or declared. One layout carries its unit without a
    header: ``t x y p`` between blanks with six decimals or more in ``t``, which public data sets write in seconds.
    Without a header the order of the columns is declared or decided by content. Decimal times become whole
    microseconds exactly: digit by digit, halves away from zero. Rows count from 1, header and comments included.
    """

    format: ClassVar[str] = "text"

    def _open(self) -> None:
        self._header = header = read_text_header(self.path)
        self._size_of_file = header.size
        if header.size is not None:
            self.note(f"sensor size {header.size[0]}x{header.size[1]} from the first row")
        fields = len(header.first_row)
        self._columns = self.options.columns or header.columns
        if self._columns and len(self._columns) != fields:
            source = "--columns" if self.options.columns else "the header"
            problem = f"{fields} fields, expected {len(self._columns)} as {source} names them"
            if self.options.columns:
                raise ConfigError(f"{self.path}: row {header.lines + 1}: {problem}")
            raise self.fail(f"row {header.lines + 1}", problem)
        if not self._columns:
            self._columns = self._decided()
            self.note(f"columns {','.join(self._columns)}, decided by content")
        by_layout = "" if self.options.time_unit or header.time_unit else self._unit_by_layout()
        unit = self.options.time_unit or header.time_unit or by_layout
        if not unit:
            shown = (header.delimiter or " ").join(header.first_row)
            raise self.fail(
                f"row {header.lines + 1}",
                f"neither a header nor a flag says the unit of time, and the row is {shown[:60]!r}: "
                "declare --time-unit s, ms, us or ns",
            )
        self.time_unit = unit
        source = "as declared" if self.options.time_unit else "from the header"
        if by_layout:
            source = "as public data sets write t x y p with decimals; --time-unit declares another"
        if header.time_unit not in ("", unit):
            source = f"as declared, although the header says {header.time_unit}"
        self.note(f"time unit: {unit}, {source}")

    def _unit_by_layout(self) -> str:
        """Return ``s`` for the layout of public data sets (UZH event-camera data set and its kin), else nothing."""
        header = self._header
        known = not header.columns and not header.delimiter and self._columns == "txyp"
        return "s" if known and _SECONDS.fullmatch(header.first_row[0]) else ""

    def _decided(self) -> str:
        """Decide the order of four columns by the first rows."""
        header, row = self._header, f"row {self._header.lines + 1}"
        if len(header.first_row) != 4:
            raise self.fail(
                row, f"{len(header.first_row)} fields and no header that names them: declare --columns, such as txyp"
            )
        with open_source(self.path) as source:
            source.seek(header.data_offset)
            lines = source.read(_SAMPLE_BYTES).split(b"\n")
        rows: list[list[float]] = []
        for line in lines[:-1] or lines:
            text = line.decode("ascii", "replace").split("#")[0].replace(",", " ").replace(";", " ")
            fields = text.split()
            try:
                numbers = [float(field) for field in fields]
            except ValueError:
                break
            if len(numbers) == 4:
                rows.append(numbers)
        try:
            return decide_columns(np.array(rows).reshape(-1, 4))
        except UndecidedError as error:
            raise self.fail(row, f"{error}: declare the order with --columns, such as txyp or xypt") from None

    def _blocks(self) -> Iterator[Block]:
        header = self._header
        parser = TextRows(self.path, self._columns, self.time_unit, header.delimiter)
        line, offset, left = header.lines + 1, header.data_offset, b""
        with open_source(self.path) as source:
            source.seek(offset)
            while True:
                data = source.read(_BLOCK_BYTES)
                piece = left + data
                cut = len(piece) if not data else piece.rfind(b"\n") + 1
                piece, left = piece[:cut], piece[cut:]
                if piece:
                    block, fault = parser.parse(piece, line)
                    yield block
                    if fault is not None:
                        raise fault
                    line += piece.count(b"\n")
                if len(left) > MAX_LINE_BYTES:
                    raise self.fail(f"row {line}", f"longer than {MAX_LINE_BYTES} bytes, expected a row of numbers")
                if not data:
                    return
