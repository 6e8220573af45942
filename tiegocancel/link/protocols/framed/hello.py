"""Say what a device is: the payload of a HELLO frame."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Self

__all__ = ["Hello"]

_LAYOUT = struct.Struct("<2sHHHBBHq")
_MAGIC = b"EV"
_LONGEST_NAME = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Hello:
    """Sensor, clock and place in the stream, as of this frame.

    ``width`` and ``height`` in px; ``tick_ns`` is one tick; ``session`` changes when the device starts anew;
    ``decides``: it answers events with decisions; ``next_event`` is the index (modulo 2^16) of the event that comes
    next and ``ticks`` a time not after it, nor more than 2^32 ticks before it.
    """

    width: int
    height: int
    tick_ns: int = 1000
    session: int = 0
    decides: bool = False
    next_event: int = 0
    ticks: int = 0
    name: str = ""

    def to_payload(self) -> bytes:
        """Return the payload of the frame."""
        fixed = _LAYOUT.pack(
            _MAGIC, self.width, self.height, self.tick_ns, self.session & 0xFF, int(self.decides),
            self.next_event & 0xFFFF, self.ticks,
        )  # fmt: skip
        return fixed + self.name.encode("ascii", "replace")[:_LONGEST_NAME]

    @classmethod
    def from_payload(cls, payload: bytes) -> Self | None:
        """Read a payload; ``None`` where it is none that a device may send."""
        if not _LAYOUT.size <= len(payload) <= _LAYOUT.size + _LONGEST_NAME:
            return None
        magic, width, height, tick_ns, session, flags, next_event, ticks = _LAYOUT.unpack_from(payload)
        if magic != _MAGIC or not width or not height or not tick_ns or abs(ticks) * tick_ns > 1000 << 60:
            return None
        name = payload[_LAYOUT.size :].decode("ascii", "replace")
        return cls(
            width=width, height=height, tick_ns=tick_ns, session=session, decides=bool(flags & 1),
            next_event=next_event, ticks=ticks, name=name,
        )  # fmt: skip
