"""Speak raw EVT 3.0 words over a serial line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.files.evt3_encoding import Evt3Encoding
from tiegocancel.files.evt3_words import (
    ADDR_X,
    ADDR_Y,
    BASE_X,
    TIME_HIGH,
    TIME_LOW,
    UNKNOWN_KINDS,
    VECTOR_8,
    VECTOR_12,
    Evt3State,
    decode_words,
)
from tiegocancel.link.protocols.alignment import Piece
from tiegocancel.link.protocols.axes import to_device
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.raw import RawDevice, RawHost
from tiegocancel.link.protocols.timed_words import TimedWordDecoder

__all__ = ["Evt3Decoder", "Evt3Encoder", "decoder", "device", "encoder", "host"]

_SIDE_PX = 320
"""The GENX320, the sensor of serial boards; another needs its size."""
_WIDEST_PX = 2048
_KIND_BITS, _LATE_BITS, _OTHER_BITS = 3.0, 10.0, 21.0
_LOW_MASK = 0xFFF


class Evt3Decoder(TimedWordDecoder):
    """Decode 16-bit words, 320x320 px unless the options say otherwise.

    The right one of two offsets is the one where words are of known kinds, rows and columns lie on the sensor and time
    goes on. A word that is lost spoils what it said, row, base or time, until it is said again: behind a breach events
    without a row are left out (``lost_events``), not guessed. Triggers and vendors' words are passed over.
    """

    row_bytes = 2
    look_rows = 12
    look_far_rows = 48
    high_bits = 12
    step_bits = 12
    plain_steps = 1

    def __init__(self, options: ProtocolOptions) -> None:
        super().__init__(options, width=_SIDE_PX, height=_SIDE_PX)
        self._words_state = Evt3State()
        self._low: int | None = None
        swap = options.swap_xy
        self._columns, self._rows = (self.height, self.width) if swap else (self.width, self.height)
        self._x_bits = _KIND_BITS + 1 + math.log2(self._columns)
        self._y_bits = _KIND_BITS + 1 + math.log2(self._rows)

    def _fits(self, rows: NDArray[np.uint8]) -> NDArray[np.bool_]:
        words = self._words(rows)
        kind = words >> 12
        fits = self._sound(words)
        timed = np.flatnonzero((kind == TIME_HIGH) | (kind == TIME_LOW))
        self._undecided = -1
        if not len(timed):
            return fits
        values = words[timed].astype(np.int64) & _LOW_MASK
        is_high = kind[timed] == TIME_HIGH
        at = timed[is_high]
        if len(at):
            fits[at] &= self._high_fits(values[is_high], at, len(words))
        # Until the next TIME_HIGH the low bits do not fall.
        before = np.concatenate([[-1 if self._low is None else self._low], np.where(is_high, -1, values)[:-1]])
        fits[timed] &= is_high | (values >= before)
        return fits

    def _sound(self, words: NDArray[np.unsignedinteger]) -> NDArray[np.bool_]:
        kind = words >> 12
        place = words & 0x7FF
        beyond = ((kind == ADDR_X) | (kind == BASE_X)) & (place >= self._columns)
        beyond |= (kind == ADDR_Y) & ((words & _LOW_MASK) >= self._rows)
        sound: NDArray[np.bool_] = ~(UNKNOWN_KINDS[kind] | beyond)
        return sound

    def _take(self, rows: NDArray[np.uint8], *, searched: bool) -> None:
        words = self._words(rows)
        kind = (words >> 12).astype(np.uint8)
        state = self._words_state
        block, left_out = decode_words(words, kind, state)
        self.counters.lost_events += left_out
        self._outbox.put(block.t, block.x, block.y, block.p)
        timed = np.flatnonzero((kind == TIME_HIGH) | (kind == TIME_LOW))
        if len(timed):
            last = int(timed[-1])
            self._low = int(words[last]) & _LOW_MASK if kind[last] == TIME_LOW else None
            if state.time_us >= 0:
                self._high = state.high

    def _jump(self, step: int, high: int) -> None:
        state = self._words_state
        back = _LOW_MASK + 1 - step
        if back <= self._most_steps:
            # From a time word that was spoilt by little and believed.
            state.loops -= int(high > state.high)
        elif back <= step:
            self._outbox.go_on_from(state.loops << 24 | high << 12)
        else:
            state.loops += int(high < state.high)
        # The decoder of the words looks for wraps against this: there is none left for it to find.
        state.high = self._high = high

    def _breach(self) -> None:
        self._words_state.y = self._words_state.column = -1

    def _state(self) -> tuple[int | None, int]:
        return self._high, -1 if self._low is None else self._low

    def _pieces(self, data: bytes, place: int, state: Any) -> list[Piece]:
        if place + 2 > len(data):
            return []
        word = data[place] | data[place + 1] << 8
        kind, value = word >> 12, word & _LOW_MASK
        high, low = state
        if UNKNOWN_KINDS[kind]:
            return []
        if kind == TIME_HIGH:
            return [("row", 2, self._high_bits_cost(high, value), (value, -1))]
        if kind == TIME_LOW:
            late = value < low
            bits = 12.0 + _LATE_BITS if late else min(2 * math.log2(1 + value - max(low, 0)), 12.0)
            return [("row", 2, _KIND_BITS + bits, (high, value))]
        if kind in (ADDR_X, BASE_X):
            return [("row", 2, self._x_bits, state)] if value & 0x7FF < self._columns else []
        if kind == ADDR_Y:
            return [("row", 2, self._y_bits, state)] if value < self._rows else []
        if kind in (VECTOR_12, VECTOR_8):
            return [("row", 2, _KIND_BITS + 12.0, state)]
        return [("row", 2, _OTHER_BITS, state)]

    def _least_bits(self) -> float:
        return 1.5


class Evt3Encoder:
    """Encode words with vectors where they pay; times modulo 2^24 µs, sensors up to 2048x2048 px."""

    def __init__(self, options: ProtocolOptions) -> None:
        self._options = options
        self._encoding = Evt3Encoding()

    def begin(self) -> bytes:
        """Return nothing: the first word is one of time."""
        return b""

    def encode(self, events: Events) -> bytes:
        """Return the words of a chunk."""
        if max(events.width, events.height) > _WIDEST_PX:
            raise ConfigError(f"EVT3 holds sensors up to 2048x2048 px, not {events.width}x{events.height}")
        return self._encoding.encode(to_device(events, self._options)).tobytes()

    def end(self) -> bytes:
        """Return nothing: every event went when it came."""
        return b""


def decoder(options: ProtocolOptions) -> Evt3Decoder:
    """Return a decoder."""
    return Evt3Decoder(options)


def encoder(options: ProtocolOptions) -> Evt3Encoder:
    """Return an encoder."""
    return Evt3Encoder(options)


def host(options: ProtocolOptions) -> RawHost:
    """Return a host that sends nothing."""
    return RawHost()


def device(options: ProtocolOptions) -> RawDevice:
    """Return a device that streams always."""
    return RawDevice(lambda: Evt3Encoder(options))
