"""Read the inertial samples of AEDAT 4.0, iniVation DV's format; events and frames are skipped unread.

Axes. iniVation's guide gives the camera's axes as x right, y up, z towards the lens, and a rate as positive
counter-clockwise along each axis, for all its cameras. Along x that is −Ω_x of the right-hand rule; along y, which
points up, +Ω_y of an axis that points down; along z −Ω_z. That is the map ``-x,y,-z``, and the same three signs are in
the ROS driver of the DAVIS. A DAVIS346 at rest agrees for y (−1 g). No turn was checked against a device.

Layout: the line ``#!AER-DAT4.0``, a header (flat buffer with the compression and an XML list of streams), then packets:
stream and size, int32 each, then a flat buffer, compressed as the header says.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import InputError, MissingExtraError
from tiegocancel.estimation.inertial.flat_tables import (
    FlatBufferError,
    field_column,
    field_place,
    root_table,
    table_vector,
    text_at,
)
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.events import MAX_TIME_US
from tiegocancel.files.source import open_source, source_bytes
from tiegocancel.motion.rotation import MAX_OMEGA_RAD_S

__all__ = ["AXES", "read_aedat4_gyro"]

AXES = "-x,y,-z"
"""The camera's axes in terms of the gyroscope's."""

_MAGIC = b"#!AER-DAT4.0\r\n"
_MAX_HEADER_BYTES = 1 << 24
_MAX_PACKET_BYTES = 1 << 24
_STREAM = "IMUS"
_TIME, _GYRO = 0, (5, 6, 7)
"""Fields of a sample: time in µs, and the rates about x, y and z in degrees a second."""

Unpack = Callable[[bytes], bytes]


def read_aedat4_gyro(path: Path, *, keep_going: bool = False) -> GyroSamples:
    """Read all samples of the first inertial stream, in the device's axes; times are µs since 1970, as the events'.

    ``keep_going`` returns the samples before a fault, with a note. Raise ``InputError`` naming the byte of a fault,
    also when the file has no inertial stream, and ``MissingExtraError`` where the decompressor is not installed.
    """
    size = source_bytes(path)
    times: list[NDArray[np.int64]] = []
    rates: list[NDArray[np.float64]] = []
    with open_source(path) as source:
        compression, end, streams, start = _header(path, source, size)
        unpack = _unpacker(path, compression)
        notes = [f"inertial stream {streams[0]} of the recording"]
        if len(streams) > 1:
            notes.append(f"inertial streams {streams[1:]} were left out")
        try:
            for place, body in _packets(path, source, start, end, size, streams[0]):
                t_us, rate = _samples(path, place, body, unpack)
                times.append(t_us)
                rates.append(rate)
        except InputError as fault:
            if not (keep_going and any(map(len, times))):
                raise
            notes.append(f"stopped at a fault: {fault.where}: {fault.problem}")
    if not any(map(len, times)):
        raise InputError(path, "", f"has the inertial stream {streams[0]} and no sample in it")
    return GyroSamples.from_unsorted(np.concatenate(times), np.concatenate(rates), source=path.name, notes=notes)


def _header(path: Path, source: BinaryIO, size: int) -> tuple[int, int, list[int], int]:
    """Return the compression, the end of the packets, the inertial streams and the place of the first packet."""
    prefix = len(_MAGIC) + 4
    start = source.read(prefix)
    if not start.startswith(_MAGIC) or len(start) < prefix:
        raise InputError(path, "byte 0", f"found {start[:14]!r}, expected '#!AER-DAT4.0' and a header")
    length = int.from_bytes(start[len(_MAGIC) :], "little")
    if length > min(_MAX_HEADER_BYTES, size - prefix):
        raise InputError(path, f"byte {len(_MAGIC)}", f"header of {length} bytes, and {size - prefix} are left")
    header = source.read(length)
    try:
        root = root_table(header)
        place = field_place(header, root, 0, 4)
        compression = 0 if place is None else int.from_bytes(header[place : place + 4], "little", signed=True)
        place = field_place(header, root, 1, 8)
        # The table behind the last packet; −1, and so the default, if the recording was never closed.
        table = -1 if place is None else int.from_bytes(header[place : place + 8], "little", signed=True)
        streams = _streams(text_at(header, root, 2))
    except FlatBufferError as error:
        raise InputError(path, f"byte {prefix}", f"broken header: {error}") from None
    except ElementTree.ParseError as error:
        raise InputError(path, f"byte {prefix}", f"broken list of streams: {error}") from None
    if not streams:
        raise InputError(path, f"byte {prefix}", "has no inertial stream (IMUS)")
    return compression, size if table < 0 else table, streams, prefix + length


def _streams(text: str) -> list[int]:
    """Return the numbers of the inertial streams that the XML of the header lists."""
    if "<!" in text:
        raise FlatBufferError("its XML declares entities, expected nodes and attributes alone")
    found = []
    for info in ElementTree.fromstring(text).iterfind(".//node[@name='outInfo']"):
        for node in info.iterfind("node"):
            name = node.get("name", "")
            kind = next((item.text for item in node.iterfind("attr[@key='typeIdentifier']")), None)
            if kind == _STREAM and name.isascii() and name.isdigit() and len(name) < 10:
                found.append(int(name))
    return found


def _packets(path: Path, source: BinaryIO, start: int, end: int, size: int, stream: int) -> Iterator[tuple[int, bytes]]:
    """Yield place and body of each packet of one stream; the others are stepped over."""
    at = start
    while at < end:
        source.seek(at)
        head = source.read(8)
        if len(head) < 8:
            raise InputError(path, f"byte {at}", f"ends before its last packet, expected packets up to byte {end}")
        own = int.from_bytes(head[:4], "little", signed=True)
        length = int.from_bytes(head[4:], "little", signed=True)
        left = min(end, size) - at - 8
        if not 0 <= length <= left:
            raise InputError(path, f"byte {at}", f"packet of {length} bytes, and {left} are left")
        if own == stream:
            if length > _MAX_PACKET_BYTES:
                raise InputError(path, f"byte {at}", f"packet of {length} bytes, expected at most {_MAX_PACKET_BYTES}")
            yield at, source.read(length)
        at += 8 + length


def _samples(path: Path, place: int, body: bytes, unpack: Unpack) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Decode one packet into times int64[n] in µs and rates float64[n, 3] in rad/s."""
    where = f"packet at byte {place}"
    try:
        data = unpack(body)
    except (RuntimeError, ValueError, EOFError) as error:
        reason = " ".join(str(error).split())
        raise InputError(path, where, f"cannot be decompressed: {reason[:200]}") from None
    if len(data) < 8 or int.from_bytes(data[:4], "little") > len(data) - 4:
        raise InputError(path, where, f"holds {len(data)} bytes, fewer than it says")
    table_data = data[4:]
    try:
        if table_data[4:8] != _STREAM.encode():
            raise FlatBufferError(f"found {table_data[4:8]!r}, expected {_STREAM!r}")
        tables = table_vector(table_data, root_table(table_data), 0)
        t_us = field_column(table_data, tables, _TIME, "<i8")
        degrees = np.stack([field_column(table_data, tables, field, "<f4") for field in _GYRO], axis=1)
    except FlatBufferError as error:
        raise InputError(path, where, f"broken flat buffer: {error}") from None
    # A signalling NaN in a spoilt file would warn here; it is refused below.
    with np.errstate(invalid="ignore"):
        rate = np.radians(degrees.astype(np.float64))
    wrong = ~(np.abs(rate) <= MAX_OMEGA_RAD_S).all(axis=1) | (t_us < -MAX_TIME_US) | (t_us > MAX_TIME_US)
    if wrong.any():
        row = int(wrong.argmax())
        raise InputError(
            path, f"{where}, sample {row}", f"t = {t_us[row]} µs, rate {degrees[row].tolist()} °/s: not a measurement"
        )
    return t_us, rate


