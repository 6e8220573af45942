"""Decode the event formats of an eDVS that have a fixed size, with text lines between events."""

from __future__ import annotations

import math
import re
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.link.protocols.alignment import AlignedDecoder, Kind, Piece
from tiegocancel.link.protocols.edvs.layout import SIDE_PX, stamp_bytes
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["EdvsDecoder"]

_PLAIN_STEP_US = {0: 0, 2: 4096, 3: 16_384, 4: 16_384}
"""A step up to this, by the bytes of the stamp, is taken as it comes; a larger one, or one back, is looked into."""
_PLACE_BITS, _ANY_BITS = 15.0, 8.0
"""What place and polarity cost, and any stamp at most above its own bits."""
_PAUSE_BITS, _JUMP_BITS, _RESTART_BITS = 12.0, 48.0, 24.0
"""What a step beyond the plain costs above its own bits, one beyond the plausible, and one back."""
_PERIOD_BITS, _BACK_BITS = 14.0, 10.0
"""What it costs that a whole period passes within a few events, where real pauses do so too (E2); and that the step
which completes it looks like a small one back."""
_RECENT = 64
_REPLY = re.compile(rb"-[A-Z][\x20-\x7e]{1,100}\n")
_REPLY_BEGINS = re.compile(rb"-[A-Z]")
_BANNER = re.compile(rb"e?DVS", re.IGNORECASE)


