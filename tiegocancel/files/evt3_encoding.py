"""Encode events as words of EVT 3.0, with vectors where they take fewer words."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.files.evt3_words import ADDR_X, ADDR_Y, BASE_X, TIME_HIGH, TIME_LOW, VECTOR_12, WORD

__all__ = ["Evt3Encoding"]

_WINDOW_PX = 12
_Index = NDArray[np.int64]


class Evt3Encoding:
    """Hold what the words so far have said: time, row. Times are taken modulo 2^24 µs.

    Events of one time, row and polarity whose columns rise share a vector of 12 columns: where there are three of
    them, or two in the window right behind another vector.
    """

    def __init__(self) -> None:
        self._time_us = -1
        self._y = -1

    def encode(self, events: Events) -> NDArray[np.uint16]:
        """Return the words of a chunk."""
        n = len(events)
        if not n:
            return np.zeros(0, WORD)
        t, x, y, p = (column.astype(np.int64) for column in (events.t, events.x, events.y, events.p))
        before = np.concatenate([[self._time_us], t[:-1]])
        new_high = (t >> 12 != before >> 12) | (before < 0)
        # A TIME_HIGH sets the low bits to 0 for the decoder, and a TIME_LOW says them.
        new_low = (t != before) | new_high
        new_row = y != np.concatenate([[self._y], y[:-1]])
        self._time_us, self._y = int(t[-1]), int(y[-1])
        first, vector, based, start, mask = _vectors(x, p, new_low | new_row)
        # Of a group in one vector only the first event makes words.
        counts = np.stack([new_high, new_low, new_row, based, first | ~vector]).astype(np.int64)
        place = np.cumsum(counts.sum(axis=0)) - counts.sum(axis=0)
        out = np.empty(int(counts.sum()), WORD)
        words = (
            TIME_HIGH << 12 | (t >> 12 & 0xFFF),
            TIME_LOW << 12 | (t & 0xFFF),
            ADDR_Y << 12 | y,
            BASE_X << 12 | p << 11 | start,
            np.where(vector, VECTOR_12 << 12 | mask, ADDR_X << 12 | p << 11 | x),
        )
        for count, word in zip(counts, words, strict=True):
            has = count == 1
            out[place[has]] = word[has]
            place += count
        return out


def _vectors(x: _Index, p: _Index, breaks: NDArray[np.bool_]) -> tuple[NDArray[Any], ...]:
    """Group events [n] into windows of columns.

    Return whether each is the first of its group, in a vector, and the first behind a base word; the column where its
    window starts; and the mask of its group.
    """
    run = breaks | (np.diff(x, prepend=x[0]) <= 0) | (np.diff(p, prepend=p[0]) != 0)
    run[0] = True
    origin = x[np.flatnonzero(run)][np.cumsum(run) - 1]
    window = (x - origin) // _WINDOW_PX
    start = origin + _WINDOW_PX * window
    first = run | (np.diff(window, prepend=-1) != 0)
    firsts = np.flatnonzero(first)
    size = np.diff(np.append(firsts, len(x)))
    # A group continues the vector before it when it lies in the next window of the same run: no base word is needed.
    follows = ~run[firsts] & (np.diff(window[firsts], prepend=-1) == 1)
    chain = np.cumsum(~(follows & (size >= 2)))
    vector = (size >= 3) | (_set_before(size >= 3, chain) & (size >= 2))
    based = np.zeros(len(x), np.bool_)
    based[firsts] = vector & ~(follows & np.concatenate([[False], vector[:-1]]))
    group = np.cumsum(first) - 1
    mask = np.bitwise_or.reduceat(1 << (x - start), firsts)
    return first, vector[group], based, start, mask[group]


def _set_before(flags: NDArray[np.bool_], chain: _Index) -> NDArray[np.bool_]:
    """Return whether a flag was set at or before each place within its chain."""
    index = np.arange(len(flags))
    last = np.maximum.accumulate(np.where(flags, index, -1))
    begin = np.maximum.accumulate(np.where(np.diff(chain, prepend=0) > 0, index, 0))
    return last >= begin
