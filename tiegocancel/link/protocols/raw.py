"""Stand in for a conversation where a protocol has none: the device streams from the start."""

from __future__ import annotations

from collections.abc import Callable

from tiegocancel.link.protocols.protocol import Encoder, Line

__all__ = ["RawDevice", "RawHost"]


class RawHost:
    """Send nothing: what is on the line is the stream."""

    def start(self, line: Line) -> str:
        """Return no banner, for there is none."""
        return ""

    def stop(self, line: Line) -> None:
        """Leave the device alone: it knows no command."""


class RawDevice:
    """Stream always, and take no command."""

    streaming = True

    def __init__(self, encoder: Callable[[], Encoder]) -> None:
        self._encoder = encoder

    def receive(self, data: bytes) -> bytes:
        """Take bytes and answer none."""
        return b""

    def encoder(self) -> Encoder:
        """Return an encoder that begins anew."""
        return self._encoder()
