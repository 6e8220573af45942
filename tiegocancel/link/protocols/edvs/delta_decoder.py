"""Decode E1, the eDVS format whose events bear the time since the one before in as few bytes as it takes."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.link.protocols.edvs.layout import SIDE_PX
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.outbox import Outbox
from tiegocancel.link.protocols.protocol import LinkCounters, TextLine

__all__ = ["EdvsDeltaDecoder"]

_TEXT = re.compile(rb"[\t\r\x20-\x7e]{0,200}\n")
_TEXT_SO_FAR = re.compile(rb"[\t\r\x20-\x7e]{0,200}\Z")
_MOST_GROUPS = 4


class EdvsDeltaDecoder:
    """Decode 1yyyyyyy pxxxxxxx, then 7 bits of the step a byte, most significant first, bit 7 on the last of at most 4.

    The order of the groups is that of the firmware's main loop. The first step counts from 0. A lost or spoilt step
    cannot be told from a right one unless it exceeds ``options.max_jump_us``, and shifts all times behind it: where
    bytes may be lost, ask for E3 or E4.
    """

    def __init__(self, options: ProtocolOptions) -> None:
        self.options = options
        self.width = options.width or SIDE_PX
        self.height = options.height or SIDE_PX
        self.counters = LinkCounters()
        self._outbox = Outbox(self.width, self.height, options)
        self._held = b""
        self._time_us = 0
        self._in_step = True

    def feed(self, data: bytes) -> Events:
        """Take bytes; return the events that are complete."""
        self.counters.bytes += len(data)
        self._held += data
        place = 0
        while place < len(self._held):
            place, cut = self._events_from(place)
            length = -1 if cut else self._beyond_event(place)
            if length < 0:
                break
            place += length
        self._held = self._held[place:]
        return self._outbox.take(self.counters)

    def settle(self) -> Events:
        """Return nothing: no event waits for its successor."""
        return self._outbox.take(self.counters)

    def take_lines(self) -> list[TextLine]:
        """Return and forget the text lines that came since the last call."""
        return self._outbox.take_lines()

    def _events_from(self, place: int) -> tuple[int, bool]:
        """Take the whole events from ``place`` on; return the place behind them, and whether the rest is cut."""
        data = np.frombuffer(self._held, np.uint8)[place:]
        last = np.where(data >= 0x80, np.arange(len(data)), len(data))
        last = np.minimum.accumulate(last[::-1])[::-1]
        # Behind the event that would begin at each byte; none where it does not begin there, one too far where cut.
        behind = np.full(len(data) + 1, -1, np.int64)
        if len(data) > 2:
            ends = last[2:] + 1
            groups = ends - np.arange(2, len(data))
            sound = (data[:-2] >= 0x80) & (groups <= _MOST_GROUPS)
            behind[: len(data) - 2][sound] = ends[sound]
        hops = behind.tolist()
        starts, at, size = [], 0, len(data)
        while at < size and (to := hops[at]) > 0 and to <= size:
            starts.append(at)
            at = to
        if starts:
            at = self._take(data, np.array([*starts, at], np.int64))
        begun = at < size and data[at] >= 0x80
        return place + at, bool(begun and size - at < 2 + _MOST_GROUPS and not (data[at + 2 :] >= 0x80).any())

    def _take(self, data: NDArray[np.uint8], starts: NDArray[np.int64]) -> int:
        """Take events between ``starts`` up to a step that is no step; return where to go on."""
        ends = starts[1:]
        steps = np.zeros(len(ends), np.int64)
        for back in range(_MOST_GROUPS):
            has = ends - 1 - back >= starts[:-1] + 2
            steps[has] |= (data[ends[has] - 1 - back].astype(np.int64) & 0x7F) << 7 * back
        wild = (steps > self.options.max_jump_us) & (np.arange(len(steps)) > 0 if self._time_us == 0 else True)
        count = int(np.argmax(wild)) if wild.any() else len(steps)
        if count:
            if not self._in_step:
                self._in_step = True
                self.counters.resyncs += 1
            first, steps = starts[:count], steps[:count]
            times = self._time_us + np.cumsum(steps)
            self._time_us = int(times[-1])
            off = (data[first + 1] >> 7) ^ (not self.options.off_bit)
            self._outbox.put(times, data[first + 1] & 0x7F, data[first] & 0x7F, 1 - off)
        if count == len(ends):
            return int(ends[-1])
        self.counters.time_jumps += 1
        self.counters.bad_bytes += int(ends[count] - starts[count])
        self._in_step = False
        return int(ends[count])

    def _beyond_event(self, place: int) -> int:
        """Pass over what is no event at ``place``; return its length, −1 to wait for more bytes, 0 at an event."""
        if place >= len(self._held):
            return -1
        if self._held[place] < 0x80:
            if line := _TEXT.match(self._held, place):
                if text := line[0].decode("ascii").strip():
                    self.counters.text_lines += 1
                    self._outbox.put_line(self._time_us, text)
                return len(line[0])
            if len(self._held) - place < 200 and _TEXT_SO_FAR.match(self._held, place):
                return -1
        elif len(self._held) - place < 2 + _MOST_GROUPS:
            return -1
        else:
            groups = self._held[place + 2 : place + 2 + _MOST_GROUPS]
            if any(group >= 0x80 for group in groups):
                return 0
        self.counters.bad_bytes += 1
        self._in_step = False
        return 1
