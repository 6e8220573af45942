"""Pack events into the payloads of EVENTS frames and unpack many of them at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["LEAST_BYTES", "MOST_EVENTS", "STEP_BITS", "Columns", "bits_of", "pack", "unpack"]

MOST_EVENTS = 128
STEP_BITS = 20
"""A step of 2^20 ticks or more begins a new frame."""
LEAST_BYTES = 9
_PADDING = 64
"""More than all flags of a frame, so that those of a short last one are read from somewhere."""
_HEAD = np.dtype([("first", "<u2"), ("ticks", "<u4"), ("count", "u1"), ("form", "<u2")])
_PLACE_WIDTHS = 13
_ABSOLUTE = 15
_LOW = (np.uint64(1) << np.arange(64, dtype=np.uint64)) - np.uint64(1)
"""Masks of the lowest bits, by their number."""
_Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Events [n] in ticks and pixels; ``frame`` [n] numbers the frames from 0, rising."""

    ticks: _Ints
    x: _Ints
    y: _Ints
    p: NDArray[Any]
    frame: _Ints


def bits_of(side_px: int) -> int:
    """Return how many bits a coordinate of a sensor with that side takes."""
    return max(int(side_px - 1).bit_length(), 1)


def pack(columns: Columns, first: int, width: int, height: int) -> list[bytes]:
    """Return the payload of each frame; ``first`` is the index in the stream of the first event.

    Every frame has at most ``MOST_EVENTS`` events, whose times never decrease by less than 2^20 ticks a step. For each
    frame and column the shortest of all forms is taken.
    """
    frame = columns.frame
    starts = np.flatnonzero(np.diff(frame, prepend=-1))
    count = np.diff(np.append(starts, len(frame)))
    # Each column steps from the event before; the first of a frame from time 0, place (0, 0).
    steps = _steps(columns.ticks, starts)
    steps[starts] = 0
    t = _Column(steps, steps, STEP_BITS, frame, count, mixed=np.arange(STEP_BITS), plain=np.arange(STEP_BITS + 1))
    x, y = (
        _Column(
            _zigzag(_steps(values, starts)), values, bits_of(side), frame, count,
            mixed=np.arange(_PLACE_WIDTHS), plain=np.arange(_ABSOLUTE),
        )
        for values, side in ((columns.x, width), (columns.y, height))
    )  # fmt: skip
    record = columns.p | x.value << 1 | y.value << (1 + x.bits) | t.value << (1 + x.bits + y.bits)
    bits = 1 + x.bits + y.bits + t.bits
    flags = t.mixed.astype(np.int64) + x.mixed + y.mixed
    size = _HEAD.itemsize + (flags * count + np.add.reduceat(bits, starts) + 7) // 8
    begin = np.concatenate([[0], np.cumsum(size)])
    behind = np.cumsum(bits) - bits
    behind -= np.repeat(behind[starts], count)
    at = np.repeat(8 * (begin[:-1] + _HEAD.itemsize), count)
    out = _scatter(record, at + np.repeat(flags * count, count) + behind, int(begin[-1]))
    row = np.arange(len(frame)) - np.repeat(starts, count)
    plane = np.zeros(8 * len(out), np.uint8)
    ahead = np.zeros(len(count), np.int64)
    for column in (t, x, y):
        has = np.repeat(column.mixed == 1, count)
        plane[(at + np.repeat(ahead, count) + row)[has]] = column.long[has]
        ahead += column.mixed * count
    out |= np.packbits(plane, bitorder="little")
    head = np.empty(len(count), _HEAD)
    head["first"], head["ticks"], head["count"] = (first + starts) & 0xFFFF, columns.ticks[starts] & 0xFFFFFFFF, count
    head["form"] = t.width | t.mixed << 5 | x.width << 6 | x.mixed << 10 | y.width << 11 | y.mixed << 15
    out[(begin[:-1, None] + np.arange(_HEAD.itemsize)).reshape(-1)] = head.view(np.uint8)
    whole = out.tobytes()
    return [whole[a:b] for a, b in zip(begin[:-1].tolist(), begin[1:].tolist(), strict=True)]