def _unpacker(path: Path, compression: int) -> Unpack:
    """Return what decompresses a packet, to :data:`_MAX_PACKET_BYTES` at most."""
    task = f"reading the gyroscope of AEDAT4 ({path})"
    if compression == 0:
        return bytes
    if compression in (1, 2):
        try:
            from lz4.frame import LZ4FrameDecompressor
        except ImportError:
            raise MissingExtraError(task, "lz4", "files") from None

        def lz4(body: bytes) -> bytes:
            frame = LZ4FrameDecompressor()
            return _whole(frame.decompress(body, max_length=_MAX_PACKET_BYTES), frame.eof)

        return lz4
    if compression in (3, 4):
        try:
            import zstandard
        except ImportError:
            raise MissingExtraError(task, "zstandard", "files") from None

        def zstd(body: bytes) -> bytes:
            try:
                with zstandard.ZstdDecompressor(max_window_size=_MAX_PACKET_BYTES).stream_reader(body) as reader:
                    data = reader.read(_MAX_PACKET_BYTES)
                    return _whole(data, len(data) < _MAX_PACKET_BYTES)
            except zstandard.ZstdError as error:
                raise ValueError(str(error)) from None

        return zstd
    raise InputError(path, f"byte {len(_MAGIC) + 4}", f"compression {compression} is not known, expected 0 to 4")


def _whole(data: bytes, done: bool) -> bytes:
    if not done:
        raise ValueError(f"it ends early, or grows beyond {_MAX_PACKET_BYTES} bytes")
    return data
