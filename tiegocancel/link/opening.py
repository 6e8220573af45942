"""Tell a port from a file by its name, and open either as a line."""

from __future__ import annotations

import re
import stat
from pathlib import Path

from tiegocancel.errors import LinkError
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.serial_line import SerialLine
from tiegocancel.link.stream_line import StreamLine

__all__ = ["AnyLine", "is_port", "open_line", "open_output"]

AnyLine = SerialLine | StreamLine

_NAMES = re.compile(r"(-|[a-z][a-z0-9+.]*://.*|COM\d+|/dev/(tty|cu\.|pts/|serial/).*)", re.IGNORECASE | re.DOTALL)


def is_port(name: str) -> bool:
    """Tell whether a name can only be a link: ``-``, a URL, ``COM3``, ``/dev/tty…``, or a character device."""
    if _NAMES.fullmatch(name):
        return True
    try:
        return stat.S_ISCHR(Path(name).stat().st_mode)
    except (OSError, ValueError):
        return False


def open_line(name: str, options: LineOptions) -> AnyLine:
    """Open a line for reading (and, on a port, for writing); raise :class:`LinkError` when it does not open.

    A regular file, a named pipe and ``-`` are read as bytes that were on a line.
    """
    if name == "-" or (not is_port(name) and _is_file(name)):
        return StreamLine(name)
    if not is_port(name) and not Path(name).exists():
        raise LinkError(name, "cannot be opened: there is no such port or file (tiegocancel ports lists ports)")
    return SerialLine(name, options)


def open_output(name: str, options: LineOptions) -> AnyLine:
    """Open a line for writing: a port, standard output (``-``), or a file that is made anew."""
    if name == "-" or not is_port(name):
        return StreamLine(name, writes=True)
    return SerialLine(name, options)


def _is_file(name: str) -> bool:
    try:
        mode = Path(name).stat().st_mode
    except (OSError, ValueError):
        return False
    return stat.S_ISREG(mode) or stat.S_ISFIFO(mode)
