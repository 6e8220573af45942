"""Open a recording for reading, with one clear line for whatever the file system answers."""

from __future__ import annotations

import stat
from pathlib import Path
from typing import BinaryIO

from tiegocancel.errors import InputError

__all__ = ["first_bytes", "open_source", "source_bytes"]


def open_source(path: Path) -> BinaryIO:
    """Open a regular file for reading bytes; anything else raises :class:`InputError` and never blocks."""
    source_bytes(path)
    try:
        return path.open("rb")
    except OSError as error:
        raise InputError(path, "", _reason(error)) from None


def source_bytes(path: Path) -> int:
    """Return the size of a regular file in bytes; a folder, pipe or device raises :class:`InputError`."""
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        raise InputError(path, "", _reason(error)) from None
    if stat.S_ISDIR(status.st_mode):
        raise InputError(path, "", "is a folder, expected a recording")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(path, "", "is a pipe or a device, expected a regular file")
    return status.st_size


def first_bytes(path: Path, count: int) -> bytes:
    """Return up to ``count`` bytes from the start of a file."""
    with open_source(path) as source:
        try:
            return source.read(count)
        except OSError as error:
            raise InputError(path, "", _reason(error)) from None


def _reason(error: OSError | ValueError) -> str:
    """Say in plain words why a file could not be opened or read."""
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, PermissionError):
        return "may not be read: permission denied"
    return f"cannot be read: {getattr(error, 'strerror', None) or error}"
