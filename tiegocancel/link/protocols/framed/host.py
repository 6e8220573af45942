"""Talk to a device of the framed protocol: ask what it is, start it, grant it credit, stop it."""

from __future__ import annotations

import time

from tiegocancel.errors import LinkError
from tiegocancel.link.protocols.framed.frame import Kind, open_frame, seal_frame
from tiegocancel.link.protocols.framed.hello import Hello
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.protocol import Line

__all__ = ["FramedHost"]

_TRIES, _WAIT_S = 4, 0.25


class FramedHost:
    """Start and stop a stream; with ``credit`` frames of it in advance, to be followed by :meth:`grant`.

    ``hello`` is what the device said of itself, ``None`` before :meth:`start`.
    """

    def __init__(self, options: ProtocolOptions, *, credit: int | None = None) -> None:
        self.options = options
        self.hello: Hello | None = None
        self._credit = credit
        self._sequence = 0

    def start(self, line: Line) -> str:
        """Make the device stream; return its name, size and tick. Raise :class:`LinkError` when it does not answer."""
        line.write(b"\0" + self._seal(Kind.STOP))
        line.read(1 << 16, 0.02)
        line.drop_input()
        for _ in range(_TRIES):
            line.write(self._seal(Kind.ASK))
            if hello := _hear_hello(line, _WAIT_S):
                break
        else:
            raise LinkError("", f"no HELLO within {_TRIES * _WAIT_S:g} s: no device of the framed protocol answers")
        self.hello = hello
        limited = b"\0\0\0" if self._credit is None else b"\1" + (self._credit & 0xFFFF).to_bytes(2, "little")
        line.write(self._seal(Kind.START, limited))
        return f"{hello.name or 'framed'} {hello.width}x{hello.height} px, tick {hello.tick_ns} ns"

    def stop(self, line: Line) -> None:
        """Make the device stop and forget what was under way."""
        line.write(b"\0" + self._seal(Kind.STOP))
        line.read(1 << 16, 0.02)
        line.drop_input()

    def grant(self, until: int) -> bytes:
        """Return a CREDIT frame: the device may have sent ``until`` EVENTS frames since START."""
        return self._seal(Kind.CREDIT, (until & 0xFFFF).to_bytes(2, "little"))

    def _seal(self, kind: Kind, payload: bytes = b"") -> bytes:
        frame = seal_frame(kind, self._sequence, payload)
        self._sequence = (self._sequence + 1) & 0xFF
        return frame


def _hear_hello(line: Line, seconds: float) -> Hello | None:
    """Return the HELLO that comes within ``seconds``."""
    heard, end = b"", time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        *whole, heard = (heard + line.read(4096, left)).split(b"\0")
        for encoded in whole:
            frame = open_frame(encoded)
            if frame is not None and frame.kind == Kind.HELLO and (hello := Hello.from_payload(frame.payload)):
                return hello
    return None
