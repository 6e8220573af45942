"""Decode the lines that an OpenMV camera with a GENX320 prints, row by row."""

from __future__ import annotations

import math
import re
import struct
from binascii import a2b_base64
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tiegocancel.link.protocols.alignment import AlignedDecoder, Kind, Piece
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["SIDE_PX", "WRAP_S", "OpenMvDecoder"]

SIDE_PX = 320
WRAP_S = 1 << 16
_PERIOD_US = WRAP_S * 1_000_000
_MARKER = re.compile(rb"((?:\r?\n)?<[\x20-\x7e]{1,80}\r?\n)")
_CHUNK = re.compile(rb"C (\d{1,6}) ")
_NEXT_LINE = re.compile(rb"(\r?\nC \d{1,6} |C \d{1,6} )[A-Za-z0-9+/]{16}")
_DATA = re.compile(r"[A-Za-z0-9+/]{8,}={0,2}|C \d+.*")
_ROW_BYTES = 16
"""An event is 6 numbers of 16 bits, 12 bytes, and so 16 characters of base64 for itself."""
_BASE64 = re.compile(rb"[A-Za-z0-9+/]*")
_OTHER_KIND = 5
_ROW_BITS, _PAUSE_BITS, _JUMP_BITS = 30.0, 30.0, 145.0
_PLAIN_US = 16_384
_NUMBERS = struct.Struct("<6H")
_ROW_TEXT = re.compile(rb"[A-Za-z0-9+/]{16}")


class _Fields(NamedTuple):
    """Columns [n] of rows: whether each can be one, its kind, its time in µs, column and row."""

    sound: NDArray[np.bool_]
    kind: NDArray[np.uint16]
    clock_us: NDArray[np.int64]
    x: NDArray[np.uint16]
    y: NDArray[np.uint16]

    def head(self, count: int) -> _Fields:
        """Return the first ``count`` rows."""
        return _Fields(self.sound[:count], self.kind[:count], self.clock_us[:count], self.x[:count], self.y[:count])


