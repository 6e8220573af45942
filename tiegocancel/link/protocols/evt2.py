"""Speak raw EVT 2.0 words over a serial line, as GENX320 boards with a microcontroller send them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.files.evt2_words import HIGH_MASK, KNOWN_KINDS, TIME_HIGH, encode_words, event_fields
from tiegocancel.link.protocols.alignment import Piece
from tiegocancel.link.protocols.axes import to_device
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.raw import RawDevice, RawHost
from tiegocancel.link.protocols.timed_words import TimedWordDecoder

__all__ = ["Evt2Decoder", "Evt2Encoder", "decoder", "device", "encoder", "host"]

_SIDE_PX = 320
"""The GENX320, the one sensor known to send these words over a serial line; another needs its size."""
_WIDEST_PX = 2048
_OTHER_BITS, _LATE_BITS = 34.0, 10.0


class Evt2Decoder(TimedWordDecoder):
    """Decode 32-bit words, 320x320 px unless the options say otherwise.

    The right one of four offsets is the one where words are of known kinds, events lie on the sensor and the time goes
    on. Events before the first time word have no time: ``lost_events``. Triggers and vendors' words are passed over.
    """

    row_bytes = 4
    high_bits = 28
    step_bits = 6
    plain_steps = 16

    def __init__(self, options: ProtocolOptions) -> None:
        super().__init__(options, width=_SIDE_PX, height=_SIDE_PX)
        self._event_bits = 8.0 + math.log2(self.width * self.height)
        self._time_high = 0
        self._low = 0

    def _fits(self, rows: NDArray[np.uint8]) -> NDArray[np.bool_]:
        words = self._words(rows)
        fits = self._sound(words)
        at = np.flatnonzero(words >> 28 == TIME_HIGH)
        self._undecided = -1
        if len(at):
            fits[at] &= self._high_fits(words[at].astype(np.int64) & HIGH_MASK, at, len(words))
        return fits

    def _sound(self, words: NDArray[np.unsignedinteger]) -> NDArray[np.bool_]:
        kind = words >> 28
        on_sensor = ((words >> 11) & 0x7FF < self._columns()) & (words & 0x7FF < self._rows())
        sound: NDArray[np.bool_] = KNOWN_KINDS[kind] & ((kind > 1) | on_sensor)
        return sound

    def _take(self, rows: NDArray[np.uint8], *, searched: bool) -> None:
        words = self._words(rows)
        kind = words >> 28
        at = np.flatnonzero(kind == TIME_HIGH)
        cd = np.flatnonzero(kind <= 1)
        if self._high is None:
            timed = int(np.searchsorted(cd, at[0])) if len(at) else len(cd)
            self.counters.lost_events += timed
            cd = cd[timed:]
            if len(at):
                self._high = self._time_high = int(words[at[0]]) & HIGH_MASK
        if self._high is None:
            return
        highs = words[at].astype(np.int64) & HIGH_MASK
        steps = np.diff(highs, prepend=self._high) & HIGH_MASK
        bases = np.concatenate([[self._time_high], self._time_high + np.cumsum(steps)])
        base = np.repeat(bases, np.diff(np.concatenate([[0], at, [len(words)]])))
        low, x, y = event_fields(words[cd])
        self._outbox.put(base[cd] << 6 | low.astype(np.int64), x, y, kind[cd].astype(np.uint8))
        self._time_high = int(bases[-1])
        if len(at):
            self._high, self._low = int(highs[-1]), 0
        if len(cd) and (not len(at) or cd[-1] > at[-1]):
            self._low = int(low[-1])

    def _jump(self, step: int, high: int) -> None:
        back = HIGH_MASK + 1 - step
        if back <= self._most_steps:
            # From a time word that was spoilt by little and believed: what followed was held to its time.
            self._time_high -= back
        elif back <= step:
            self._outbox.go_on_from(high << 6)
            self._time_high = high
        else:
            self._time_high += step
        self._high = high

    def _state(self) -> tuple[int | None, int]:
        return self._high, self._low

    def _pieces(self, data: bytes, place: int, state: Any) -> list[Piece]:
        if place + 4 > len(data):
            return []
        word = int.from_bytes(data[place : place + 4], "little")
        kind = word >> 28
        high, low = state
        if kind <= 1:
            if word >> 11 & 0x7FF >= self._columns() or word & 0x7FF >= self._rows():
                return []
            now = word >> 22 & 0x3F
            return [("row", 4, self._event_bits + (_LATE_BITS if now < low else 0.0), (high, now))]
        if kind == TIME_HIGH:
            return [("row", 4, self._high_bits_cost(high, word & HIGH_MASK), (word & HIGH_MASK, 0))]
        return [("row", 4, _OTHER_BITS, state)] if KNOWN_KINDS[kind] else []

    def _least_bits(self) -> float:
        return 1.0

    def _columns(self) -> int:
        return self.height if self.options.swap_xy else self.width

    def _rows(self) -> int:
        return self.width if self.options.swap_xy else self.height


class Evt2Encoder:
    """Encode with a time word wherever time bits 33–6 change; times modulo 2^34 µs, sensors up to 2048x2048 px."""

    def __init__(self, options: ProtocolOptions) -> None:
        self._options = options
        self._high = -1

    def begin(self) -> bytes:
        """Return nothing: the first word is one of time."""
        return b""

    def encode(self, events: Events) -> bytes:
        """Return the words of a chunk."""
        if not len(events):
            return b""
        if max(events.width, events.height) > _WIDEST_PX:
            raise ConfigError(f"EVT2 holds sensors up to 2048x2048 px, not {events.width}x{events.height}")
        words, self._high = encode_words(to_device(events, self._options), self._high)
        return words.tobytes()

    def end(self) -> bytes:
        """Return nothing: every event went when it came."""
        return b""


def decoder(options: ProtocolOptions) -> Evt2Decoder:
    """Return a decoder."""
    return Evt2Decoder(options)


def encoder(options: ProtocolOptions) -> Evt2Encoder:
    """Return an encoder."""
    return Evt2Encoder(options)


def host(options: ProtocolOptions) -> RawHost:
    """Return a host that sends nothing."""
    return RawHost()


def device(options: ProtocolOptions) -> RawDevice:
    """Return a device that streams always."""
    return RawDevice(lambda: Evt2Encoder(options))
