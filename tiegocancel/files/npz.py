"""Read and write NPZ archives of event columns: the format of this package that holds everything."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, BinaryIO, ClassVar

import numpy as np

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.files.array_rows import ArrayRows, read_scalar, zip_faults
from tiegocancel.files.block import Block
from tiegocancel.files.npy import NpyReader
from tiegocancel.files.npy_header import HEADER_BYTES, header_bytes
from tiegocancel.files.options import ReadOptions
from tiegocancel.files.reader import EventReader
from tiegocancel.files.source import open_source
from tiegocancel.files.values import RowMaker
from tiegocancel.files.writer import EventWriter

__all__ = ["NpzReader", "NpzWriter", "open_npz"]

_BLOCK_ROWS = 1 << 16
_COPY_ROWS = 1 << 18
_MAX_SPOOLS = 100


def open_npz(path: Path, options: ReadOptions) -> EventReader:
    """Open an archive of the columns ``t x y p``, or of a single array that is read as an NPY."""
    members = _members(path)
    if len(members) == 1 and "t" not in members:
        name = next(iter(members))
        return NpyReader(path, options, _opener(path, name), members[name])
    return NpzReader(path, options)


class NpzReader(EventReader):
    """Read ``t x y p`` [n] and, where present, ``width``, ``height`` and ``label`` [n], a block at a time.

    Whole-number times are µs, as :class:`NpzWriter` writes them; others need the unit declared.
    """

    format: ClassVar[str] = "npz"

    def _open(self) -> None:
        members = _members(self.path)
        missing = [name for name in ("t", "x", "y", "p") if name not in members]
        if missing:
            found = ", ".join(name[:20] for name in sorted(members)[:8]) or "none"
            raise self.fail("", f"expected the arrays t, x, y, p in the archive, found {found}")
        self.labelled = "label" in members
        names = ("t", "x", "y", "p", "label") if self.labelled else ("t", "x", "y", "p")
        self._columns = {
            name: ArrayRows(f"{self.path}({name}.npy)", _opener(self.path, name), members[name]) for name in names
        }
        lengths = {name: rows.length for name, rows in self._columns.items()}
        if len(set(lengths.values())) > 1:
            raise self.fail("", f"arrays must have one length, not {lengths}")
        for name, rows in self._columns.items():
            if rows.columns or rows.header.dtype.kind not in ("iuf" if name == "t" else "biuf"):
                raise rows.header.refuse("expected one number an event")
        if "width" in members and "height" in members:
            self._size_of_file = (self._scalar("width", members), self._scalar("height", members))
        self._declare_unit(self._columns["t"].header.dtype.kind == "f")

    def _scalar(self, name: str, members: dict[str, int]) -> int:
        return read_scalar(f"{self.path}({name}.npy)", _opener(self.path, name), members[name])

    def _declare_unit(self, fractional: bool) -> None:
        """Set the unit of time."""
        if self.options.time_unit is not None:
            self.time_unit = self.options.time_unit
            self.note(f"time unit: {self.time_unit}, as declared")
        elif fractional:
            raise self.fail("t.npy", "fractional times have no unit: declare it with --time-unit s, ms, us or ns")
        else:
            self.note("time unit: us, as whole numbers in an NPZ are")

    def _blocks(self) -> Iterator[Block]:
        maker = RowMaker(self.path, self.time_unit)
        start = 0
        for parts in zip(*(rows.chunks(_BLOCK_ROWS) for rows in self._columns.values()), strict=True):
            t, x, y, p = parts[:4]
            label = parts[4] if "label" in self._columns else None
            block, fault = maker.block(t, x, y, p, lambda i, at=start: f"row {at + i}", label)  # type: ignore[misc]
            start += len(t)
            yield block
            if fault is not None:
                raise fault


class NpzWriter(EventWriter):
    """Write an archive that ``np.load`` reads: ``t`` int64, ``x`` ``y`` uint16, ``p`` uint8, ``width``, ``height``.

    Rows are spooled to ``NAME.spool.npy``, a valid file of structured events at any moment, and put into the
    archive on closing, under a temporary name until it is complete. A killed process leaves the spool, and
    ``convert`` turns that into the archive (with ``--width`` and ``--height``).
    """

    format: ClassVar[str] = "npz"
    holds_labels: ClassVar[bool] = True

    def _begin(self) -> None:
        fields: list[tuple[str, str]] = [("t", "<i8"), ("x", "<u2"), ("y", "<u2"), ("p", "u1")]
        self._dtype: np.dtype[Any] = np.dtype([*fields, ("label", "i1")] if self.labelled else fields)
        self._spool_path, self._spool = _new_spool(self.path)
        self._spool.write(header_bytes(self._dtype, 0))

    def _append(self, events: Events) -> None:
        rows = np.empty(len(events), self._dtype)
        for name in self._dtype.names or ():
            rows[name] = getattr(events, name)
        self._spool.seek(HEADER_BYTES + self.count * self._dtype.itemsize)
        self._spool.write(rows.tobytes())
        self._spool.seek(0)
        self._spool.write(header_bytes(self._dtype, self.count + len(events)))
        self._spool.flush()

    def _finish(self) -> None:
        part = self.path.with_name(self.path.name + ".part")
        try:
            with zipfile.ZipFile(part, "w", zipfile.ZIP_STORED) as archive:
                for name in self._dtype.names or ():
                    self._copy_column(archive, name)
                for name in ("width", "height"):
                    with archive.open(f"{name}.npy", "w") as member:
                        np.lib.format.write_array(member, np.array(getattr(self, name), np.int64), allow_pickle=False)
            part.replace(self.path)
        finally:
            self._spool.close()
            with suppress(OSError):
                part.unlink(missing_ok=True)
        self._spool_path.unlink()

    def _copy_column(self, archive: zipfile.ZipFile, name: str) -> None:
        """Copy one field of the spool into the archive, some rows at a time."""
        dtype = self._dtype[name]
        self._spool.seek(HEADER_BYTES)
        with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
            member.write(header_bytes(dtype, self.count))
            while data := self._spool.read(_COPY_ROWS * self._dtype.itemsize):
                member.write(np.ascontiguousarray(np.frombuffer(data, self._dtype)[name]).tobytes())


def _new_spool(path: Path) -> tuple[Path, BinaryIO]:
    """Create the spool of ``path``; one that a killed process left is not touched, it may be what is being read."""
    for number in range(1, _MAX_SPOOLS):
        spool = path.with_name(f"{path.name}.spool{number if number > 1 else ''}.npy")
        with suppress(FileExistsError):
            return spool, spool.open("x+b")
    raise ConfigError(f"{path} has {_MAX_SPOOLS - 1} spools of killed processes beside it: remove them")


def _members(path: Path) -> dict[str, int]:
    """Return the arrays of an archive with their sizes in bytes."""
    with zip_faults(path), open_source(path) as source, zipfile.ZipFile(source) as archive:
        return {
            info.filename.removesuffix(".npy"): info.file_size
            for info in archive.infolist()
            if info.filename.endswith(".npy")
        }


def _opener(path: Path, name: str) -> Callable[[], IO[bytes]]:
    """Return a function that opens one member from its start."""

    def opener() -> IO[bytes]:
        with zipfile.ZipFile(path) as archive:
            # The archive keeps the file open until its members are closed.
            return archive.open(f"{name}.npy")

    return opener
