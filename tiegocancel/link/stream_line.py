"""Talk over a file or over standard input and output: recorded bytes, pipes."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
from types import TracebackType
from typing import Self

from tiegocancel.errors import LinkError
from tiegocancel.link.descriptor import read_some, write_all, write_some

__all__ = ["StreamLine"]


class StreamLine:
    """Bytes of a file or a pipe, a :class:`~tiegocancel.link.protocols.protocol.Line`; ``ended`` at their end.

    ``answers`` is false, so that no conversation is held with it: it would eat the stream.
    ``-`` reads standard input, or writes standard output. A line is for reading or for writing: what a conversation
    writes to one that is read goes nowhere, and one that is written answers nothing.
    """

    answers = False

    def __init__(self, name: str, *, writes: bool = False) -> None:
        self.port = {"-": "standard output" if writes else "standard input"}.get(name, name)
        self.ended = False
        self._writes = writes
        self._own = name != "-"
        try:
            if self._own:
                flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC if writes else os.O_RDONLY
                self._descriptor = os.open(name, flags | getattr(os, "O_BINARY", 0), 0o644)
            else:
                self._descriptor = (sys.stdout if writes else sys.stdin).fileno()
            self._regular = stat.S_ISREG(os.fstat(self._descriptor).st_mode)
        except (OSError, ValueError) as error:
            raise LinkError(self.port, f"cannot be opened: {getattr(error, 'strerror', None) or error}") from None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def read(self, most: int, timeout_s: float) -> bytes:
        """Return up to ``most`` bytes, as soon as there are any, nothing after ``timeout_s`` and at the end."""
        if self._writes or self.ended:
            return b""
        if self._regular:
            # Always ready, and some systems can wait for sockets only.
            data = os.read(self._descriptor, most) or None
        else:
            data = read_some(self._descriptor, most, timeout_s, port=self.port)
        self.ended = data is None
        return data or b""

    def write(self, data: bytes) -> None:
        """Send all of ``data``, waiting for a slow reader as long as it takes."""
        if self._writes and self._regular:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        elif self._writes:
            write_all(self._descriptor, data, 86_400.0, port=self.port)

    def write_some(self, data: bytes, timeout_s: float) -> int:
        """Send what is taken within ``timeout_s``, perhaps nothing; return how many bytes that were."""
        if not self._writes:
            return len(data)
        if self._regular:
            return os.write(self._descriptor, data)
        return write_some(self._descriptor, data, timeout_s, port=self.port)

    def drop_input(self) -> None:
        """Keep what has come: a file holds nothing but the stream."""

    def overruns(self) -> int:
        """Return 0: a file loses nothing."""
        return 0

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        if self._own:
            self._own = False
            with contextlib.suppress(OSError):
                os.close(self._descriptor)