def unpack(payloads: list[bytes], base_ticks: _Ints, width: int, height: int) -> Columns | None:
    """Return the events of frames whose first times, unwrapped, are ``base_ticks``; ``None`` where one is not sound."""
    data = np.frombuffer(b"".join([*payloads, bytes(_PADDING)]), np.uint8)
    size = np.array([len(payload) for payload in payloads])
    begin = np.cumsum(size) - size
    head = data[begin[:, None] + np.arange(_HEAD.itemsize)].reshape(-1).view(_HEAD)
    count, form = head["count"].astype(np.int64), head["form"]
    starts = np.cumsum(count) - count
    row = np.arange(int(count.sum())) - np.repeat(starts, count)
    fields = ((0, 31, 5, STEP_BITS), (6, 15, 10, bits_of(width)), (11, 15, 15, bits_of(height)))
    ahead = 8 * (begin + _HEAD.itemsize)
    longs, widths = [], []
    for shift, mask, flag, full in fields:
        short, mixed = (form >> shift & mask).astype(np.uint8), (form >> flag & 1).astype(np.uint8)
        absolute = short == _ABSOLUTE if mask == _ABSOLUTE else np.zeros(len(short), np.bool_)
        long = np.repeat(absolute, count)
        if mixed.any():
            # What would be read behind the frame is not used, and never behind the padding.
            at = np.repeat(ahead, count) + row
            long |= (data[at >> 3] >> (at & 7).astype(np.uint8) & np.repeat(mixed, count)).astype(np.bool_)
            ahead = ahead + mixed * count
        longs.append(long)
        widths.append(np.where(long, np.uint8(full), np.repeat(short, count)))
    bits = widths[0] + widths[1] + widths[2] + np.uint8(1)
    behind = np.cumsum(bits, dtype=np.int64) - bits
    # Records follow each other: a frame is whole when its last one is.
    if (count == 0).any() or int(bits.max()) > 57:
        return None
    at = np.repeat(ahead - behind[starts], count) + behind
    ends = np.append(starts[1:], len(row)) - 1
    if (at[ends] + bits[ends] > 8 * (begin + size)).any():
        return None
    # Eight bytes from any byte on: a record of up to 57 bits lies in them whole.
    eight = np.ndarray((len(data) - 7,), "<u8", data, strides=(1,))
    record = eight[at >> 3] >> (at & 7).astype(np.uint64)
    p = (record & np.uint64(1)).astype(np.uint8)
    record >>= np.uint64(1)
    x, y = (
        _held((record >> ahead_bits & _LOW[width]).astype(np.int64), long, starts)
        for ahead_bits, width, long in (
            (np.uint64(0), widths[1], longs[1]),
            (widths[1].astype(np.uint64), widths[2], longs[2]),
        )
    )
    steps = (record >> (widths[1] + widths[2]).astype(np.uint64) & _LOW[widths[0]]).astype(np.int64)
    elapsed = np.cumsum(steps)
    ticks = np.repeat(base_ticks - (elapsed - steps)[starts], count) + elapsed
    return Columns(ticks, x, y, p, np.repeat(np.arange(len(size)), count))


class _Column:
    """Choose the shortest form of a column in each frame, and the value and bits of each event in it.

    ``short`` [n] are the steps as unsigned numbers, ``whole`` [n] what stands for them in ``full_bits`` where they are
    too long.
    """

    def __init__(
        self, short: _Ints, whole: _Ints, full_bits: int, frame: _Ints, count: _Ints,
        *, mixed: NDArray[np.int64], plain: NDArray[np.int64],
    ) -> None:  # fmt: skip
        need = np.frexp(short.astype(np.float64))[1].astype(np.int64)
        frames = len(count)
        fitting = np.bincount(frame * 33 + need, minlength=frames * 33).reshape(frames, 33).cumsum(axis=1)
        many = count[:, None]
        costs_mixed = many + mixed * fitting[:, mixed] + full_bits * (many - fitting[:, mixed])
        costs_plain = np.where(fitting[:, plain] == many, plain * many, np.iinfo(np.int64).max)
        # Places may also stand as they are in the whole frame; a step always fits its full width.
        absolute = full_bits * count if len(plain) == _ABSOLUTE else np.full(frames, np.iinfo(np.int64).max)
        best = np.argmin(np.concatenate([costs_plain, costs_mixed, absolute[:, None]], axis=1), axis=1)
        self.mixed = (best >= len(plain)) & (best < len(plain) + len(mixed))
        self.width = np.where(self.mixed, best - len(plain), np.minimum(best, _ABSOLUTE if len(plain) == 15 else best))
        width: _Ints = self.width[frame]
        self.long = np.where(self.mixed[frame], need > width, (best == len(plain) + len(mixed))[frame])
        self.value = np.where(self.long, whole, short)
        self.bits = np.where(self.long, full_bits, width)
        self.mixed = self.mixed.astype(np.int64)

    mixed: Any


def _steps(values: _Ints, starts: _Ints) -> _Ints:
    steps = np.diff(values, prepend=0)
    steps[starts] = values[starts]
    return steps


def _zigzag(steps: _Ints) -> _Ints:
    """Return 0, 1, 2, 3, … for steps 0, −1, 1, −2, …."""
    return steps << 1 ^ steps >> 63


def _held(value: _Ints, long: NDArray[np.bool_], starts: _Ints) -> _Ints:
    """Add up steps from the last whole value, or from 0 at the start of a frame."""
    if long.all():
        return value
    steps = value >> 1 ^ -(value & 1)
    steps[long] = 0
    total = np.cumsum(steps)
    # From each anchor on the sum goes on from what stands there.
    anchored = long.copy()
    anchored[starts] = True
    anchors = np.flatnonzero(anchored)
    origin = np.where(long[anchors], value[anchors], steps[anchors]) - total[anchors]
    held: _Ints = total + np.repeat(origin, np.diff(np.append(anchors, len(value))))
    return held


def _scatter(record: _Ints, at: _Ints, size: int) -> NDArray[np.uint8]:
    """Write each record at its bit, lowest bit first, records in order; return bytes [size]."""
    words = np.zeros(size // 8 + 2, np.uint64)
    word, shift = at >> 6, (at & 63).astype(np.uint64)
    value = record.astype(np.uint64)
    first = np.flatnonzero(np.diff(word, prepend=-1))
    words[word[first]] = np.bitwise_or.reduceat(value << shift, first)
    beyond = np.flatnonzero(shift)
    words[word[beyond] + 1] |= value[beyond] >> (np.uint64(64) - shift[beyond])
    return words.view(np.uint8)[:size].copy()
