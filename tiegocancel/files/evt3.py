"""Read Prophesee RAW files of EVT 3.0: 16-bit little-endian words that carry only what changed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from tiegocancel.files.block import Block
from tiegocancel.files.evt3_words import UNKNOWN_KINDS, WORD, Evt3State, decode_words
from tiegocancel.files.prophesee_raw import PropheseeRawReader
from tiegocancel.files.words import words

__all__ = ["Evt3Reader"]

_BLOCK_WORDS = 1 << 16


class Evt3Reader(PropheseeRawReader):
    """Decode EVT 3.0: bits 15–12 are the type, and time, row and vector base hold until the next word of their kind.

    Times wrap every 2^24 µs, which is followed; TIME_HIGH sets the lower bits to 0 until the next TIME_LOW. Events
    before the first TIME_HIGH, row or base word are left out; triggers and vendor words are passed over; an unknown
    type is a fault. Blocks of any size give the same events.
    """

    format: ClassVar[str] = "evt3"
    encoding: ClassVar[str] = "EVT 3.0"

    def _blocks(self) -> Iterator[Block]:
        state, left_out = Evt3State(), 0
        try:
            for piece, offset in words(self.path, WORD, self._offset, _BLOCK_WORDS):
                kind = (piece >> 12).astype(np.uint8)
                unknown = UNKNOWN_KINDS[kind]
                fault = None
                if unknown.any():
                    at = int(np.argmax(unknown))
                    fault = self.fail(f"byte {offset + 2 * at}", f"word type {int(kind[at]):#x} is none of EVT 3.0's")
                    piece, kind = piece[:at], kind[:at]
                block, skipped = decode_words(piece, kind, state, offset)
                left_out += skipped
                yield block
                if fault is not None:
                    raise fault
        finally:
            if left_out:
                self.note(f"{left_out} events left out that came before the first time, row or base word")
