"""Read and write NPY arrays of events: structured rows, plain columns, and the thesis's disc slice."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import repeat
from pathlib import Path
from typing import IO, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import ConfigError, InputError
from tiegocancel.events import EVENT_DTYPE, Events
from tiegocancel.files.array_rows import ArrayRows
from tiegocancel.files.block import Block, place_namer
from tiegocancel.files.npy_header import HEADER_BYTES, header_bytes
from tiegocancel.files.options import ReadOptions
from tiegocancel.files.reader import EventReader
from tiegocancel.files.source import open_source, source_bytes
from tiegocancel.files.values import RowMaker, UndecidedError, decide_columns
from tiegocancel.files.writer import EventWriter

__all__ = ["NpyReader", "NpyWriter"]

_FIELDS = {
    "t": ("t", "ts", "timestamp"),
    "x": ("x",),
    "y": ("y",),
    "p": ("on", "p", "polarity"),
    "label": ("label",),
}
_SAMPLE_ROWS = 4096
_BLOCK_ROWS = 1 << 16
_MAX_COLUMNS = 64


class NpyReader(EventReader):
    """Read structured rows (``t x y on|p``, optional ``label``) or plain columns (N, 4), never unpickling.

    Plain columns need the time unit declared; their order is declared or decided by content. The thesis's slice,
    float (N, 5) of x, y, p, t in s and a flag, keeps the rows with flag 0: flag 1 marks its predictions. Rows are
    read a block at a time, so memory does not grow with the file. ``opener`` and ``size_bytes`` name a member of
    a ZIP archive instead of the whole file.
    """

    format: ClassVar[str] = "npy"

    def __init__(
        self,
        path: Path,
        options: ReadOptions,
        opener: Callable[[], IO[bytes]] | None = None,
        size_bytes: int = 0,
    ) -> None:
        self._zipped = opener is not None
        self._opener = opener or (lambda: open_source(path))
        self._bytes = size_bytes if opener else source_bytes(path)
        super().__init__(path, options)

    def _open(self) -> None:
        self._rows = ArrayRows(self.path, self._opener, self._bytes, zipped=self._zipped)
        self._label_rows: ArrayRows | None = None
        if self._rows.header.dtype.names:
            self._open_structured()
        elif 4 <= self._rows.columns <= _MAX_COLUMNS and self._rows.header.dtype.kind in "biuf":
            self._open_plain()
        else:
            raise self._rows.header.refuse("expected structured rows t x y on, or 4 columns")

    def _open_structured(self) -> None:
        """Find the fields by name; whole numbers are µs, as in the dtype that event tools exchange."""
        dtype = self._rows.header.dtype
        names = dtype.names or ()
        self._fields = {key: next((n for n in known if n in names), "") for key, known in _FIELDS.items()}
        missing = [key for key in "txyp" if not self._fields[key]]
        if missing or self._rows.columns:
            raise self._rows.header.refuse("expected one row an event with the fields t, x, y and on")
        kinds = {key: dtype[name].kind for key, name in self._fields.items() if name}
        if any(kind not in ("iuf" if key == "t" else "biuf") for key, kind in kinds.items()):
            raise self._rows.header.refuse("expected fields that hold one number each")
        self.labelled = bool(self._fields["label"])
        if self.options.time_unit is not None:
            self.time_unit = self.options.time_unit
            self.note(f"time unit: {self.time_unit}, as declared")
        elif kinds["t"] != "f" or not self._rows.length:
            self.note("time unit: us, as whole numbers in structured rows are")
        else:
            raise self._needs_unit(dtype[self._fields["t"]])

    def _open_plain(self) -> None:
        """Decide which column is which, and the unit of time."""
        self._order = self.options.columns or ""
        sample = next(self._rows.chunks(_SAMPLE_ROWS), np.zeros((0, self._rows.columns)))
        if not self._order and self._is_disc_slice(sample):
            self._order = "xypt-"
            self.time_unit = self.options.time_unit or "s"
            self.note("thesis layout x, y, p, t, flag: rows with flag 1 are its predictions and are left out")
            self.note(f"time unit: {self.time_unit}, {'as declared' if self.options.time_unit else 'by that layout'}")
            self._flagged = True
            return
        self._flagged = False
        if self._order and len(self._order) != self._rows.columns:
            raise ConfigError(
                f"columns {self._order!r} name {len(self._order)}, and {self.path} has {self._rows.columns}"
            )
        if not self._rows.length and not (self._order and self.options.time_unit):
            # Without events, neither the order nor the unit matters.
            self._order = self._order or "txyp"
            self.time_unit = self.options.time_unit or "us"
            return
        if not self._order:
            self._order = self._decided(sample)
            self.note(f"columns {','.join(self._order)}, decided by content")
        if self.options.time_unit is None:
            raise self._needs_unit(self._rows.header.dtype)
        self.time_unit = self.options.time_unit
        self.note(f"time unit: {self.time_unit}, as declared")

    def _decided(self, sample: NDArray[Any]) -> str:
        """Decide the order of four columns by content."""
        try:
            if self._rows.columns != 4:
                raise UndecidedError(f"there are {self._rows.columns} columns")
            return decide_columns(sample)
        except UndecidedError as error:
            raise self.fail("row 0", f"{error}: declare the order with --columns, such as txyp or xypt") from None

    def _is_disc_slice(self, sample: NDArray[Any]) -> bool:
        """Say whether rows are the thesis's: floats, and both the third and the last column are flags."""
        if self._rows.columns != 5 or self._rows.header.dtype.kind != "f" or not len(sample):
            return False
        return bool(np.isin(sample[:, (2, 4)], (0.0, 1.0)).all())

    def _needs_unit(self, dtype: np.dtype[Any]) -> InputError:
        return self.fail("header", f"times of type {dtype} have no unit: declare it with --time-unit s, ms, us or ns")

    def _blocks(self) -> Iterator[Block]:
        maker = RowMaker(self.path, self.time_unit)
        start, count = 0, self._rows.at_once(_BLOCK_ROWS)
        labels: Iterator[NDArray[Any] | None] = self._label_rows.chunks(count) if self._label_rows else repeat(None)
        for rows, label in zip(self._rows.chunks(count), labels, strict=False):
            index = np.arange(start, start + len(rows))
            start += len(rows)
            if rows.dtype.names:
                t, x, y, p = (rows[self._fields[key]] for key in "txyp")
                label = rows[self._fields["label"]] if self._fields["label"] else label
            else:
                if self._flagged:
                    wrong = ~np.isin(rows[:, 4], (0.0, 1.0))
                    if wrong.any():
                        row = int(np.argmax(wrong))
                        raise self.fail(f"row {index[row]}", f"flag is {rows[row, 4]}, expected 0 or 1")
                    kept = rows[:, 4] == 0
                    rows, index, label = rows[kept], index[kept], None if label is None else label[kept]
                t, x, y, p = (rows[:, self._order.index(key)] for key in "txyp")
            block, fault = maker.block(t, x, y, p, place_namer("row", index), label)
            yield block
            if fault is not None:
                raise fault


class NpyWriter(EventWriter):
    """Write structured rows of ``EVENT_DTYPE``; a killed process leaves a valid file of all chunks written.

    The array has no place for the sensor's size, and its times are unsigned: a time below 0 raises
    :class:`ConfigError`.
    """

    format: ClassVar[str] = "npy"
    holds_labels: ClassVar[bool] = False
    holds_size: ClassVar[bool] = False

    def _begin(self) -> None:
        self._file = self.path.open("wb")
        self._file.write(header_bytes(EVENT_DTYPE, 0))

    def _append(self, events: Events) -> None:
        if len(events) and events.t[0] < 0:
            raise ConfigError(f"NPY rows hold no times below 0 µs, and the first is {events.t[0]} µs: write NPZ or CSV")
        self._file.seek(HEADER_BYTES + self.count * EVENT_DTYPE.itemsize)
        self._file.write(events.to_structured().tobytes())
        self._file.seek(0)
        self._file.write(header_bytes(EVENT_DTYPE, self.count + len(events)))
        self._file.flush()

    def _finish(self) -> None:
        self._file.close()
