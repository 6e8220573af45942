"""Stream the rows of an NPY array, from a file or from a member of an NPZ, without holding it."""

from __future__ import annotations

import lzma
import math
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import InputError
from tiegocancel.files.npy_header import NpyHeader, parse_header

__all__ = ["ArrayRows", "read_scalar", "zip_faults"]


_MAX_BYTES = 1 << 24
"""Bytes read at a time, however long a row is."""


class ArrayRows:
    """One array; ``opener`` returns its bytes from the start, ``size_bytes`` says how many there are.

    ``zipped`` says that they come out of a ZIP archive, whose faults are then told as such. ``length`` rows of
    ``header.dtype``; a two-dimensional array has ``columns`` columns, others 0.
    """

    def __init__(self, name: str | Path, opener: Callable[[], IO[bytes]], size_bytes: int, *, zipped: bool) -> None:
        self._name = name
        self._opener = opener
        self._zipped = zipped
        with self._faults(), opener() as source:
            self.header: NpyHeader = parse_header(name, source, size_bytes)
        if self.header.dtype.kind not in "biufV" or len(self.header.shape) not in (1, 2):
            raise self.header.refuse("expected numbers or structured rows in one or two dimensions")
        self.length = self.header.shape[0]
        self.columns = self.header.shape[1] if len(self.header.shape) == 2 else 0

    def at_once(self, rows: int) -> int:
        """Return how many of ``rows`` are read at a time: fewer where they are long."""
        return max(1, min(rows, _MAX_BYTES // (self.header.dtype.itemsize * max(self.columns, 1))))

    def chunks(self, rows: int) -> Iterator[NDArray[Any]]:
        """Yield consecutive rows, ``at_once(rows)`` each; a source that ends early raises :class:`InputError`."""
        strided = self.header.fortran and self.columns > 0
        row_bytes = self.header.dtype.itemsize * (1 if strided else max(self.columns, 1))
        rows = self.at_once(rows)
        with ExitStack() as stack:
            sources = []
            for column in range(self.columns if strided else 1):
                with self._faults():
                    source = stack.enter_context(self._opener())
                    source.seek(self.header.data_offset + column * self.length * row_bytes)
                sources.append(source)
            for start in range(0, self.length, rows):
                count = min(rows, self.length - start)
                parts = [self._part(source, start, count, row_bytes) for source in sources]
                if strided:
                    yield np.stack(parts, axis=1)
                else:
                    yield parts[0].reshape(count, self.columns) if self.columns else parts[0]

    def _part(self, source: IO[bytes], start: int, count: int, row_bytes: int) -> NDArray[Any]:
        """Read ``count`` rows from one source."""
        with self._faults():
            data = source.read(count * row_bytes)
        if len(data) < count * row_bytes:
            at = self.header.data_offset + start * row_bytes + len(data)
            raise InputError(self._name, f"byte {at}", f"ends inside row {start + len(data) // row_bytes}")
        return np.frombuffer(data, self.header.dtype)

    def _faults(self) -> AbstractContextManager[None]:
        return zip_faults(self._name) if self._zipped else nullcontext()


def read_scalar(name: str, opener: Callable[[], IO[bytes]], size_bytes: int) -> int:
    """Return the one whole number that a small array in a ZIP archive holds."""
    with zip_faults(name), opener() as source:
        header = parse_header(name, source, size_bytes)
        if math.prod(header.shape) != 1 or header.dtype.kind not in "iuf":
            raise header.refuse("expected one whole number")
        value = float(np.frombuffer(source.read(header.dtype.itemsize), header.dtype)[0])
    if not value.is_integer():
        raise header.refuse(f"expected one whole number, not {value}")
    return int(value)


@contextmanager
def zip_faults(name: str | Path) -> Iterator[None]:
    """Turn what a broken or hostile ZIP archive raises into one clear line."""
    try:
        yield
    except (zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, EOFError, RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(name, "", f"broken ZIP archive: {reason[:200]}") from None
