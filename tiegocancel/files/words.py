"""Stream the fixed-size words of a binary recording, with the byte offset of each piece."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import InputError
from tiegocancel.files.source import open_source

__all__ = ["words"]


def words(path: Path, dtype: np.dtype[Any], offset: int, count: int) -> Iterator[tuple[NDArray[Any], int]]:
    """Yield pieces of at most ``count`` words with the byte where each piece begins.

    A partial word at the end raises :class:`InputError` after all whole words were yielded.
    """
    with open_source(path) as source:
        source.seek(offset)
        while data := source.read(count * dtype.itemsize):
            whole = len(data) // dtype.itemsize * dtype.itemsize
            if whole:
                yield np.frombuffer(data[:whole] if whole < len(data) else data, dtype), offset
            offset += whole
            if whole < len(data):
                raise InputError(
                    path, f"byte {offset}", f"ends after {len(data) - whole} bytes of a {dtype.itemsize}-byte word"
                )
