"""Lay out the words of EVT 2.0, wherever they go: 32 bits each, an event or the high bits of the time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events

__all__ = ["HIGH_MASK", "KNOWN_KINDS", "LOOP_US", "TIME_HIGH", "WORD", "encode_words", "event_fields"]

TIME_HIGH = 0x8
KNOWN_KINDS = np.zeros(16, np.bool_)
KNOWN_KINDS[[0x0, 0x1, TIME_HIGH, 0xA, 0xD, 0xE, 0xF]] = True
"""Kinds of words, bits 31–28: 0 OFF, 1 ON, 8 time bits 33–6; triggers, IMU and vendors' words."""
HIGH_MASK = (1 << 28) - 1
LOOP_US = 1 << 34
WORD = np.dtype("<u4")


def event_fields(cd: NDArray[np.uint32]) -> tuple[NDArray[Any], NDArray[np.uint16], NDArray[np.uint16]]:
    """Return the low 6 bits of the time, column and row of event words [n]."""
    return (cd >> 22) & 0x3F, ((cd >> 11) & 0x7FF).astype(np.uint16), (cd & 0x7FF).astype(np.uint16)


def encode_words(events: Events, high: int) -> tuple[NDArray[np.uint32], int]:
    """Return the words of a chunk, a time word wherever time bits 33–6 differ from ``high``, and their last value.

    ``high`` is −1 at the start of a stream. Times are taken modulo 2^34 µs.
    """
    highs = (events.t >> 6) & HIGH_MASK
    fresh = highs != np.concatenate([[high], highs[:-1]])
    place = np.arange(len(events)) + np.cumsum(fresh)
    out = np.empty(len(events) + int(np.count_nonzero(fresh)), WORD)
    out[place[fresh] - 1] = (TIME_HIGH << 28) | highs[fresh]
    out[place] = (
        (events.p.astype(np.int64) << 28)
        | ((events.t & 63) << 22)
        | (events.x.astype(np.int64) << 11)
        | events.y.astype(np.int64)
    )
    return out, int(highs[-1])