class OpenMvDecoder(AlignedDecoder):
    """Decode ``C <events> <base64>`` lines, each event kind, s, ms, µs, x, y; 320x320 px unless the options differ.

    An event is 16 characters, so a spoilt one loses that event and not its line: rows are told by their alphabet, by
    ms and µs below 1000, the sensor and the time. What a line says it holds and does not is ``lost_events``. Kinds
    above 1 (triggers) are passed over. Seconds wrap every 65,536. Every other line is text.
    """

    row_bytes = _ROW_BYTES

    def __init__(self, options: ProtocolOptions) -> None:
        super().__init__(options, width=SIDE_PX, height=SIDE_PX)
        swap = options.swap_xy
        self._columns, self._rows = (self.height, self.width) if swap else (self.width, self.height)
        self._clock_us: int | None = None
        self._time_us = 0
        self._told = self._came = 0
        self._seen = self._fields(b"")

    def _fields(self, text: bytes) -> _Fields:
        """Read rows of characters that are all of base64."""
        numbers = np.frombuffer(a2b_base64(text), "<u2").reshape(-1, 6)
        kind, seconds, ms, us, x, y = numbers.T
        on_sensor = (kind > 1) | ((x < self._columns) & (y < self._rows))
        sound: NDArray[np.bool_] = (kind <= _OTHER_KIND) & (ms < 1000) & (us < 1000) & on_sensor
        return _Fields(sound, kind, (seconds.astype(np.int64) * 1000 + ms) * 1000 + us, x, y)

    def _fits(self, rows: NDArray[np.uint8]) -> NDArray[np.bool_]:
        text = rows.tobytes()
        # Behind the first character that is none of base64 no row of this block can follow.
        whole = _base64_bytes(text) // _ROW_BYTES
        self._seen = self._fields(text[: whole * _ROW_BYTES])
        fits = np.zeros(len(rows), np.bool_)
        if whole:
            fits[:whole] = self._seen.sound & (self._steps(self._seen.clock_us) <= self.options.max_jump_us)
        return fits

    def _steps(self, clock_us: NDArray[np.int64]) -> NDArray[np.int64]:
        first = int(clock_us[0]) if self._clock_us is None else self._clock_us
        return np.diff(clock_us, prepend=first) % _PERIOD_US

    def _take(self, rows: NDArray[np.uint8], *, searched: bool) -> None:
        # Blocks that were not searched are the beginning of what was just looked at.
        fields = self._fields(rows.tobytes()) if searched else self._seen.head(len(rows))
        if self._clock_us is None:
            self._time_us = int(fields.clock_us[0])
        steps = self._steps(fields.clock_us)
        if searched and int(steps[0]) > self.options.max_jump_us:
            self.counters.time_jumps += 1
            back_us = _PERIOD_US - int(steps[0])
            if back_us <= self.options.max_jump_us:
                steps[0] = -back_us
            elif back_us <= int(steps[0]):
                steps[0] = 0
        times = self._time_us + np.cumsum(steps)
        self._clock_us, self._time_us = int(fields.clock_us[-1]), int(times[-1])
        self._came += len(rows)
        event = fields.kind <= 1
        self._outbox.put(times[event], fields.x[event], fields.y[event], fields.kind[event].astype(np.uint8))

    def _state(self) -> int | None:
        return self._clock_us

    def _pieces(self, data: bytes, place: int, state: Any) -> list[Piece]:
        pieces: list[Piece] = []
        if head := _CHUNK.match(data, place):
            pieces.append(("text", len(head[0]), 8.0 + 4.0 * len(head[0]), state))
        else:
            pieces += self._text_piece(data, place, state)
        clock_us = self._clock_of(data[place : place + _ROW_BYTES])
        if clock_us is not None:
            step_us = 0 if state is None else (clock_us - state) % _PERIOD_US
            plausible = step_us <= self.options.max_jump_us
            bits = _ROW_BITS + (2 * math.log2(1 + step_us) if plausible else _JUMP_BITS)
            bits += _PAUSE_BITS if step_us > _PLAIN_US and plausible else 0.0
            pieces.append(("row", _ROW_BYTES, bits, clock_us))
        return pieces

    def _clock_of(self, row: bytes) -> int | None:
        """Return the time of one row in µs, ``None`` where it cannot be one; the same rule as :meth:`_fields`."""
        if len(row) < _ROW_BYTES or not _ROW_TEXT.fullmatch(row):
            return None
        kind, seconds, ms, us, x, y = _NUMBERS.unpack(a2b_base64(row))
        if kind > _OTHER_KIND or ms >= 1000 or us >= 1000 or (kind <= 1 and (x >= self._columns or y >= self._rows)):
            return None
        return int((seconds * 1000 + ms) * 1000 + us)

    def _is_whole_text(self, text: bytes) -> bool:
        return text.endswith(b"\n") or _CHUNK.fullmatch(text.lstrip()) is not None

    def _plainly(self, data: bytes, place: int) -> tuple[Kind, int] | None:
        if (head := _NEXT_LINE.match(data, place)) or (head := _MARKER.match(data, place)):
            return "text", len(head[1])
        clock_us = self._clock_of(data[place : place + _ROW_BYTES])
        if clock_us is None or self._clock_us is None or not _NEXT_LINE.match(data, place + _ROW_BYTES):
            return None
        plain = (clock_us - self._clock_us) % _PERIOD_US <= _PLAIN_US
        return ("row", _ROW_BYTES) if plain else None

    def _is_wild(self, row: bytes) -> bool:
        clock_us = self._clock_of(row)
        if clock_us is None or self._clock_us is None:
            return False
        return (clock_us - self._clock_us) % _PERIOD_US > self.options.max_jump_us

    def _least_bits(self) -> float:
        return _ROW_BITS / _ROW_BYTES

    def _goes_on(self, rows: bytes) -> bool:
        if self._clock_us is None:
            return True
        clocks = [self._clock_of(rows[at : at + _ROW_BYTES]) for at in range(0, len(rows), _ROW_BYTES)]
        steps = [(clock - self._clock_us) % _PERIOD_US for clock in clocks if clock is not None]
        # Two rows between the last event and this one say that it is this one whose time was spoilt.
        return clocks[0] is None or sum(step < steps[0] for step in steps[1:]) < 2

    def _waits(self, data: bytes, place: int) -> bool:
        return self._text_waits(data, place)

    def _take_text(self, line: bytes) -> None:
        if head := _CHUNK.fullmatch(line.lstrip()):
            self._count_line(int(head[1]))
            return
        text = line.decode("ascii").strip()
        if not text:
            return
        if _DATA.fullmatch(text):
            # The rest of a line of events that was spoilt.
            self.counters.bad_bytes += len(line)
            return
        self._count_line(0)
        self.counters.text_lines += 1
        self._outbox.put_line(self._time_us, text)

    def _count_line(self, told: int) -> None:
        """Count what is missing of the line before, and begin one of ``told`` events."""
        self.counters.lost_events += max(self._told - self._came, 0)
        self._told, self._came = told, 0


def _base64_bytes(text: bytes) -> int:
    """Return how many characters from the start of ``text`` on are of base64."""
    found = _BASE64.match(text)
    return found.end() if found else 0
