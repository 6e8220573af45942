"""Read the text header of Prophesee RAW and DAT files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tiegocancel.errors import InputError
from tiegocancel.files.short import short
from tiegocancel.files.source import first_bytes

__all__ = ["PropheseeHeader", "parse_prophesee_header", "read_prophesee_header"]

_MAX_HEADER_BYTES = 65_536
_MAX_LINE_BYTES = 4096
_MAX_SIZE_DIGITS = 9

_SENSOR_SIZES = {
    "gen3": (640, 480),
    "gen31": (640, 480),
    "gen4": (1280, 720),
    "gen41": (1280, 720),
    "imx636": (1280, 720),
    "imx646": (1280, 720),
    "genx320": (320, 320),
}
"""Sensor sizes in px by the name in a recording plug-in (``hal_plugin_gen41_evk3``); Prophesee's data sheets."""


@dataclass(frozen=True, slots=True)
class PropheseeHeader:
    """Fields of a header, keys in lower case; ``data_offset`` is the byte where binary data begin.

    ``encoding`` is ``evt2``, ``evt21``, ``evt3``, ``dat``, another encoding's name, or empty when nothing says it.
    ``size`` in px with ``size_source`` saying where it was found, or ``None``.
    """

    fields: Mapping[str, str]
    data_offset: int
    encoding: str
    size: tuple[int, int] | None
    size_source: str


def parse_prophesee_header(path: Path, start: bytes) -> PropheseeHeader:
    """Read the lines that begin with ``%``, at most 64 KiB; a file without any has an empty header.

    Data may begin with the byte of ``%`` too: a header line is printable text, and ``% end`` is the last one.
    A size of more than 9 digits raises :class:`InputError`.
    """
    fields: dict[str, str] = {}
    offset = 0
    while start[offset : offset + 1] == b"%":
        stop = start.find(b"\n", offset, offset + _MAX_LINE_BYTES)
        if stop < 0:
            break
        line = start[offset + 1 : stop].strip(b" \t\r")
        if any(byte < 32 and byte != 9 for byte in line) or b"\x7f" in line:
            break
        offset = stop + 1
        text = line.decode("utf-8", "replace")
        if text.lower() == "end":
            break
        key, _, value = text.partition(" ")
        if key.lower() == "data" and "file" in value.lower():
            fields["data file"] = text
        else:
            fields[key.lower().rstrip(":")] = value.strip()
    size, size_source = _size(path, fields)
    return PropheseeHeader(fields, offset, _encoding(fields), size, size_source)


def read_prophesee_header(path: Path) -> PropheseeHeader:
    """Read the header of a file."""
    return parse_prophesee_header(path, first_bytes(path, _MAX_HEADER_BYTES))


def _encoding(fields: Mapping[str, str]) -> str:
    """Name the encoding: ``format EVT3;height=…`` is newer than ``evt 3.0``, both may stand together."""
    if "data file" in fields:
        return "dat"
    if "format" in fields:
        return fields["format"].split(";")[0].strip().lower().replace(".", "")
    if "evt" in fields:
        version = fields["evt"].strip()
        return "evt" + version.removesuffix(".0").replace(".", "")
    return ""


def _size(path: Path, fields: Mapping[str, str]) -> tuple[tuple[int, int] | None, str]:
    """Find the sensor's size: format options, geometry, separate lines, at last the plug-in's name."""
    options = dict(part.split("=", 1) for part in fields.get("format", "").split(";")[1:] if "=" in part)
    geometry = fields.get("geometry", "").partition("x")
    for width, height, source in (
        (options.get("width", ""), options.get("height", ""), "header line format"),
        (geometry[0], geometry[2], "header line geometry"),
        (fields.get("width", ""), fields.get("height", ""), "header lines width and height"),
    ):
        if width.isdecimal() and height.isdecimal():
            if max(len(width), len(height)) > _MAX_SIZE_DIGITS:
                raise InputError(path, "header", f"sensor size is {short(f'{width} x {height}')}, expected px")
            return (int(width), int(height)), source
    for part in re.split(r"[^a-z0-9]+", fields.get("plugin_name", "").lower()):
        if part in _SENSOR_SIZES:
            return _SENSOR_SIZES[part], f"plug-in name {fields['plugin_name']}"
    return None, ""
