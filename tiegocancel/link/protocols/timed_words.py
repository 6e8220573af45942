"""Keep in step with event words whose time comes in words of its own, and doubt a time that jumps."""

from __future__ import annotations

import math
from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from tiegocancel.link.protocols.alignment import AlignedDecoder, Kind
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["TimedWordDecoder"]

_LOOK_BYTES, _LOOK_TIMES = 8192, 3
_WILD_BITS = 24.0
_NEAR_US = 1 << 16


class TimedWordDecoder(AlignedDecoder):
    """Decode little-endian words of ``row_bytes``; the words of kind 8 carry the high bits of the time.

    ``high_bits`` of them count steps of 2^``step_bits`` µs. A step of up to ``plain_steps`` is taken as it comes. A
    larger one, or one back, is taken when the next time word goes on from there, and refused when it goes back: a bit
    that was spoilt in it would move all events until then, or all behind it. Without handshake: what streams, streams.
    """

    high_bits: int
    step_bits: int
    plain_steps: int

    def __init__(self, options: ProtocolOptions, *, width: int, height: int) -> None:
        super().__init__(options, width=width, height=height)
        self._high: int | None = None
        self._most_steps = max(options.max_jump_us >> self.step_bits, self.plain_steps)
        self._near_steps = max(_NEAR_US >> self.step_bits, 1)

    @abstractmethod
    def _jump(self, step: int, high: int) -> None:
        """Follow the time through a jump of ``step`` to ``high`` that was believed."""

    def _words(self, rows: NDArray[np.uint8]) -> NDArray[np.unsignedinteger]:
        """Return the words of ``rows`` [n]."""
        words: NDArray[np.unsignedinteger] = rows.view(f"<u{self.row_bytes}")[:, 0]
        return words

    def _high_of(self, data: bytes, place: int) -> int | None:
        """Return the time that the word at ``place`` carries, ``None`` where it carries none."""
        word = int.from_bytes(data[place : place + self.row_bytes], "little")
        return word & ((1 << self.high_bits) - 1) if word >> (8 * self.row_bytes - 4) == 8 else None

    def _step(self, before: int, after: int) -> int:
        return (after - before) & ((1 << self.high_bits) - 1)

    def _search(self, data: bytes, place: int, *, final: bool) -> int:
        high = self._high_of(data, place)
        if high is not None and self._high is not None and (step := self._step(self._high, high)) > self.plain_steps:
            believed = self._confirmed(data, place, high, final=final)
            if believed is None:
                return 0
            if believed:
                if step > self._most_steps:
                    self.counters.time_jumps += 1
                self._jump(step, high)
                self._accept(np.frombuffer(data, np.uint8, self.row_bytes, place).reshape(1, -1), searched=True)
                return self.row_bytes
        return super()._search(data, place, final=final)

    def _high_fits(self, highs: NDArray[np.int64], at: NDArray[np.int64], rows: int) -> NDArray[np.bool_]:
        """Return which time words [n], at the places ``at`` among ``rows`` words, go on from the one before.

        A step beyond the plain ones needs the next word to go on from there; for the last the answer may be to come.
        """
        mask = (1 << self.high_bits) - 1
        first = int(highs[0]) if self._high is None else self._high
        steps = np.diff(highs, prepend=first) & mask
        plain = steps <= self.plain_steps
        near = steps <= self._most_steps
        self._undecided = -1
        if not plain[-1] and (rows - int(at[-1])) * self.row_bytes < _LOOK_BYTES:
            self._undecided = int(at[-1])
        fits: NDArray[np.bool_] = plain | (near & np.append(near[1:], False))
        return fits

    def _confirmed(self, data: bytes, place: int, high: int, *, final: bool) -> bool | None:
        """Tell whether the next time words go on from ``high``; ``None`` while they may still come."""
        assert self._high is not None
        step = self._step(self._high, high)
        complete = final or len(data) - place >= _LOOK_BYTES
        start, count = place + self.row_bytes, min(len(data) - place, _LOOK_BYTES) // self.row_bytes - 1
        words = np.frombuffer(data, f"<u{self.row_bytes}", max(count, 0), start if count > 0 else 0)
        at = np.flatnonzero(words >> (8 * self.row_bytes - 4) == 8)[:_LOOK_TIMES]
        after = words[at].astype(np.int64) & ((1 << self.high_bits) - 1)
        if step <= self._most_steps:
            if not len(after):
                return True if complete else None
            return self._step(high, int(after[0])) <= self._most_steps
        # Beyond what is plausible several have to agree, and all between them to be sound.
        if len(after) < _LOOK_TIMES and not complete:
            return None
        steps = np.diff(after, prepend=high) & ((1 << self.high_bits) - 1)
        if (
            not len(after)
            or (steps > self._near_steps).any()
            or self._step(self._high, int(after[0])) <= self._most_steps
        ):
            return False
        between = words[: int(at[-1])]
        return bool(self._sound(between).all())

    @abstractmethod
    def _sound(self, words: NDArray[np.unsignedinteger]) -> NDArray[np.bool_]:
        """Return which words are of known kinds, their events on the sensor."""

    def _cheapest(self, data: bytes, span: int) -> tuple[Kind, int]:
        kind, length = super()._cheapest(data, span)
        high = self._high_of(data, 0)
        if kind == "row" and high is not None and self._high is not None:
            if self._step(self._high, high) <= self.plain_steps:
                return kind, length
            # It was not confirmed: the word stands in its place, and its time is wrong.
            self.counters.time_jumps += 1
            return "junk", self.row_bytes
        return kind, length

    def _high_bits_cost(self, before: int | None, high: int) -> float:
        """Return what a time word costs: few bits for small steps."""
        if before is None:
            return 4.0 + 4.0
        step = self._step(before, high)
        if step <= self._most_steps:
            return 4.0 + min(2 * math.log2(1 + step), self.high_bits)
        return 4.0 + self.high_bits + _WILD_BITS
