"""Undo the distortion of the lens while a recording is read: each pixel moves to where a pinhole would show it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import ConfigError, InputError
from tiegocancel.files.block import Block
from tiegocancel.files.reader import EventReader
from tiegocancel.motion.intrinsics import CameraIntrinsics

__all__ = ["pixel_map", "undistorted"]

_MAX_PIXELS = 1 << 24
_BLOCK = 1 << 17


def undistorted(reader: EventReader, intrinsics: CameraIntrinsics, *, source: str = "the calibration") -> EventReader:
    """Return a reader of the same recording on undistorted pixels; ``source`` names the calibration in notes.

    Each event moves to the nearest pixel of a pinhole with the same ``fx fy cx cy`` and the same sensor size. Events
    that leave the sensor are dropped, and a note counts them. The map is from pixel to pixel, as a device would hold it
    in a table, and that has two effects. Where the lens stretches, several raw pixels fall on one: their events all
    arrive there, so that one cell of the canceller serves several pixels, and of two predictions due at once the later
    replaces the earlier (``overwritten`` counts those). Where the lens shrinks, pixels stay empty, which a spatial gate
    of a pixel or more bridges. Raise ``ConfigError`` for a sensor of more than 2^24 px.
    """
    return _UndistortedReader(reader, intrinsics, source)


def pixel_map(intrinsics: CameraIntrinsics, width: int, height: int) -> NDArray[np.int64]:
    """Return for each pixel, row by row, the index ``y·width + x`` of its undistorted one, int64; −1 outside."""
    goal = np.empty(width * height, np.int64)
    for first in range(0, len(goal), _BLOCK):  # a block at a time, for memory
        y, x = np.divmod(np.arange(first, min(first + _BLOCK, len(goal))), width)
        right, down = (np.floor(place + 0.5) for place in intrinsics.undistort(x, y))
        inside = (right >= 0) & (right < width) & (down >= 0) & (down < height)  # false for NaN
        goal[first : first + len(x)] = np.where(inside, np.where(inside, down, 0) * width + right, -1)
    return goal


class _UndistortedReader(EventReader):
    """Map the events of another reader before they are put in order and cut into chunks."""

    format = "undistorted"

    def __init__(self, reader: EventReader, intrinsics: CameraIntrinsics, source: str) -> None:
        # Everything that opening found out is taken over: the file is not opened again.
        object.__setattr__(self, "format", reader.format)
        self.path, self.options, self.notes = reader.path, reader.options, reader.notes
        self.labelled, self.time_unit = reader.labelled, reader.time_unit
        self.width, self.height = reader.width, reader.height
        self.faults = 0
        self._running = []
        self._reader, self._source = reader, source
        if self.width * self.height > _MAX_PIXELS:
            raise ConfigError(f"a sensor of {self.width}x{self.height} px is too large to undistort: at most 2^24 px")
        known = (intrinsics.width or self.width, intrinsics.height or self.height)
        if known != (self.width, self.height):
            self.note(f"{source} is for {known[0]}x{known[1]} px, the recording has {self.width}x{self.height} px")
        self._goal = pixel_map(intrinsics, self.width, self.height)

    def _open(self) -> None:
        """Do nothing: the reader within is open."""

    def _blocks(self) -> Iterator[Block]:
        return self._reader._blocks()

    def close(self) -> None:
        """End iterations that are under way and close the reader within."""
        super().close()
        self._reader.close()

    def _checked_blocks(self) -> Iterator[Block]:
        """Move the events of checked blocks, dropping those that leave the sensor."""
        seen = kept = 0
        try:
            for block in self._reader._checked_blocks():
                moved = self._moved(block)
                seen, kept = seen + len(block), kept + len(moved)
                yield moved
        except InputError:
            self._count(seen, kept)
            raise
        self._count(seen, kept)

    def _moved(self, block: Block) -> Block:
        """Map one block; its places in the file stay known."""
        goal = self._goal[block.y.astype(np.int64) * self.width + block.x]
        rows = np.flatnonzero(goal >= 0)
        y, x = np.divmod(goal[rows], self.width)
        label = None if block.label is None else block.label[rows]
        return Block(block.t[rows], x, y, block.p[rows], lambda row: block.where(int(rows[row])), label)

    def _count(self, seen: int, kept: int) -> None:
        self.note(f"undistorted with {self._source}: {seen - kept} of {seen} events left the sensor and were dropped")
