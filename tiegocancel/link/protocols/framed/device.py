"""Answer a host of the framed protocol, for emulation."""

from __future__ import annotations

from tiegocancel.link.protocols.framed.encoder import FramedEncoder
from tiegocancel.link.protocols.framed.frame import LONGEST_BYTES, Kind, open_frame
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["FramedDevice"]

_DEFAULT_SIDE_PX = 128


class FramedDevice:
    """Answer ASK with HELLO, take START, STOP and CREDIT; tell in a TEXT frame what is not understood.

    ``options`` without a size stand for 128x128 px until the first events say theirs. ``allowance`` is how many EVENTS
    frames the host still takes, ``None`` while it takes any number; whoever sends looks at it before each chunk.
    """

    def __init__(self, options: ProtocolOptions) -> None:
        self._options = options
        self._held = b""
        self._session = 0
        self._until: int | None = None
        self._encoder = self._fresh()
        self._started_at = 0
        self.streaming = False

    def receive(self, data: bytes) -> bytes:
        """Take bytes from the host; return the reply."""
        *whole, held = (self._held + data).split(b"\0")
        self._held = held[-LONGEST_BYTES:]
        return b"".join(self._obey(encoded) for encoded in whole if encoded)

    def encoder(self) -> FramedEncoder:
        """Return the device's encoder: sequence numbers, indices and session run on through it."""
        return self._encoder

    @property
    def allowance(self) -> int | None:
        """How many EVENTS frames may still be sent; ``None``: any number."""
        if self._until is None:
            return None
        left = (self._until - (self._encoder.frames - self._started_at)) & 0xFFFF
        return left if left < 1 << 15 else 0

    def _fresh(self) -> FramedEncoder:
        return FramedEncoder(self._options, session=self._session)

    def _obey(self, encoded: bytes) -> bytes:
        frame = open_frame(encoded)
        if frame is None:
            return self._encoder.text("a frame with a wrong CRC")
        if frame.kind == Kind.ASK:
            return b"\0" + self._encoder.hello_of(_DEFAULT_SIDE_PX)
        if frame.kind == Kind.START and len(frame.payload) == 3:
            limited = frame.payload[0] & 1
            self._until = int.from_bytes(frame.payload[1:], "little") if limited else None
            self._started_at = self._encoder.frames
            self.streaming = True
            return b""
        if frame.kind == Kind.STOP:
            self.streaming = False
            return b""
        if frame.kind == Kind.CREDIT and len(frame.payload) == 2:
            if self._until is not None:
                self._until = int.from_bytes(frame.payload, "little")
            return b""
        return self._encoder.text(f"a frame of kind {frame.kind} is not understood")
