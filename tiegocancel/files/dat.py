"""Read Prophesee DAT files: decoded events of 8 bytes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from tiegocancel.files.block import Block, place_namer
from tiegocancel.files.prophesee_header import read_prophesee_header
from tiegocancel.files.reader import EventReader
from tiegocancel.files.source import open_source
from tiegocancel.files.words import words
from tiegocancel.files.wraps import Unwrapper

__all__ = ["DatReader"]

_EVENT_TYPES = (0x00, 0x0C)
_EVENT_BYTES = 8
_PERIOD_US = 1 << 32
_RECORD = np.dtype([("t", "<u4"), ("data", "<u4")])
_BLOCK_RECORDS = 1 << 16


class DatReader(EventReader):
    """Decode DAT version 2: after the text header a byte of type (0 or 12) and one of size (8), then the events.

    An event is its time in µs, 32 bits, and x in bits 13–0, y in bits 27–14, polarity in bits 31–28 of a second
    word, little-endian. Times wrap every 2^32 µs, which is followed.
    """

    format: ClassVar[str] = "dat"

    def _open(self) -> None:
        header = read_prophesee_header(self.path)
        if header.encoding not in ("dat", ""):
            raise self.fail("header", f"says encoding {header.encoding!r}, expected DAT")
        version = header.fields.get("version", "2")
        if version != "2":
            raise self.fail("header", f"says DAT version {version[:20]!r}, expected 2")
        with open_source(self.path) as source:
            source.seek(header.data_offset)
            kind = source.read(2)
        if len(kind) < 2:
            raise self.fail(f"byte {header.data_offset + len(kind)}", "ends before the event type and size")
        if kind[0] not in _EVENT_TYPES or kind[1] != _EVENT_BYTES:
            raise self.fail(
                f"byte {header.data_offset}",
                f"event type {kind[0]} of {kind[1]} bytes, expected type 0 or 12 of {_EVENT_BYTES} bytes",
            )
        self._offset = header.data_offset + 2
        self._size_of_file = header.size

    def _blocks(self) -> Iterator[Block]:
        clock = Unwrapper(_PERIOD_US)
        for piece, offset in words(self.path, _RECORD, self._offset, _BLOCK_RECORDS):
            data = piece["data"]
            polarity = (data >> 28).astype(np.uint8)
            block = Block(
                clock.unwrap(piece["t"]),
                (data & 0x3FFF).astype(np.uint16),
                ((data >> 14) & 0x3FFF).astype(np.uint16),
                polarity,
                place_namer("byte", range(offset, offset + _EVENT_BYTES * len(piece), _EVENT_BYTES)),
            )
            wrong = polarity > 1
            if not wrong.any():
                yield block
                continue
            at = int(np.argmax(wrong))
            yield block.head(at)
            raise self.fail(f"byte {offset + _EVENT_BYTES * at}", f"polarity is {polarity[at]}, expected 0 or 1")
