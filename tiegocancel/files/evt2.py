"""Read and write Prophesee RAW files of EVT 2.0: 32-bit little-endian words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.files.block import Block
from tiegocancel.files.evt2_words import HIGH_MASK, KNOWN_KINDS, LOOP_US, TIME_HIGH, WORD, encode_words, event_fields
from tiegocancel.files.prophesee_raw import PropheseeRawReader
from tiegocancel.files.words import words
from tiegocancel.files.writer import EventWriter

__all__ = ["Evt2Reader", "Evt2Writer"]

_LOOP_STEPS = (LOOP_US >> 6) - (10_000 >> 6)
"""A time that falls by nearly the whole range has wrapped; a smaller fall is disorder (OpenEB's decoder)."""
_BLOCK_WORDS = 1 << 16


class Evt2Reader(PropheseeRawReader):
    """Decode EVT 2.0: bits 31–28 are the type; 0 OFF and 1 ON hold 6 bits of time, 11 of x, 11 of y.

    Type 8 carries time bits 33–6, whose wraps every 2^34 µs are followed. Words before the first of these have no
    time and are left out; triggers and vendor words are passed over; an unknown type is a fault.
    """

    format: ClassVar[str] = "evt2"
    encoding: ClassVar[str] = "EVT 2.0"

    def _blocks(self) -> Iterator[Block]:
        base_us, high, loops, without_time = -1, 0, 0, 0
        for piece, offset in words(self.path, WORD, self._offset, _BLOCK_WORDS):
            kind = (piece >> 28).astype(np.uint8)
            known = KNOWN_KINDS[kind]
            fault = None
            if not known.all():
                unknown = int(np.argmin(known))
                fault = self.fail(f"byte {offset + 4 * unknown}", f"word type {kind[unknown]:#x} is none of EVT 2.0's")
                piece, kind = piece[:unknown], kind[:unknown]
            at = np.flatnonzero(kind == TIME_HIGH)
            highs = np.concatenate([[high], piece[at].astype(np.int64) & HIGH_MASK])
            turns = np.cumsum(np.diff(highs) <= -_LOOP_STEPS)
            bases = np.concatenate([[base_us], ((loops + turns) * LOOP_US) | (highs[1:] << 6)])
            cd = np.flatnonzero(kind <= 1)
            if bases[0] < 0:
                timed = at[0] if len(at) else len(piece)
                without_time += int(np.searchsorted(cd, timed))
                cd = cd[np.searchsorted(cd, timed) :]
            base = np.repeat(bases, np.diff(np.concatenate([[0], at, [len(piece)]])))
            if len(at):
                high, loops, base_us = int(highs[-1]), loops + int(turns[-1]), int(bases[-1])
            if without_time and base_us >= 0:
                self.note(f"{without_time} events before the first time word left out")
                without_time = 0
            yield _block(piece[cd], base[cd], kind[cd], offset, cd)
            if fault is not None:
                raise fault
        if without_time:
            self.note(f"{without_time} events left out: no time word in the file")


def _block(
    cd: NDArray[np.uint32], base_us: NDArray[np.int64], kind: NDArray[np.uint8], offset: int, at: NDArray[np.int64]
) -> Block:
    """Take the fields out of event words ``cd`` [n], which stand at the word indices ``at`` behind ``offset``."""
    low, x, y = event_fields(cd)
    return Block(base_us | low, x, y, kind, lambda row: f"byte {offset + 4 * int(at[row])}")


class Evt2Writer(EventWriter):
    """Write EVT 2.0 with a time word wherever time bits 33–6 change; other tools read it.

    Words are appended and flushed chunk by chunk: a killed process leaves all chunks written. Times from 0 to
    2^34 µs (4.77 h) and sensors up to 2048x2048 px; beyond that raise :class:`ConfigError`.
    """

    format: ClassVar[str] = "evt2"
    holds_labels: ClassVar[bool] = False
    holds_size: ClassVar[bool] = True

    def _begin(self) -> None:
        if max(self.width, self.height) > 2048:
            raise ConfigError(
                f"EVT2 holds sensors up to 2048x2048 px, not {self.width}x{self.height}: write NPZ or CSV"
            )
        self._high = -1
        self._file = self.path.open("wb")
        self._file.write(
            (
                "% evt 2.0\n"
                f"% format EVT2;height={self.height};width={self.width}\n"
                f"% geometry {self.width}x{self.height}\n"
                "% end\n"
            ).encode("ascii")
        )

    def _append(self, events: Events) -> None:
        for time_us in (int(events.t[0]), int(events.t[-1])):
            if not 0 <= time_us < LOOP_US:
                raise ConfigError(f"EVT2 holds times from 0 to {LOOP_US - 1} µs, not {time_us}: write NPZ or CSV")
        out, self._high = encode_words(events, self._high)
        self._file.write(out.tobytes())
        self._file.flush()

    def _finish(self) -> None:
        self._file.close()
