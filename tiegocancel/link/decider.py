"""Be a device that cancels, in software: events in, decisions out, in the framed protocol."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.link.protocols.framed.decoder import FramedDecoder
from tiegocancel.link.protocols.framed.encoder import FramedEncoder
from tiegocancel.link.protocols.framed.frame import LONGEST_BYTES, Kind, open_frame, seal_frame
from tiegocancel.link.protocols.framed.hello import Hello
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["Decide", "DeciderDevice"]

Decide = Callable[[Events], NDArray[np.bool_]]
"""Return bool[n]: which events of the next chunk are suppressed."""


class DeciderDevice:
    """Answer ASK with a HELLO that promises decisions, and events with DECISIONS frames.

    It is a :class:`~tiegocancel.link.protocols.protocol.Device` that never streams by itself. ``fresh`` makes a new
    canceller; every START begins with one, so that hosts may come and go. ``options`` say the sensor's size.
    """

    streaming = False

    def __init__(self, options: ProtocolOptions, fresh: Callable[[], Decide], *, name: str = "tiegocancel") -> None:
        self._options, self._fresh, self._name = options, fresh, name
        self._held = b""
        self._session = 0
        self._begin()

    def receive(self, data: bytes) -> bytes:
        """Take bytes from the host; return the reply."""
        *whole, held = (self._held + data).split(b"\0")
        self._held = held[-LONGEST_BYTES:]
        return b"".join(self._obey(encoded) for encoded in whole if encoded)

    def encoder(self) -> FramedEncoder:
        """Return the encoder of the decisions."""
        return self._encoder

    def _begin(self) -> None:
        self._decoder = FramedDecoder(self._options)
        self._encoder = FramedEncoder(self._options, session=self._session, name=self._name)
        self._decide = self._fresh()
        self._decided = 0

    def _obey(self, encoded: bytes) -> bytes:
        frame = open_frame(encoded)
        if frame is not None and frame.kind == Kind.ASK:
            return b"\0" + self._hello()
        if frame is not None and frame.kind == Kind.START:
            self._session = (self._session + 1) & 0xFF
            self._begin()
            return b""
        if frame is not None and frame.kind in (Kind.STOP, Kind.CREDIT):
            return b""
        events = self._decoder.feed(encoded + b"\0")
        if not len(events):
            return b""
        reply = self._encoder.decisions(self._decided, self._decide(events))
        self._decided += len(events)
        return reply

    def _hello(self) -> bytes:
        hello = Hello(
            width=self._options.width,
            height=self._options.height,
            tick_ns=self._options.tick_ns,
            session=self._session,
            decides=True,
            name=self._name,
        )
        return seal_frame(Kind.HELLO, 0, hello.to_payload())
