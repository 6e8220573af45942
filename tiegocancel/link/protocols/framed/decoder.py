"""Decode frames: events, decisions, text, and what is missing between them."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.link.protocols.framed.frame import LONGEST_BYTES, Frame, Kind, open_frame
from tiegocancel.link.protocols.framed.hello import Hello
from tiegocancel.link.protocols.framed.packing import LEAST_BYTES, MOST_EVENTS, unpack
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.outbox import Outbox
from tiegocancel.link.protocols.protocol import LinkCounters, TextLine

__all__ = ["FramedDecoder"]

_STAMP_MASK, _STAMP_HALF = (1 << 32) - 1, 1 << 31
_FRAMES_AT_ONCE = 256
_HEAD = struct.Struct("<HIB")
_EVENTS = int(Kind.EVENTS)
_MOST_DECISIONS = 4096


class FramedDecoder:
    """Decode what a device sends; its HELLO says size and clock, the options only until one comes.

    A frame whose CRC is wrong is passed over; what is missing is counted by the sequence numbers of frames
    (``lost_frames``) and by the indices of events (``lost_events``), which count what a device itself dropped too. At
    most the frame around a spoilt byte is lost, or two where the byte was a zero between frames. Events before the
    first HELLO wait for none: they are lost, unless the options give the size. ``hello`` is the last HELLO, ``frames``
    the number of EVENTS frames taken, from which a host grants credit.
    """

    def __init__(self, options: ProtocolOptions) -> None:
        self.options = options
        self.width = options.width or 1
        self.height = options.height or 1
        self.counters = LinkCounters()
        self.hello: Hello | None = None
        self.frames = 0
        self._tick_ns = options.tick_ns
        self._known = bool(options.width and options.height)
        self._outbox = Outbox(self.width, self.height, options)
        self._held = b""
        self._in_step = True
        self._sequence: int | None = None
        self._event: int | None = None
        self._ticks: int | None = None
        self._waiting: list[bytes] = []
        self._waiting_ticks: list[int] = []
        self._decisions: list[tuple[int, NDArray[np.bool_]]] = []
        self._decided = 0
        self._anew = False

    def feed(self, data: bytes) -> Events:
        """Take bytes; return the events of the frames that are complete."""
        self.counters.bytes += len(data)
        *whole, self._held = (self._held + data).split(b"\0")
        parts: list[Events] = []
        for encoded in whole:
            if not encoded:
                continue
            frame = open_frame(encoded)
            if frame is None or not self._take(frame, parts):
                self.counters.bad_bytes += len(encoded) + 1
                self._in_step = False
            elif not self._in_step:
                self._in_step = True
                self.counters.resyncs += 1
        if len(self._held) > LONGEST_BYTES:
            # Its end is lost: whatever comes up to the next zero cannot be a frame.
            self.counters.bad_bytes += len(self._held) - 1
            self._held, self._in_step = self._held[:1], False
        self._unpack()
        parts.append(self._outbox.take(self.counters))
        same = [part for part in parts if len(part)]
        if len({(part.width, part.height) for part in same}) > 1:
            # The size changed between them: only the latest stream goes on, and what was before is told as lost.
            old = [part for part in same if (part.width, part.height) != (self.width, self.height)]
            self.counters.outside += sum(map(len, old))
            self.counters.events -= sum(map(len, old))
            same = [part for part in same if (part.width, part.height) == (self.width, self.height)]
        return Events.concatenate(same) if same else Events.empty(self.width, self.height)

    def settle(self) -> Events:
        """Return nothing: a frame is whole or it is none."""
        return Events.empty(self.width, self.height)

    def take_lines(self) -> list[TextLine]:
        """Return and forget the text lines that came since the last call."""
        return self._outbox.take_lines()

    def take_decisions(self) -> list[tuple[int, NDArray[np.bool_]]]:
        """Return and forget decisions: the index of the first event, unwrapped, and which are suppressed."""
        decisions, self._decisions = self._decisions, []
        return decisions

    def _take(self, frame: Frame, parts: list[Events]) -> bool:
        """Take a frame whose CRC is right; return whether its payload is sound."""
        if frame.kind == _EVENTS:
            if self._sequence is not None:
                self.counters.lost_frames += (frame.sequence - self._sequence) & 0xFF
            self._sequence = (frame.sequence + 1) & 0xFF
            return self._take_events(frame.payload)
        hello = Hello.from_payload(frame.payload) if frame.kind == Kind.HELLO else None
        if frame.kind == Kind.HELLO and hello is None:
            return False
        anew = hello is not None and self.hello is not None and hello.session != self.hello.session
        if self._sequence is not None and not anew:
            self.counters.lost_frames += (frame.sequence - self._sequence) & 0xFF
        self._sequence = (frame.sequence + 1) & 0xFF
        if hello is not None:
            self._take_hello(hello, parts, anew=anew)
            return True
        if frame.kind == Kind.DECISIONS:
            return self._take_decisions(frame.payload)
        if frame.kind == Kind.TEXT:
            self._unpack()
            self.counters.text_lines += 1
            self._outbox.put_line(self._outbox.time_us, frame.payload.decode("ascii", "replace").rstrip())
        return True

    def _take_hello(self, hello: Hello, parts: list[Events], *, anew: bool) -> None:
        self._unpack()
        if not self._known or (hello.width, hello.height) != (self.width, self.height):
            parts.append(self._outbox.take(self.counters))
            self.width, self.height, self._known = hello.width, hello.height, True
            self._outbox.resize(self.width, self.height)
        self.hello, self._tick_ns = hello, hello.tick_ns
        if anew or self._event is None:
            self._event = hello.next_event
        if anew:
            self.counters.time_jumps += 1
            self._anew = True
        self._ticks = hello.ticks

    def _take_events(self, payload: bytes) -> bool:
        if len(payload) < LEAST_BYTES or not 1 <= payload[6] <= MOST_EVENTS:
            return False
        first, stamp, count = _HEAD.unpack_from(payload)
        if not self._known:
            self.counters.lost_events += count
            self.counters.lost_frames += 1
            self._event = (first + count) & 0xFFFF
            return True
        if self._event is not None:
            self.counters.lost_events += (first - self._event) & 0xFFFF
        self._event = (first + count) & 0xFFFF
        ticks = stamp if self._ticks is None else self._ticks + ((stamp - self._ticks) & _STAMP_MASK)
        if self._ticks is not None and ticks - self._ticks >= _STAMP_HALF:
            # A step back without a HELLO that says so: frames of a run before this one, or of none.
            self._unpack()
            self.counters.time_jumps += 1
            self._outbox.go_on_from(ticks * self._tick_ns // 1000)
        if self._anew:
            # The clock began anew: time goes on from the last event.
            self._outbox.go_on_from(ticks * self._tick_ns // 1000)
            self._anew = False
        self._ticks = ticks
        self.frames += 1
        self._waiting.append(payload)
        self._waiting_ticks.append(ticks)
        if len(self._waiting) == _FRAMES_AT_ONCE:
            self._unpack()
        return True

    def _take_decisions(self, payload: bytes) -> bool:
        first, count = int.from_bytes(payload[:2], "little"), int.from_bytes(payload[2:4], "little")
        if len(payload) < 4 or not 1 <= count <= _MOST_DECISIONS or len(payload) != 4 + (count + 7) // 8:
            return False
        missing = (first - self._decided) & 0xFFFF
        self.counters.lost_events += missing
        self._decided += missing
        bits = np.unpackbits(np.frombuffer(payload, np.uint8, offset=4), count=count, bitorder="little")
        self._decisions.append((self._decided, bits.astype(np.bool_)))
        self._decided += count
        return True

    def _unpack(self) -> None:
        """Decode the frames that wait, all at once; one that is not sound in spite of its CRC is lost alone."""
        payloads, ticks = self._waiting, self._waiting_ticks
        if not payloads:
            return
        self._waiting, self._waiting_ticks = [], []
        columns = unpack(payloads, np.array(ticks, np.int64), self.width, self.height)
        if columns is None:
            if len(payloads) > 1:
                for payload, tick in zip(payloads, ticks, strict=True):
                    self._waiting, self._waiting_ticks = [payload], [tick]
                    self._unpack()
                return
            self.counters.bad_bytes += len(payloads[0])
            self.counters.lost_events += payloads[0][6]
            return
        times = columns.ticks if self._tick_ns == 1000 else columns.ticks * self._tick_ns // 1000
        self._outbox.put(times, columns.x, columns.y, columns.p)
