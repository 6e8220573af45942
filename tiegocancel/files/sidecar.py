"""Keep labels beside a file whose format has no place for them, as ``NAME.labels.npy`` (uint8)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tiegocancel.files.npy_header import HEADER_BYTES, header_bytes, parse_header
from tiegocancel.files.source import open_source, source_bytes

__all__ = ["Labels", "LabelsWriter", "labels_beside", "labels_path"]


def labels_path(path: Path) -> Path:
    """Return where the labels of ``path`` lie."""
    return path.with_name(path.name + ".labels.npy")


class Labels:
    """Read rows of a label file; ``path`` is that file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with open_source(path) as source:
            self._header = parse_header(path, source, source_bytes(path))
        if self._header.dtype != np.dtype(np.uint8) or len(self._header.shape) != 1:
            raise self._header.refuse("expected labels as a one-dimensional array of uint8")

    def __len__(self) -> int:
        return self._header.shape[0]

    def rows(self, start: int, stop: int) -> NDArray[np.uint8]:
        """Return the labels of the rows from ``start`` to ``stop``; a row without one counts as 255."""
        with open_source(self.path) as source:
            source.seek(self._header.data_offset + start)
            found = np.frombuffer(source.read(max(min(stop, len(self)) - start, 0)), np.uint8)
        return np.concatenate([found, np.full(stop - start - len(found), 255, np.uint8)])


def labels_beside(path: Path) -> Labels | None:
    """Return the labels that lie beside ``path``, if there are any."""
    beside = labels_path(path)
    return Labels(beside) if beside.is_file() else None


class LabelsWriter:
    """Append labels; the header is brought up to date with each chunk, so a killed process leaves a valid file."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._count = 0
        self._file.write(header_bytes(np.dtype(np.uint8), 0))

    def write(self, label: NDArray[np.int8]) -> None:
        """Append the labels of one chunk, int8[n]."""
        self._file.seek(HEADER_BYTES + self._count)
        self._file.write(label.astype(np.uint8).tobytes())
        self._count += len(label)
        self._file.seek(0)
        self._file.write(header_bytes(np.dtype(np.uint8), self._count))
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
