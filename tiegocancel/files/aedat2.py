"""Read AEDAT 2.0, jAER's format: pairs of address and time whose layout depends on the chip."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from tiegocancel.files.block import Block
from tiegocancel.files.reader import EventReader
from tiegocancel.files.source import first_bytes
from tiegocancel.files.words import words
from tiegocancel.files.wraps import Unwrapper

__all__ = ["Aedat2Reader"]

_MAX_HEADER_BYTES = 1 << 20
_RECORD = np.dtype([("address", ">u4"), ("t", ">u4")])
_BLOCK_RECORDS = 1 << 16
_PERIOD_US = 1 << 32
_DVS128 = (128, 128)
_DVS128_EXTERNAL = 0x8000
_DAVIS_SIZES = {"128": (128, 128), "208": (208, 192), "240": (240, 180), "346": (346, 260), "640": (640, 480)}
"""Sensor sizes in px by the number in the chip's name; DAVIS208 to 640 from iniVation's chip table."""
_DAVIS_OTHER = 0x8000_0400
"""Bit 31: a sample of a frame or the IMU. Bit 10: an external event."""


class Aedat2Reader(EventReader):
    """Decode AEDAT 2.0: big-endian 32-bit address and 32-bit time in µs, after lines that begin with ``#``.

    DVS128: y in bits 14–8, x in bits 7–1, bit 0 set = OFF. DAVIS: y in bits 30–22, x in bits 21–12, bit 11 set = ON;
    words of frames, IMU and external events are passed over. The chip is named in the header; where none is named,
    a declared size of a DAVIS means that chip, otherwise it is a DVS128 whose addresses must fit 15 bits. Columns
    and rows are those of the address; jAER counts rows from the lower edge.
    """

    format: ClassVar[str] = "aedat2"

    def _open(self) -> None:
        start = first_bytes(self.path, _MAX_HEADER_BYTES)
        if not start.startswith(b"#!AER-DAT2"):
            raise self.fail("byte 0", f"found {start[:10]!r}, expected '#!AER-DAT2.0'")
        self._offset, lines = _header(start)
        chip = next((line.split(":", 1)[1].strip() for line in lines if line.lower().startswith("aechip:")), "")
        name = chip.rsplit(".", 1)[-1]
        self._named = bool(name)
        self._davis = False
        if name.upper().startswith("DAVIS"):
            number = re.search(r"\d+", name)
            size = _DAVIS_SIZES.get(number[0]) if number else None
            if size is None:
                raise self.fail("header", f"chip {name[:40]!r} is not known, expected DVS128 or DAVIS240, 346 or 640")
            self._davis, self._size_of_file = True, size
        elif "DVS128" in name.upper():
            self._size_of_file = _DVS128
        elif name:
            raise self.fail("header", f"chip {name[:40]!r} is not known, expected DVS128 or DAVIS240, 346 or 640")
        elif (self.options.width, self.options.height) in list(_DAVIS_SIZES.values())[1:]:
            self._davis = True
            self.note("no chip named in the header: DAVIS, as the declared size says")
        else:
            self._size_of_file = _DVS128
            self.note("no chip named in the header: DVS128, as long as every address fits 15 bits")
        self.note("rows count from the lower edge, as jAER writes them")

    def _blocks(self) -> Iterator[Block]:
        clock = Unwrapper(_PERIOD_US)
        passed_over = 0
        for piece, offset in words(self.path, _RECORD, self._offset, _BLOCK_RECORDS):
            address, time_us = piece["address"].astype(np.uint32), clock.unwrap(piece["t"])
            limit = len(address)
            if not self._davis:
                largest = 0xFFFF if self._named else 0x7FFF
                limit = int(np.argmax(address > largest)) if int(address.max()) > largest else limit
            other = (address & (_DAVIS_OTHER if self._davis else _DVS128_EXTERNAL)) != 0
            at = np.flatnonzero(~other[:limit])
            passed_over += limit - len(at)
            yield self._block(address[at], time_us[at], offset, at)
            if limit < len(address):
                chip = "a DVS128" if self._named else "a DVS128 (no chip is named: a DAVIS needs --width and --height)"
                raise self.fail(f"byte {offset + 8 * limit}", f"address {int(address[limit]):#x} is none of {chip}")
        if passed_over:
            self.note(f"{passed_over} words passed over that are no brightness changes")
        if clock.wraps:
            self.note(f"the clock wrapped {clock.wraps} times, and time goes on")

    def _block(self, address: NDArray[np.uint32], time_us: NDArray[np.int64], offset: int, at: NDArray[Any]) -> Block:
        """Take column, row and polarity out of addresses [n], which stand at the record indices ``at``."""
        if self._davis:
            x, y, p = (address >> 12) & 0x3FF, (address >> 22) & 0x1FF, (address >> 11) & 1
        else:
            x, y, p = (address >> 1) & 0x7F, (address >> 8) & 0x7F, ~address & 1
        return Block(
            time_us,
            x.astype(np.uint16),
            y.astype(np.uint16),
            p.astype(np.uint8),
            lambda row: f"byte {offset + 8 * int(at[row])}",
        )


def _header(start: bytes) -> tuple[int, list[str]]:
    """Return where data begin, and the header's lines without their ``#``."""
    offset, lines = 0, []
    while start[offset : offset + 1] == b"#":
        stop = start.find(b"\n", offset)
        line = start[offset + 1 : stop].strip()
        # Data may begin with the byte of '#' too: a header line is printable.
        if stop < 0 or any(byte < 32 and byte != 9 for byte in line):
            break
        offset = stop + 1
        lines.append(line.decode("utf-8", "replace"))
        if lines[-1].lower().startswith("end of ascii header"):
            break
    return offset, lines
