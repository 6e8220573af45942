"""Be the device's end of a pseudo-terminal, whose other end a host opens like a serial port."""

from __future__ import annotations

import contextlib
import os
import struct
from pathlib import Path
from types import TracebackType
from typing import Self

from tiegocancel.errors import ConfigError, LinkError
from tiegocancel.link.descriptor import read_some, write_all, write_some

__all__ = ["PseudoTerminal"]


class PseudoTerminal:
    """A pair of which this end is a :class:`~tiegocancel.link.protocols.protocol.Line` and ``port`` names the other.

    The other end is kept open here too, so that a host may come and go: bytes that nobody reads fill the system's
    buffer, and then writing waits, at most ``write_timeout_s``. POSIX only.
    """

    ended = False
    answers = True

    def __init__(self, *, write_timeout_s: float = 5.0) -> None:
        try:
            import tty
        except ImportError:
            raise LinkError("", "pseudo-terminals need Linux or macOS") from None

        self._write_timeout_s = write_timeout_s
        self._device, self._host = os.openpty()
        self._symlink: Path | None = None
        try:
            tty.setraw(self._host)
            os.set_blocking(self._device, False)
            self.port = os.ttyname(self._host)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def name(self, symlink: Path) -> None:
        """Give the port a second name, until it is closed; raise :class:`ConfigError` where a file is in the way."""
        _link(symlink, self.port)
        self._symlink = symlink

    def read(self, most: int, timeout_s: float) -> bytes:
        """Return what the host sent, as soon as there is any, nothing after ``timeout_s``."""
        return read_some(self._device, most, timeout_s, port=self.port) or b""

    def write(self, data: bytes) -> None:
        """Send all of ``data`` to the host; raise :class:`LinkError` when it takes nothing for too long."""
        write_all(self._device, data, self._write_timeout_s, port=self.port)

    def write_some(self, data: bytes, timeout_s: float) -> int:
        """Send what the host's buffer takes within ``timeout_s``, perhaps nothing; return how many bytes that were."""
        return write_some(self._device, data, timeout_s, port=self.port)

    @property
    def unread(self) -> int:
        """Number of bytes that were sent and that the host has not read."""
        import fcntl
        import termios

        (unread,) = struct.unpack("i", fcntl.ioctl(self._host, termios.FIONREAD, b"\0" * 4))
        return int(unread)

    def drop_input(self) -> None:
        """Forget what the host sent and was not read."""
        while self.read(1 << 16, 0.0):
            pass

    def close(self) -> None:
        """Close both ends and remove the second name; a second call does nothing."""
        for name in ("_device", "_host"):
            descriptor = getattr(self, name)
            setattr(self, name, -1)
            if descriptor >= 0:
                with contextlib.suppress(OSError):
                    os.close(descriptor)
        # Another device may have taken the name over.
        if self._symlink is not None and self._symlink.is_symlink() and os.readlink(self._symlink) == self.port:
            self._symlink.unlink()
        self._symlink = None


def _link(symlink: Path, port: str) -> None:
    """Give the port a second name; one that an earlier device left is replaced, a file is not."""
    if symlink.is_symlink():
        symlink.unlink()
    if symlink.exists():
        raise ConfigError(f"{symlink} is in the way: it is a file, and was to be the name of a port")
    symlink.symlink_to(port)
