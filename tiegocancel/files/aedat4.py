"""Read AEDAT 4.0, iniVation DV's format, through eventcv."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import ClassVar

from tiegocancel.errors import InputError
from tiegocancel.files.eventcv_bridge import EventcvReader
from tiegocancel.files.source import open_source, source_bytes

__all__ = ["Aedat4Reader"]

_VERSION_BYTES = 14
_MAX_HEADER_BYTES = 1 << 24
_NO_TABLE = -1


class Aedat4Reader(EventcvReader):
    """Decode AEDAT 4.0; times are µs since 1970 and the size is the file's.

    eventcv passes over a packet that is cut off, so the chain of packets is walked here first: a file that ends
    inside one is a fault after its last whole packet.
    """

    format: ClassVar[str] = "aedat4"
    suffix: ClassVar[str] = ".aedat4"

    def _prepare(self) -> None:
        self._arguments = {"time_unit": "microseconds"}
        self._fault_at_end = _broken_packet(self.path)


def _broken_packet(path: Path) -> InputError | None:
    """Follow the packets (stream and size, int32 each, then the body) and return the fault where they break off.

    The header is a flat buffer: its second field is the position of the table behind the last packet, −1 if the
    recording was never closed.
    """
    size_bytes = source_bytes(path)
    with open_source(path) as source:
        start = source.read(_VERSION_BYTES + 4)
        if not start.startswith(b"#!AER-DAT4.0\r\n") or len(start) < _VERSION_BYTES + 4:
            raise InputError(path, "byte 0", f"found {start[:14]!r}, expected '#!AER-DAT4.0' and a header")
        length = int.from_bytes(start[_VERSION_BYTES:], "little")
        if length > min(_MAX_HEADER_BYTES, size_bytes):
            raise InputError(path, f"byte {_VERSION_BYTES}", f"header of {length} bytes, and the file has {size_bytes}")
        header = source.read(length)
        try:
            end = _table_position(header)
        except struct.error:
            raise InputError(path, f"byte {_VERSION_BYTES + 4}", "broken header, expected a flat buffer") from None
        at = _VERSION_BYTES + 4 + length
        end = size_bytes if end == _NO_TABLE else end
        while at < end:
            source.seek(at)
            head = source.read(8)
            if len(head) < 8:
                return InputError(path, f"byte {at}", f"ends before its last packet, expected packets up to byte {end}")
            body = int.from_bytes(head[4:], "little", signed=True)
            if body < 0 or at + 8 + body > min(end, size_bytes):
                return InputError(
                    path, f"byte {at}", f"packet of {body} bytes, and {min(end, size_bytes) - at - 8} are left"
                )
            at += 8 + body
    return None


def _table_position(header: bytes) -> int:
    """Return the second field of the header, int64; raise ``struct.error`` where offsets lead outside."""
    (root,) = struct.unpack_from("<I", header, 0)
    (back,) = struct.unpack_from("<i", header, root)
    fields = root - back
    if not 0 <= fields <= len(header):
        raise struct.error("offset outside the header")
    (fields_bytes,) = struct.unpack_from("<H", header, fields)
    if fields_bytes < 8:
        return _NO_TABLE
    (offset,) = struct.unpack_from("<H", header, fields + 6)
    if not offset:
        return _NO_TABLE
    (position,) = struct.unpack_from("<q", header, root + offset)
    return int(position)
