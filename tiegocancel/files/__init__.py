"""Read and write recordings of event cameras, in chunks: one format, one file; told by the header, then the suffix."""

from __future__ import annotations

from tiegocancel.files.opening import WRITABLE, open_events, open_writer, read_events, write_events
from tiegocancel.files.options import TIME_UNITS, ReadOptions
from tiegocancel.files.reader import EventReader
from tiegocancel.files.sniff import sniff
from tiegocancel.files.writer import EventWriter

__all__ = [
    "TIME_UNITS",
    "WRITABLE",
    "EventReader",
    "EventWriter",
    "ReadOptions",
    "open_events",
    "open_writer",
    "read_events",
    "sniff",
    "write_events",
]
