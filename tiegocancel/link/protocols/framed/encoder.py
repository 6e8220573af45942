"""Encode events, decisions and text as frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.link.protocols.framed.frame import Kind, seal_frame
from tiegocancel.link.protocols.framed.hello import Hello
from tiegocancel.link.protocols.framed.packing import STEP_BITS, Columns, pack
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["FramedEncoder"]

_FRAMES_AT_ONCE = 256
_HELLO_EVERY_US = 500_000
_HELLO_EVERY_FRAMES = 512
_HIGHEST_TICKS = 1 << 62
_WIDEST_PX = 65_535
_LONGEST_TEXT, _MOST_DECISIONS = 200, 4096


class FramedEncoder:
    """Encode as a device does: a HELLO at least every half second, frames of up to ``options.frame_events`` events.

    A chunk's last frame goes with the chunk, so that nothing is held back; long chunks make full frames. Times are
    whole ticks of ``options.tick_ns``. ``session`` tells one run of a device from the next.
    """

    def __init__(self, options: ProtocolOptions, *, session: int = 0, name: str = "tiegocancel") -> None:
        self.options = options
        self.frames = 0
        self._frame_events = options.frame_events
        self._session = session
        self._name = name
        self._size = (options.width, options.height)
        self._sequence = 0
        self._event = 0
        self._ticks_per_us = 1000 // options.tick_ns
        self._hello_us: int | None = None
        self._hello_frames = 0

    def begin(self) -> bytes:
        """Return a zero byte, which ends whatever was on the line, and a HELLO where the size is known.

        Behind events that were encoded before it begins a new session, whose events count from 0.
        """
        if self._event:
            self._session += 1
            self._event, self._hello_us = 0, None
        return b"\0" + (self.hello(0) if all(self._size) else b"")

    def hello(self, t_us: int) -> bytes:
        """Return a HELLO frame as of ``t_us``."""
        hello = Hello(
            width=self._size[0], height=self._size[1], tick_ns=self.options.tick_ns, session=self._session,
            next_event=self._event, ticks=t_us * self._ticks_per_us, name=self._name,
        )  # fmt: skip
        return self._seal(Kind.HELLO, hello.to_payload())

    def hello_of(self, side_px: int) -> bytes:
        """Return a HELLO before any events; ``side_px`` stands in where the options give no size."""
        self._size = (self._size[0] or side_px, self._size[1] or side_px)
        return self.hello(self._hello_us or 0)

    def encode(self, events: Events) -> bytes:
        """Return the frames of a chunk."""
        if not len(events):
            return b""
        if max(events.width, events.height) > _WIDEST_PX:
            raise ConfigError(f"a HELLO holds sensors up to {_WIDEST_PX} px, not {events.width}x{events.height}")
        if (events.width, events.height) != self._size:
            self._size, self._hello_us = (events.width, events.height), None
        highest = max(abs(int(events.t[0])), abs(int(events.t[-1])))
        if highest * self._ticks_per_us >= _HIGHEST_TICKS:
            raise ConfigError(f"the framed protocol holds times below 2^62 ticks, and {highest} µs are more")
        parts = []
        most = _FRAMES_AT_ONCE * self._frame_events
        for start in range(0, len(events), most):
            parts += self._frames(events[start : start + most])
        return b"".join(parts)

    def end(self) -> bytes:
        """Return nothing: every event went with its chunk."""
        return b""

    def decisions(self, first: int, suppressed: NDArray[np.bool_]) -> bytes:
        """Return DECISIONS frames for the events from index ``first`` on: True where one is suppressed."""
        parts = []
        for start in range(0, len(suppressed), _MOST_DECISIONS):
            part = suppressed[start : start + _MOST_DECISIONS]
            head = ((first + start) & 0xFFFF).to_bytes(2, "little") + len(part).to_bytes(2, "little")
            parts.append(self._seal(Kind.DECISIONS, head + np.packbits(part, bitorder="little").tobytes()))
        return b"".join(parts)

    def text(self, line: str) -> bytes:
        """Return a TEXT frame; what is not ASCII becomes ``?``."""
        return self._seal(Kind.TEXT, line.encode("ascii", "replace")[:_LONGEST_TEXT])

    def _frames(self, events: Events) -> list[bytes]:
        ticks = events.t * self._ticks_per_us
        # A new frame where the step is too long for one, and after every so many events.
        cuts = np.flatnonzero(np.diff(ticks, prepend=ticks[0]) >> STEP_BITS)
        origin = np.zeros(len(ticks), np.int64)
        origin[cuts] = cuts
        row = np.arange(len(ticks)) - np.maximum.accumulate(origin)
        starts = row % self._frame_events == 0
        frame = np.cumsum(starts) - 1
        columns = Columns(ticks, events.x.astype(np.int64), events.y.astype(np.int64), events.p.astype(np.int64), frame)
        parts = []
        first = np.append(np.flatnonzero(starts), len(ticks)).tolist()
        for payload, at, to in zip(pack(columns, self._event, *self._size), first, first[1:], strict=False):
            t_us = int(events.t[at])
            if (
                self._hello_us is None
                or t_us - self._hello_us >= _HELLO_EVERY_US
                or (self._hello_frames >= _HELLO_EVERY_FRAMES)
            ):
                parts.append(self.hello(t_us))
                self._hello_us, self._hello_frames = t_us, 0
            parts.append(self._seal(Kind.EVENTS, payload))
            self._event += to - at
            self._hello_frames += 1
            self.frames += 1
        return parts

    def _seal(self, kind: Kind, payload: bytes) -> bytes:
        frame = seal_frame(kind, self._sequence, payload)
        self._sequence = (self._sequence + 1) & 0xFF
        return frame
