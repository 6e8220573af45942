"""Read and write the header of an NPY array without trusting it."""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from tiegocancel.errors import InputError
from tiegocancel.files.short import short

__all__ = ["HEADER_BYTES", "MAGIC", "NpyHeader", "header_bytes", "parse_header"]

MAGIC = b"\x93NUMPY"
HEADER_BYTES = 256
"""Size of the headers written here: room for any count, so that it can be brought up to date in place."""
_MAX_HEADER_BYTES = 65_536
_MAX_DIMENSIONS = 64
_MAX_SIDE = (1 << 63) - 1


@dataclass(frozen=True, slots=True)
class NpyHeader:
    """What an NPY header says, checked: no objects, and the shape fits the bytes that follow.

    ``name`` is the file, with the member where the array lies in an NPZ. ``data_offset`` in bytes.
    """

    name: str
    shape: tuple[int, ...]
    fortran: bool
    dtype: np.dtype[Any]
    data_offset: int

    def refuse(self, problem: str) -> InputError:
        """Return the error for an array that is sound but not what was expected."""
        return InputError(
            self.name, "header", f"array of shape {short(self.shape)} and type {short(self.dtype)}: {problem}"
        )


def parse_header(name: str | Path, source: IO[bytes], size_bytes: int) -> NpyHeader:
    """Read the header at the start of ``source``, which holds ``size_bytes`` in all; stop before the data.

    Raise :class:`InputError` for a wrong magic, an unknown version, a header that is no plain dictionary,
    object arrays, and a shape that needs more bytes than there are. Format: NumPy enhancement proposal 1.
    """

    def wrong(where: str, problem: str) -> InputError:
        return InputError(name, where, problem)

    start = source.read(8)
    if start[:6] != MAGIC or len(start) < 8:
        raise wrong("byte 0", f"found {start[:6]!r}, expected the NPY magic {MAGIC!r}")
    if start[6] not in (1, 2, 3):
        raise wrong("byte 6", f"NPY version {start[6]}.{start[7]}, expected 1.0, 2.0 or 3.0")
    length_bytes = 2 if start[6] == 1 else 4
    length = int.from_bytes(source.read(length_bytes), "little")
    if length > _MAX_HEADER_BYTES:
        raise wrong("byte 8", f"header of {length} bytes, expected at most {_MAX_HEADER_BYTES}")
    text = source.read(length)
    if len(text) < length:
        raise wrong(f"byte {8 + length_bytes + len(text)}", f"ends inside its header of {length} bytes")
    try:
        fields = ast.literal_eval(text.decode("utf-8" if start[6] == 3 else "latin-1").strip())
        shape, fortran = fields["shape"], fields["fortran_order"]
        dtype = np.lib.format.descr_to_dtype(fields["descr"])
        sound = (
            isinstance(shape, tuple)
            and isinstance(fortran, bool)
            and all(isinstance(side, int) and not isinstance(side, bool) and side >= 0 for side in shape)
        )
    except (
        ValueError,
        SyntaxError,
        TypeError,
        LookupError,
        AttributeError,
        OverflowError,
        RecursionError,
        MemoryError,
    ):
        sound = False
    if not sound:
        raise wrong("header", "expected a dictionary with descr, fortran_order and shape")
    if len(shape) > _MAX_DIMENSIONS or any(side > _MAX_SIDE for side in shape):
        raise wrong("header", f"absurd shape, expected at most {_MAX_DIMENSIONS} dimensions below 2^63")
    if dtype.hasobject:
        raise wrong("header", "holds Python objects, which are never unpickled; expected numbers")
    offset = 8 + length_bytes + length
    needed = math.prod(shape) * dtype.itemsize
    if dtype.itemsize == 0 or offset + needed > size_bytes:
        raise wrong(
            f"byte {size_bytes}",
            f"ends after {size_bytes - offset} bytes of data, expected {short(needed)} "
            f"for shape {short(shape)} of {short(dtype)}",
        )
    return NpyHeader(str(name), shape, fortran, dtype, offset)


def header_bytes(dtype: np.dtype[Any], count: int) -> bytes:
    """Return an NPY 1.0 header of :data:`HEADER_BYTES` for a one-dimensional array of ``count`` rows."""
    descr = np.lib.format.dtype_to_descr(dtype)
    text = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': ({count},), }}".encode("latin-1")
    room = HEADER_BYTES - 10
    if len(text) >= room:
        raise ValueError(f"dtype {dtype} needs a header of {len(text)} bytes, and there is room for {room - 1}")
    return MAGIC + b"\x01\x00" + room.to_bytes(2, "little") + text.ljust(room - 1) + b"\n"
