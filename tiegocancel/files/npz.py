"""Read and write NPZ archives of event columns: the format of this package that holds everything."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, BinaryIO, ClassVar

import numpy as np

from tiegocancel.errors import ConfigError, InputError
from tiegocancel.events import Events
from tiegocancel.files.array_rows import ArrayRows, read_scalar, zip_faults
from tiegocancel.files.block import Block, place_namer
from tiegocancel.files.npy import NpyReader
from tiegocancel.files.npy_header import HEADER_BYTES, header_bytes
from tiegocancel.files.options import ReadOptions
from tiegocancel.files.reader import EventReader
from tiegocancel.files.source import open_source, source_bytes
from tiegocancel.files.values import RowMaker
from tiegocancel.files.writer import EventWriter

__all__ = ["NpzReader", "NpzWriter", "open_npz"]

_BLOCK_ROWS = 1 << 16
_COPY_ROWS = 1 << 18
_MAX_SPOOLS = 100
_EXTRAS = {"width", "height", "label"}


def open_npz(path: Path, options: ReadOptions) -> EventReader:
    """Open an archive of the columns ``t x y p``, or of a single array of rows; both may have what goes with them."""
    members = _members(path)
    events = [name for name in members if name not in _EXTRAS]
    if len(events) == 1 and events != ["t"]:
        return NpzRowsReader(path, options, events[0], members)
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
        self._columns = {name: _array(self.path, name, members) for name in names}
        lengths = {name: rows.length for name, rows in self._columns.items()}
        if len(set(lengths.values())) > 1:
            raise self.fail("", f"arrays must have one length, not {lengths}")
        for name, rows in self._columns.items():
            if rows.columns or rows.header.dtype.kind not in ("iuf" if name == "t" else "biuf"):
                raise rows.header.refuse("expected one number an event")
        self._size_of_file = _size(self.path, members)
        times = self._columns["t"]
        # NumPy's empty arrays are floats; without events there is no unit to declare.
        self._declare_unit(times.header.dtype.kind == "f" and times.length > 0)

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
            block, fault = maker.block(t, x, y, p, place_namer("row", range(start, start + len(t))), label)
            start += len(t)
            yield block
            if fault is not None:
                raise fault


class NpzRowsReader(NpyReader):
    """Read the one array of rows ``name`` as :class:`NpyReader` does, with ``width``, ``height`` and ``label`` [n].

    ``members`` are the arrays of the archive with their sizes in bytes. Labels within the rows come first.
    """

    format: ClassVar[str] = "npz"

    def __init__(self, path: Path, options: ReadOptions, name: str, members: dict[str, int]) -> None:
        self._members = members
        super().__init__(path, options, _opener(path, name), members[name])

    def _open(self) -> None:
        super()._open()
        self._size_of_file = _size(self.path, self._members)
        if "label" not in self._members:
            return
        if self.labelled:
            self.note("the array label is not used: the rows hold labels")
            return
        labels = _array(self.path, "label", self._members)
        if labels.columns or labels.header.dtype.kind not in "biuf" or labels.length != self._rows.length:
            raise labels.header.refuse(f"expected one number for each of {self._rows.length} rows")
        self._label_rows, self.labelled = labels, True


class NpzWriter(EventWriter):
    """Write an archive that ``np.load`` reads: ``t`` int64, ``x`` ``y`` uint16, ``p`` uint8, ``width``, ``height``.

    Rows are spooled to ``NAME.spool.npy``, a valid file of structured events at any moment, and put into the
    archive on closing, under a temporary name until it is complete. A killed process leaves the spool, and
    ``convert`` turns that into the archive (with ``--width`` and ``--height``).
    """

    format: ClassVar[str] = "npz"
    holds_labels: ClassVar[bool] = True
    holds_size: ClassVar[bool] = True

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

    def _abandon(self) -> None:
        """Remove the spool; a recording that was to be replaced stays."""
        self._spool.close()
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
    with zip_faults(path), open_source(path) as source:
        try:
            archive = zipfile.ZipFile(source)
        except zipfile.BadZipFile:
            raise InputError(
                path,
                f"byte {source_bytes(path)}",
                "torn archive: its table of contents, which comes last, is missing or broken. No row can be kept, not "
                "with --keep-going either: the columns lie one after the other. "
                f"A run that was killed leaves its rows in {path.name}.spool.npy",
            ) from None
        with archive:
            return {
                info.filename.removesuffix(".npy"): info.file_size
                for info in archive.infolist()
                if info.filename.endswith(".npy")
            }


def _array(path: Path, name: str, members: dict[str, int]) -> ArrayRows:
    """Open one array of an archive for reading rows."""
    return ArrayRows(f"{path}({name}.npy)", _opener(path, name), members[name], zipped=True)


def _size(path: Path, members: dict[str, int]) -> tuple[int, int] | None:
    """Return the sensor's size where an archive holds it."""
    if "width" not in members or "height" not in members:
        return None
    width, height = (
        read_scalar(f"{path}({name}.npy)", _opener(path, name), members[name]) for name in ("width", "height")
    )
    return width, height


def _opener(path: Path, name: str) -> Callable[[], IO[bytes]]:
    """Return a function that opens one member from its start."""

    def opener() -> IO[bytes]:
        with zipfile.ZipFile(path) as archive:
            # The archive keeps the file open until its members are closed.
            return archive.open(f"{name}.npy")

    return opener
