"""Encode events as the lines of an OpenMV camera."""

from __future__ import annotations

import binascii

import numpy as np

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.link.protocols.axes import to_device
from tiegocancel.link.protocols.openmv.decoder import SIDE_PX, WRAP_S
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["BEGUN", "END", "OpenMvEncoder"]

BEGUN, _FOOTER, END = b"<<<STREAM>>>", b"<<<FOOTER>>>", b"<<<END>>>"
_ROW = np.dtype([("kind", "<u2"), ("s", "<u2"), ("ms", "<u2"), ("us", "<u2"), ("x", "<u2"), ("y", "<u2")])
_LINE_EVENTS = 1024


class OpenMvEncoder:
    """Encode lines of up to 1024 events; a chunk's last line goes with the chunk. Times from 0, modulo 65,536 s."""

    def __init__(self, options: ProtocolOptions) -> None:
        self._options = options

    def begin(self) -> bytes:
        """Return the header, up to the marker behind which the lines come."""
        width, height = self._options.width or SIDE_PX, self._options.height or SIDE_PX
        return b"<<<HEADER>>>\nwidth=%d\nheight=%d\n%s\n" % (width, height, BEGUN)

    def encode(self, events: Events) -> bytes:
        """Return the lines of a chunk."""
        events = to_device(events, self._options)
        if len(events) and int(events.t[0]) < 0:
            raise ConfigError(f"OpenMV lines hold no times below 0 µs, and an event is at {int(events.t[0])} µs")
        rows = np.empty(len(events), _ROW)
        rows["kind"], rows["x"], rows["y"] = events.p, events.x, events.y
        rows["s"], rows["ms"] = events.t // 1_000_000 % WRAP_S, events.t // 1000 % 1000
        rows["us"] = events.t % 1000
        parts = []
        for start in range(0, len(rows), _LINE_EVENTS):
            part = rows[start : start + _LINE_EVENTS]
            parts.append(b"C %d %s\n" % (len(part), binascii.b2a_base64(part.tobytes(), newline=False)))
        return b"".join(parts)

    def end(self) -> bytes:
        """Return the footer."""
        return _FOOTER + b"\n" + END + b"\n"
