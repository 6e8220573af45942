"""Open a recording or a new file by format: header first, suffix second."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.files.options import ReadOptions
from tiegocancel.files.reader import EventReader
from tiegocancel.files.sniff import sniff
from tiegocancel.files.writer import EventWriter

__all__ = ["WRITABLE", "open_events", "open_writer", "read_events", "write_events"]

_READERS = {
    "npz": "tiegocancel.files.npz:open_npz",
    "npy": "tiegocancel.files.npy:NpyReader",
    "text": "tiegocancel.files.text:TextReader",
    "evt2": "tiegocancel.files.evt2:Evt2Reader",
    "evt3": "tiegocancel.files.evt3:Evt3Reader",
    "dat": "tiegocancel.files.dat:DatReader",
    "aedat2": "tiegocancel.files.aedat2:Aedat2Reader",
    "aedat4": "tiegocancel.files.aedat4:Aedat4Reader",
    "hdf5": "tiegocancel.files.hdf5:Hdf5Reader",
    "rosbag": "tiegocancel.files.rosbag:RosbagReader",
}
_WRITERS = {
    "npz": "tiegocancel.files.npz:NpzWriter",
    "npy": "tiegocancel.files.npy:NpyWriter",
    "csv": "tiegocancel.files.text_writer:CsvWriter",
    "evt2": "tiegocancel.files.evt2:Evt2Writer",
}
_WRITER_SUFFIXES = {".npz": "npz", ".npy": "npy", ".csv": "csv", ".txt": "csv", ".raw": "evt2"}

WRITABLE = tuple(_WRITERS)
"""Names of the formats that can be written."""


def open_events(
    path: str | PathLike[str],
    *,
    width: int | None = None,
    height: int | None = None,
    time_unit: str | None = None,
    columns: str | None = None,
    chunk_events: int = 1 << 20,
    keep_going: bool = False,
    undistort: str | PathLike[str] | None = None,
    format: str | None = None,
) -> EventReader:
    """Open a recording for reading in chunks; the format is told by its header, or declared.

    ``width`` and ``height`` in px, ``time_unit`` (s, ms, us, ns) and ``columns`` (letters t x y p, ``-`` skips one)
    declare what the file does not say. With ``keep_going`` a fault ends the stream with a note instead of an
    error. ``undistort`` names a calibration (see :mod:`tiegocancel.motion.calibration_file`): events then lie where a
    pinhole would show them. Raise :class:`InputError` for what is wrong with a file, :class:`ConfigError` for a
    declaration that cannot be meant, :class:`MissingExtraError` where a format needs an extra.
    """
    options = ReadOptions(
        width=width,
        height=height,
        time_unit=time_unit,
        columns=columns,
        chunk_events=chunk_events,
        keep_going=keep_going,
        undistort=None if undistort is None else str(undistort),
    )
    file = Path(path)
    name = _known("format", "text" if format == "csv" else format, tuple(_READERS)) if format else sniff(file)
    opener: Callable[[Path, ReadOptions], EventReader] = _load(_READERS[name])
    if options.undistort is None:
        return opener(file, options)
    from tiegocancel.files.undistort import undistorted
    from tiegocancel.motion.calibration_file import read_calibration

    intrinsics = read_calibration(options.undistort)
    return undistorted(opener(file, options), intrinsics, source=Path(options.undistort).name)


def read_events(
    path: str | PathLike[str],
    *,
    width: int | None = None,
    height: int | None = None,
    time_unit: str | None = None,
    columns: str | None = None,
    chunk_events: int = 1 << 20,
    keep_going: bool = False,
    undistort: str | PathLike[str] | None = None,
    format: str | None = None,
) -> Events:
    """Read a whole recording, as :func:`open_events` does; an unsorted one is stably sorted by time."""
    with open_events(
        path,
        width=width,
        height=height,
        time_unit=time_unit,
        columns=columns,
        chunk_events=chunk_events,
        keep_going=keep_going,
        undistort=undistort,
        format=format,
    ) as reader:
        return reader.read()


def open_writer(
    path: str | PathLike[str], *, width: int, height: int, labelled: bool = False, format: str | None = None
) -> EventWriter:
    """Open a new file for writing in chunks; the suffix or ``format`` (npz, npy, csv, evt2) names the format.

    A format without room for labels gets them beside it. Raise :class:`ConfigError` for a suffix or a sensor size
    that no format or this format cannot take.
    """
    file = Path(path)
    name = _known("format", format, WRITABLE) if format else _WRITER_SUFFIXES.get(file.suffix.lower())
    if name is None:
        suffixes = ", ".join(_WRITER_SUFFIXES)
        raise ConfigError(f"{file} has the suffix {file.suffix!r}, expected one of {suffixes}, or a declared format")
    if not file.parent.is_dir():
        raise ConfigError(f"{file} cannot be written: there is no folder {file.parent}")
    if file.is_dir():
        raise ConfigError(f"{file} cannot be written: it is a folder")
    opener: Callable[..., EventWriter] = _load(_WRITERS[name])
    try:
        return opener(file, width=width, height=height, labelled=labelled)
    except OSError as error:
        raise ConfigError(f"{file} cannot be written: {error.strerror or error}") from None


def write_events(path: str | PathLike[str], events: Events, format: str | None = None) -> None:
    """Write a whole stream, with its labels if it has any."""
    with open_writer(
        path, width=events.width, height=events.height, labelled=events.label is not None, format=format
    ) as writer:
        writer.write(events)


def _known(what: str, name: str | None, names: tuple[str, ...]) -> str:
    """Check a declared name."""
    if name not in names:
        raise ConfigError(f"{what} must be one of {', '.join(names)}, not {name!r}")
    return name


def _load(home: str) -> Any:
    """Import a format's module when it is first needed."""
    module, name = home.split(":")
    return getattr(importlib.import_module(module), name)