class EdvsDecoder(AlignedDecoder):
    """Decode E0, E2, E3 or E4 (``options.edvs_format``), 128x128 px unless the options say less.

    At the boundary of an event bit 7 is set; a byte without it begins a line of text. Stamps wrap every 2^16, 2^24 or
    2^32 µs and are followed; steps are weighed by the pace of the last 64 events. A step back that is confirmed, or the
    banner of a device, is a clock that began anew: time goes on from the last event. A pause of more than one wrap
    loses wraps (E2: 65.5 ms). E0 has no time: ``options.now_us`` stamps events when they are accepted.
    """

    def __init__(self, options: ProtocolOptions) -> None:
        super().__init__(options, width=SIDE_PX, height=SIDE_PX)
        self._stamp_bytes = stamp_bytes(options.edvs_format)
        self.row_bytes = 2 + self._stamp_bytes
        self._period_us = 1 << (8 * self._stamp_bytes)
        self._plain_us = min(_PLAIN_STEP_US[self._stamp_bytes], options.max_jump_us)
        self._stamp: int | None = None
        self._time_us = 0
        self._recent: list[int] = []
        self._pace: tuple[float, float] | None = None
        self._restarted = False

    def _fits(self, rows: NDArray[np.uint8]) -> NDArray[np.bool_]:
        head: NDArray[np.bool_] = rows[:, 0] >= 0x80
        if self._stamp_bytes:
            head &= self._steps(self._stamps(rows)) <= self._plain_us
        return head

    def _stamps(self, rows: NDArray[np.uint8]) -> NDArray[np.int64]:
        # A stamp of three bytes is read with the byte before it, which the mask takes off.
        width = 2 if self._stamp_bytes == 2 else 4
        words = rows[:, -width:].view(f">u{width}")[:, 0]
        return words.astype(np.int64) & (self._period_us - 1)

    def _steps(self, stamps: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the time from each event to the next in µs, modulo the period of the stamps."""
        first = int(stamps[0]) if self._stamp is None else self._stamp
        return np.diff(stamps, prepend=first) & (self._period_us - 1)

    def _take(self, rows: NDArray[np.uint8], *, searched: bool) -> None:
        if not self._stamp_bytes:
            now_us = self.options.now_us or (lambda: time.monotonic_ns() // 1000)
            self._time_us = max(self._time_us, now_us())
            self._put(np.full(len(rows), self._time_us, np.int64), rows)
            return
        stamps = self._stamps(rows)
        if self._stamp is None:
            # A clock that began anew goes on from the last event; the very first stamp is the origin.
            if self._restarted:
                self.counters.time_jumps += 1
            else:
                self._time_us = int(stamps[0])
            self._restarted = False
        steps = self._steps(stamps)
        if searched:
            steps[0] = self._believe(int(steps[0]))
        times = self._time_us + np.cumsum(steps)
        self._stamp, self._time_us = int(stamps[-1]), int(times[-1])
        self._recent = [*self._recent, *np.maximum(steps[-_RECENT:], 0).tolist()][-_RECENT:]
        self._pace = None
        self._put(times, rows)

    def _believe(self, step_us: int) -> int:
        """Return the step that the time takes, where the stamps step by ``step_us`` and the search confirmed it."""
        if step_us <= self.options.max_jump_us:
            return step_us
        self.counters.time_jumps += 1
        if self._period_us - step_us <= min(self.options.max_jump_us, self._period_us // 2):
            # Back from a stamp that was spoilt by little and believed: what followed it was held to its time.
            return step_us - self._period_us
        return step_us if step_us <= self._period_us // 2 else 0

    def _put(self, times: NDArray[np.int64], rows: NDArray[np.uint8]) -> None:
        off = (rows[:, 1] >> 7) ^ (not self.options.off_bit)
        self._outbox.put(times, rows[:, 1] & 0x7F, rows[:, 0] & 0x7F, 1 - off)

    def _state(self) -> tuple[int | None, int]:
        return self._stamp, 0

    def _pieces(self, data: bytes, place: int, state: Any) -> list[Piece]:
        if data[place] < 0x80:
            return self._text_piece(data, place, state)
        end = place + self.row_bytes
        if end > len(data):
            return []
        if not self._stamp_bytes:
            return [("row", 2, _PLACE_BITS, state)]
        before, elapsed_us = state
        stamp = int.from_bytes(data[place + 2 : end], "big")
        step_us = 0 if before is None else (stamp - before) & (self._period_us - 1)
        bits = _PLACE_BITS + self._step_bits(step_us)
        # After a stamp that is spoilt the next one comes back; where a wrap is as short as a pause, the two together
        # make a whole period.
        elapsed_us += step_us
        if step_us > self.options.max_jump_us:
            bits += _RESTART_BITS if step_us > self._period_us // 2 else _JUMP_BITS
        elif self._period_us > self.options.max_jump_us:
            bits += _PAUSE_BITS if step_us > self._plain_us else 0.0
        elif elapsed_us >= self._period_us:
            bits += _PERIOD_BITS + (_BACK_BITS if step_us >= self._period_us - self._plain_us else 0.0)
            # Of many pauses in a row only the first is held against them.
            elapsed_us -= 1 << 40
        return [("row", self.row_bytes, bits, (stamp, elapsed_us))]

    def _step_bits(self, step_us: int) -> float:
        """Return what a step costs: few bits at the pace of the stream, at most what any stamp would."""
        if self._pace is None:
            steps = sorted(self._recent)[: max(len(self._recent) * 3 // 4, 1)]
            mean_us = max(sum(steps) / len(steps), 16.0) if steps else 100.0
            self._pace = (1 / mean_us, math.log2(mean_us) + 1)
        per_us, base_bits = self._pace
        return min(base_bits + 2 * math.log2(1 + step_us * per_us), 8.0 * self._stamp_bytes + _ANY_BITS)

    def _least_bits(self) -> float:
        return (_PLACE_BITS + (self._step_bits(0) if self._stamp_bytes else 0.0)) / self.row_bytes

    def _waits(self, data: bytes, place: int) -> bool:
        return data[place] < 0x80 and self._text_waits(data, place)

    def _plainly(self, data: bytes, place: int) -> tuple[Kind, int] | None:
        if line := _REPLY.match(data, place):
            return "text", len(line[0])
        row = data[place : place + self.row_bytes]
        if self._stamp is None or row[0] < 0x80 or not _REPLY_BEGINS.match(data, place + self.row_bytes):
            return None
        step_us = (int.from_bytes(row[2:], "big") - self._stamp) & (self._period_us - 1)
        return ("row", self.row_bytes) if step_us <= self._plain_us else None

    def _is_wild(self, row: bytes) -> bool:
        if self._stamp is None or not self._stamp_bytes or row[0] < 0x80:
            return False
        step_us = (int.from_bytes(row[2:], "big") - self._stamp) & (self._period_us - 1)
        return step_us > min(self.options.max_jump_us, self._period_us // 2)

    def _doubts_pauses(self) -> bool:
        return self._period_us > self.options.max_jump_us

    def _goes_on(self, rows: bytes) -> bool:
        if self._stamp is None or self._period_us <= self.options.max_jump_us:
            return True
        whole = len(rows) // self.row_bytes * self.row_bytes
        block = np.frombuffer(rows[:whole], np.uint8).reshape(-1, self.row_bytes)
        # The last event may be ahead itself, by what passes as plain.
        steps = (self._stamps(block) - self._stamp + self._plain_us) & (self._period_us - 1)
        if steps[0] <= 2 * self._plain_us:
            return True
        # Two rows that lie between the last event and this one say that it is this one which was spoilt.
        between = (block[1:, 0] >= 0x80) & (steps[1:] < steps[0])
        return int(np.count_nonzero(between)) < 2

    def _take_text(self, line: bytes) -> None:
        text = line.decode("ascii").strip()
        if not text:
            return
        self.counters.text_lines += 1
        self._outbox.put_line(self._time_us, text)
        if _BANNER.search(line) and self._stamp is not None:
            self._stamp, self._restarted, self._recent, self._pace = None, True, [], None
