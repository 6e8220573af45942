"""Read flat buffers within their bounds: the tables in which AEDAT 4.0 packs its header and its samples."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["FlatBufferError", "field_column", "field_place", "root_table", "table_vector", "text_at"]


_MOST_LAYOUTS = 64
"""Descriptions of fields that the tables of one vector may have; a writer needs one for each field left out."""


class FlatBufferError(ValueError):
    """Say where an offset of a flat buffer leads outside it."""


def root_table(data: bytes) -> int:
    """Return the place of the root table of a buffer without size prefix."""
    return _checked(_u32(data, 0), 4, data)


def field_place(data: bytes, table: int, field: int, size: int) -> int | None:
    """Return where field number ``field`` of a table lies, ``None`` where it holds its default."""
    _checked(table, 4, data)
    fields = table - int.from_bytes(data[table : table + 4], "little", signed=True)
    _checked(fields, 4, data)
    length = int.from_bytes(data[fields : fields + 2], "little")
    _checked(fields, length, data)
    if length < 6 + 2 * field:
        return None
    offset = int.from_bytes(data[fields + 4 + 2 * field : fields + 6 + 2 * field], "little")
    return _checked(table + offset, size, data) if offset else None


def text_at(data: bytes, table: int, field: int) -> str:
    """Return a field of text; empty where it is absent."""
    place = field_place(data, table, field, 4)
    if place is None:
        return ""
    start = place + _u32(data, place)
    length = _u32(data, start)
    _checked(start + 4, length, data)
    return data[start + 4 : start + 4 + length].decode("utf-8", "replace")


def table_vector(data: bytes, table: int, field: int) -> NDArray[np.int64]:
    """Return the places int64[n] of the tables in a vector; none where the field is absent."""
    place = field_place(data, table, field, 4)
    if place is None:
        return np.zeros(0, np.int64)
    start = place + _u32(data, place)
    count = _u32(data, start)
    _checked(start + 4, 4 * count, data)
    offsets = np.frombuffer(data, "<u4", count, start + 4).astype(np.int64)
    tables = start + 4 + 4 * np.arange(count, dtype=np.int64) + offsets
    if count and int(tables.max()) + 4 > len(data):
        raise FlatBufferError(f"a table at byte {int(tables.max())} of {len(data)}")
    return tables


def field_column(data: bytes, tables: NDArray[np.int64], field: int, dtype: str) -> NDArray[Any]:
    """Return one field of many tables as an array; 0 where a table leaves it out, as flat buffers do."""
    kind = np.dtype(dtype)
    raw = np.frombuffer(data, np.uint8)
    values = np.zeros(len(tables), kind)
    if not len(tables):
        return values
    fields = tables - _gather(raw, tables, np.dtype("<i4")).astype(np.int64)
    # Tables written by one program share few descriptions of their fields, so each is looked at once.
    layouts = np.unique(fields)
    if len(layouts) > _MOST_LAYOUTS:
        raise FlatBufferError(f"{len(layouts)} layouts of tables, expected at most {_MOST_LAYOUTS}")
    for own in layouts.tolist():
        _checked(own, 4, data)
        length = int.from_bytes(data[own : own + 2], "little")
        _checked(own, length, data)
        if length < 6 + 2 * field:
            continue
        offset = int.from_bytes(data[own + 4 + 2 * field : own + 6 + 2 * field], "little")
        if not offset:
            continue
        rows = fields == own
        places = tables[rows] + offset
        if int(places.max()) + kind.itemsize > len(data):
            raise FlatBufferError(f"a field at byte {int(places.max())} of {len(data)}")
        values[rows] = _gather(raw, places, kind)
    return values


def _gather(raw: NDArray[np.uint8], places: NDArray[np.int64], kind: np.dtype[Any]) -> NDArray[Any]:
    """Read one number at each place; they need not be aligned."""
    numbers: NDArray[Any] = raw[places[:, None] + np.arange(kind.itemsize)].view(kind)[:, 0]
    return numbers


def _u32(data: bytes, place: int) -> int:
    _checked(place, 4, data)
    return int(struct.unpack_from("<I", data, place)[0])


def _checked(place: int, size: int, data: bytes) -> int:
    if not 0 <= place <= len(data) - size:
        raise FlatBufferError(f"{size} bytes at byte {place} of {len(data)}")
    return place
