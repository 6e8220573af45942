"""Decode the words of EVT 3.0, wherever they come from: 16 bits each, which carry only what changed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.files.block import Block

__all__ = [
    "ADDR_X", "ADDR_Y", "BASE_X", "TIME_HIGH", "TIME_LOW", "UNKNOWN_KINDS", "VECTOR_8", "VECTOR_12", "WORD",
    "Evt3State", "decode_words",
]  # fmt: skip

ADDR_Y, ADDR_X, BASE_X, VECTOR_12, VECTOR_8, TIME_LOW, TIME_HIGH = 0x0, 0x2, 0x3, 0x4, 0x5, 0x6, 0x8
"""Kinds of words, bits 15–12."""
UNKNOWN_KINDS = np.zeros(16, np.bool_)
UNKNOWN_KINDS[[0x1, 0x9, 0xB, 0xC]] = True
_LOOP_US = 1 << 24
_LOOP_STEPS = 4095 - 10
"""A time that falls by nearly the whole range has wrapped; a smaller fall is disorder (OpenEB's decoder)."""
_MAX_COLUMN = 1 << 24
WORD = np.dtype("<u2")

_SET = ((np.arange(4096)[:, None] >> np.arange(12)) & 1).astype(np.bool_)
_BITS = np.nonzero(_SET)[1]
_FIRST = np.concatenate([[0], np.cumsum(_SET.sum(axis=1))[:-1]])
"""The bits set in mask ``m`` are ``_BITS[_FIRST[m] :]``, rising, as many as ``_COUNT`` says for its word."""
_COUNT = np.zeros(1 << 16, np.uint8)
_COUNT[0x2000:0x3000] = 1
_COUNT[0x4000:0x5000] = _SET.sum(axis=1)
_COUNT[0x5000:0x6000] = np.tile(_SET[:256].sum(axis=1), 16)
"""Events in each of the 65536 words."""

_Words = NDArray[np.uint16]
_Kinds = NDArray[np.uint8]
_Index = NDArray[np.int64]


@dataclass(slots=True)
class Evt3State:
    """What earlier words left behind; −1 where none of the kind has come yet."""

    time_us: int = -1
    high: int = 0
    loops: int = 0
    y: int = -1
    column: int = -1
    polarity: int = 0


def decode_words(piece: _Words, kind: _Kinds, state: Evt3State, offset: int = 0) -> tuple[Block, int]:
    """Decode words [n] and bring ``state`` up to date; return the events and how many had no time, row or base."""
    count = _COUNT[piece]
    rows = np.flatnonzero(kind == ADDR_Y)
    vectors = np.flatnonzero((kind == VECTOR_12) | (kind == VECTOR_8))
    known = _first_known(piece, kind, rows, state)
    left_out = int(count[:known].sum())
    count[:known] = 0
    y = _held(state.y, piece[rows] & 0x7FF, rows, len(piece), np.dtype(np.uint16))
    time_us = _times(piece, kind, state)
    columns, polarities = _bases(piece, kind, vectors, state)
    baseless = vectors[columns < 0]
    left_out += int(count[baseless].sum())
    count[baseless] = 0
    if len(rows):
        state.y = int(piece[rows[-1]] & 0x7FF)

    word = np.flatnonzero(count)
    if len(vectors):
        word = np.repeat(word, count[word])
    event = piece[word]
    x, p = event & 0x7FF, ((event >> 11) & 1).astype(np.uint8)
    if len(vectors):
        place = np.flatnonzero(event >= VECTOR_12 << 12)
        each = count[vectors].astype(np.int64)
        vector = np.repeat(np.arange(len(vectors)), each)
        rank = np.arange(len(vector)) - np.repeat(np.cumsum(each) - each, each)
        mask = np.where(kind[vectors] == VECTOR_8, piece[vectors] & 0xFF, piece[vectors] & 0xFFF)
        x = x.astype(np.int32)
        x[place] = columns[vector] + _BITS[_FIRST[mask[vector]] + rank]
        p[place] = polarities[vector]
    return Block(time_us[word], x, y[word], p, lambda row: f"byte {offset + 2 * int(word[row])}"), left_out


def _first_known(piece: _Words, kind: _Kinds, rows: _Index, state: Evt3State) -> int:
    """Return the first word at which both time and row are known."""
    known = 0
    if state.time_us < 0:
        high = kind == TIME_HIGH
        known = int(np.argmax(high)) if high.any() else len(piece)
    if state.y < 0:
        known = max(known, int(rows[0]) if len(rows) else len(piece))
    return known


def _held(carried: int, values: NDArray[Any], places: _Index, length: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Hold each value from its place to the next, and ``carried`` before the first; [length]."""
    held = np.empty(len(values) + 1, dtype)
    held[0], held[1:] = max(carried, 0), values
    return np.repeat(held, np.diff(np.concatenate([[0], places, [length]])))


def _times(piece: _Words, kind: _Kinds, state: Evt3State) -> _Index:
    """Return the time at each word in µs, and follow the wraps."""
    places = np.flatnonzero((kind == TIME_HIGH) | (kind == TIME_LOW))
    values = (piece[places] & 0xFFF).astype(np.int64)
    is_high = kind[places] == TIME_HIGH
    highs = np.concatenate([[state.high], values[is_high]])
    turns = np.concatenate([[0], np.cumsum(np.diff(highs) <= -_LOOP_STEPS)])
    base_us = (state.loops + turns) * _LOOP_US + (highs << 12)
    times = base_us[np.cumsum(is_high)] + np.where(is_high, 0, values)
    time_us = _held(state.time_us, times, places, len(piece), np.dtype(np.int64))
    if state.time_us >= 0 or is_high.any():
        state.time_us = int(times[-1]) if len(times) else state.time_us
    state.high, state.loops = int(highs[-1]), state.loops + int(turns[-1])
    return time_us


def _bases(piece: _Words, kind: _Kinds, vectors: _Index, state: Evt3State) -> tuple[_Index, _Index]:
    """Return the first column (−1 where no base word has come) and the polarity of each vector word."""
    bases = np.flatnonzero(kind == BASE_X)
    steps = np.where(kind[vectors] == VECTOR_8, 8, 12)
    moved = np.concatenate([[0], np.cumsum(steps)])
    # A vector starts where its base word says, moved on by the vectors in between.
    start = np.concatenate([[0], moved[np.searchsorted(vectors, bases)]])
    column = np.concatenate([[state.column], (piece[bases] & 0x7FF).astype(np.int64)])
    polarity = np.concatenate([[state.polarity], (piece[bases] >> 11) & 1]).astype(np.int64)
    latest = np.searchsorted(bases, vectors)
    # Columns far outside any sensor stay countable, whatever a broken file adds up to.
    columns = np.minimum(column[latest] + moved[:-1] - start[latest], _MAX_COLUMN)
    columns[column[latest] < 0] = -1
    if column[-1] >= 0:
        state.column = min(int(column[-1] + moved[-1] - start[-1]), _MAX_COLUMN)
        state.polarity = int(polarity[-1])
    return columns, polarity[latest]
