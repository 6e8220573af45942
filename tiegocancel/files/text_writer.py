"""Write CSV: one event a line."""

from __future__ import annotations

from typing import ClassVar

from tiegocancel.events import Events
from tiegocancel.files.writer import EventWriter

__all__ = ["CsvWriter"]

_ROWS_A_WRITE = 1 << 16


class CsvWriter(EventWriter):
    """Write the header ``x,y,p,t_us`` and one row an event: column, row, polarity 0 or 1, time in whole µs.

    Rows are appended and flushed chunk by chunk: a killed process leaves all chunks written. There is no place for
    the sensor's size.
    """

    format: ClassVar[str] = "csv"
    holds_labels: ClassVar[bool] = False
    holds_size: ClassVar[bool] = False

    def _begin(self) -> None:
        self._file = self.path.open("w", encoding="ascii", newline="\n")
        self._file.write("x,y,p,t_us\n")

    def _append(self, events: Events) -> None:
        for start in range(0, len(events), _ROWS_A_WRITE):
            part = events[start : start + _ROWS_A_WRITE]
            rows = zip(part.x.tolist(), part.y.tolist(), part.p.tolist(), part.t.tolist(), strict=True)
            self._file.write("".join(map("%d,%d,%d,%d\n".__mod__, rows)))
        self._file.flush()

    def _finish(self) -> None:
        self._file.close()
