"""Tell the format of a recording by its first bytes, and by its suffix where these say nothing."""

from __future__ import annotations

from pathlib import Path

from tiegocancel.errors import InputError
from tiegocancel.files.npy_header import MAGIC
from tiegocancel.files.prophesee_header import parse_prophesee_header
from tiegocancel.files.source import first_bytes

__all__ = ["sniff"]

_SNIFFED_BYTES = 65_536
_MAGICS = (
    (MAGIC, "npy"),
    (b"PK\x03\x04", "npz"),
    (b"PK\x05\x06", "npz"),
    (b"#!AER-DAT2", "aedat2"),
    (b"#!AER-DAT4", "aedat4"),
    (b"\x89HDF\r\n\x1a\n", "hdf5"),
    (b"#ROSBAG V2", "rosbag"),
)
_ENCODINGS = {"evt2": "evt2", "evt3": "evt3", "dat": "dat"}
_SUFFIXES = {".raw": "--format evt2 or evt3", ".dat": "--format dat"}
_EXPECTED = "NPZ, NPY, text, Prophesee RAW or DAT, AEDAT, HDF5 or ROS bag"


def sniff(path: Path) -> str:
    """Return the name of the format; raise :class:`InputError` for none, and for those that are refused."""
    start = first_bytes(path, _SNIFFED_BYTES)
    if not start:
        raise InputError(path, "byte 0", "the file is empty, expected a recording")
    for magic, name in _MAGICS:
        if start.startswith(magic):
            return name
    if start.startswith(b"#!AER-DAT"):
        version = start[9:12].decode("ascii", "replace")
        raise InputError(path, "byte 9", f"AEDAT version {version!r} is not read, expected 2.0 or 4.0")
    if start.startswith(b"%"):
        encoding = parse_prophesee_header(path, start).encoding
        if encoding in _ENCODINGS:
            return _ENCODINGS[encoding]
        if encoding in ("evt21", "evt4"):
            raise InputError(
                path, "header", f"encoding {encoding.upper()} is not read: record or convert to EVT 2.0 or 3.0"
            )
        if encoding:
            raise InputError(path, "header", f"encoding {encoding!r} is not known, expected EVT 2.0, EVT 3.0 or DAT")
        if not _is_text(start):
            hint = _SUFFIXES.get(path.suffix.lower(), "--format evt2, evt3 or dat")
            raise InputError(path, "header", f"does not say the encoding: declare it with {hint}")
    if path.suffix.lower() in _SUFFIXES and not _is_text(start):
        raise InputError(path, "byte 0", f"has no header: declare the encoding with {_SUFFIXES[path.suffix.lower()]}")
    if _is_text(start):
        return "text"
    raise InputError(path, "byte 0", f"found {start[:8]!r}, expected {_EXPECTED}")


def _is_text(start: bytes) -> bool:
    """Say whether bytes could be text of numbers: printable, whatever the line ends."""
    return not any(byte < 32 and byte not in (9, 10, 13) for byte in start[:4096]) and b"\x7f" not in start[:4096]
