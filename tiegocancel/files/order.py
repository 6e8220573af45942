"""Put a slightly unsorted stream in order, in bounded memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.files.block import Block

__all__ = ["ReorderWindow"]


class ReorderWindow:
    """Hold back one chunk of rows, so that a row which comes at most so much too late still finds its place.

    Rows leave in stable order of time, in chunks of exactly ``chunk_events`` until the last. At most three
    chunks and one block are held. ``late`` counts the rows whose time is below the largest time before them.
    """

    def __init__(self, chunk_events: int) -> None:
        self._chunk = chunk_events
        self._pending: list[Block] = []
        self._count = 0
        self._largest_us: int | None = None
        self._floor_us: int | None = None
        self._in_order = True
        self.late = 0

    def push(self, block: Block) -> int | None:
        """Take rows in; return the first row that is older than rows which already left, and take only those before."""
        too_late: int | None = None
        if len(block) and self._floor_us is not None and int(block.t.min()) < self._floor_us:
            too_late = int(np.argmax(block.t < self._floor_us))
            block = block.head(too_late)
        if not len(block):
            return too_late
        times = block.t
        start = int(times[0]) if self._largest_us is None else self._largest_us
        if times[0] < start or bool((times[1:] < times[:-1]).any()):
            before = np.maximum(np.maximum.accumulate(times), start)
            self.late += int(np.count_nonzero(times < before))
            self._in_order = False
        self._largest_us = max(start, int(times.max()))
        self._pending.append(block)
        self._count += len(block)
        return too_late

    def ready(self) -> list[Block]:
        """Return the chunks that may leave now."""
        if self._count < 2 * self._chunk:
            return []
        return self._leave((self._count // self._chunk - 1) * self._chunk)

    def rest(self) -> list[Block]:
        """Return everything that is held, at the end of the stream."""
        return self._leave(self._count)

    def _leave(self, count: int) -> list[Block]:
        """Sort what is held and cut ``count`` rows from its front."""
        if not count:
            return []
        held = _joined(self._pending)
        if not self._in_order:
            held = _taken(held, np.argsort(held.t, kind="stable"))
            self._in_order = True
        chunks = [_cut(held, at, min(at + self._chunk, count)) for at in range(0, count, self._chunk)]
        self._floor_us = int(held.t[count - 1])
        left = _cut(held, count, len(held))
        self._pending, self._count = ([left] if len(left) else []), len(left)
        return chunks


def _joined(blocks: list[Block]) -> Block:
    """Join blocks in their order."""
    if len(blocks) == 1:
        return blocks[0]
    labels = [block.label for block in blocks if block.label is not None]
    return Block(
        np.concatenate([block.t for block in blocks]),
        np.concatenate([block.x for block in blocks]),
        np.concatenate([block.y for block in blocks]),
        np.concatenate([block.p for block in blocks]),
        blocks[0].where,
        np.concatenate(labels) if len(labels) == len(blocks) else None,
    )


def _taken(block: Block, rows: NDArray[np.int64]) -> Block:
    """Pick rows by index."""
    label = None if block.label is None else block.label[rows]
    return Block(block.t[rows], block.x[rows], block.y[rows], block.p[rows], block.where, label)


def _cut(block: Block, start: int, stop: int) -> Block:
    """Slice rows without copying."""
    label = None if block.label is None else block.label[start:stop]
    return Block(block.t[start:stop], block.x[start:stop], block.y[start:stop], block.p[start:stop], block.where, label)
