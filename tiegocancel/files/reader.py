"""Read a recording in chunks: what every format shares once its bytes are decoded."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator, Iterator
from pathlib import Path
from types import TracebackType
from typing import ClassVar, Self

import numpy as np

from tiegocancel.errors import InputError
from tiegocancel.events import MAX_SIDE_PX, Events
from tiegocancel.files.block import Block
from tiegocancel.files.options import ReadOptions
from tiegocancel.files.order import ReorderWindow
from tiegocancel.files.short import short
from tiegocancel.files.sidecar import Labels, labels_beside

__all__ = ["EventReader"]


class EventReader(ABC):
    """Iterate over the events of a file in chunks of ``chunk_events``, time never decreasing, also across chunks.

    After opening, ``width`` and ``height`` (px), ``time_unit`` (the unit that the file has) and ``labelled`` are
    known; ``notes`` holds everything a user must be told and grows while iterating; ``faults`` counts what was
    broken and passed over. A fault raises :class:`InputError` after the events before it were yielded; with
    ``keep_going`` it becomes a note and the iteration ends. Each iteration starts again from the first event.

    A format implements :meth:`_open` (read the header, declare size and unit) and :meth:`_blocks` (decode).
    """

    format: ClassVar[str]

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self.path = path
        self.options = options
        self.notes: list[str] = []
        self.faults = 0
        self.labelled = False
        self.time_unit = "us"
        self._size_of_file: tuple[int, int] | None = None
        self._labels: Labels | None = None
        self._running: list[Generator[Events, None, None]] = []
        self._open()
        if options.time_unit not in (None, self.time_unit):
            self.note(
                f"time unit: {self.time_unit}, as {self.format} has it; {options.time_unit} as declared is not used"
            )
        if not any(note.startswith("time unit") for note in self.notes):
            self.note(f"time unit: {self.time_unit}, as {self.format} has it")
        beside = None if self.labelled else labels_beside(path)
        width, height = self._declared_size()
        if width is None or height is None or beside is not None:
            width, height = self._scan(width, height, beside)
        self.width: int = width
        self.height: int = height

    @abstractmethod
    def _open(self) -> None:
        """Read the header: set ``time_unit``, ``labelled`` and the size where the file says it."""

    @abstractmethod
    def _blocks(self) -> Iterator[Block]:
        """Decode from the first event on; yield what came before a fault, then raise :class:`InputError`."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End iterations that are under way and close their files."""
        for chunks in self._running:
            chunks.close()
        self._running.clear()

    def __iter__(self) -> Iterator[Events]:
        chunks = self._chunks()
        self._running.append(chunks)
        return chunks

    def read(self) -> Events:
        """Return all events at once; a file that is unsorted over any distance is stably sorted."""
        self.faults, fault = 0, None
        blocks: list[Block] = []
        try:
            blocks.extend(self._checked_blocks())
        except InputError as error:
            fault = error
        if fault is not None and not self.options.keep_going:
            raise fault
        if not blocks:
            events, late = Events.empty(self.width, self.height, labelled=self.labelled), 0
        else:
            columns = [np.concatenate([getattr(block, name) for block in blocks]) for name in ("t", "x", "y", "p")]
            labels = [block.label for block in blocks if block.label is not None]
            label = np.concatenate(labels) if self.labelled else None
            t, x, y, p = columns
            events, late = Events.from_unsorted(t, x, y, p, self.width, self.height, label)
        self._close_books(late, fault, len(events))
        return events

    def note(self, text: str) -> None:
        """Tell the user something, once."""
        if text not in self.notes:
            self.notes.append(text)

    def fail(self, where: str, problem: str) -> InputError:
        """Return the error for a fault at ``where``."""
        return InputError(self.path, where, problem)

    def _chunks(self) -> Generator[Events, None, None]:
        """Decode, check, put in order and cut into chunks."""
        window = ReorderWindow(self.options.chunk_events)
        self.faults, fault, kept = 0, None, 0
        try:
            for block in self._checked_blocks():
                too_late = window.push(block)
                for chunk in window.ready():
                    kept += len(chunk)
                    yield self._events(chunk)
                if too_late is not None:
                    raise self._too_late(block, too_late)
        except InputError as error:
            fault = error
        for chunk in window.rest():
            kept += len(chunk)
            yield self._events(chunk)
        self._close_books(window.late, fault, kept)
        if fault is not None and not self.options.keep_going:
            raise fault

    def _checked_blocks(self) -> Iterator[Block]:
        """Attach labels and stop at the first row that the sensor cannot have sent."""
        row = 0
        for block in self._readable_blocks():
            if self._labels is not None:
                block = block.labelled(self._labels.rows(row, row + len(block)))
            row += len(block)
            fault = block.first_fault(self.width, self.height)
            yield block if fault is None else block.head(fault[0])
            if fault is not None:
                raise self.fail(block.where(fault[0]), fault[1])

    def _readable_blocks(self) -> Iterator[Block]:
        """Turn what the file system answers into a clear line."""
        try:
            yield from self._blocks()
        except OSError as error:
            raise self.fail("", f"cannot be read to its end: {error.strerror or error}") from None

    def _declared_size(self) -> tuple[int | None, int | None]:
        """Return the sensor's size as the user or else the file says it."""
        width, height = self.options.width, self.options.height
        if self._size_of_file is not None:
            known = self._size_of_file
            for name, side in (("width", known[0]), ("height", known[1])):
                if not 1 <= side <= MAX_SIDE_PX:
                    raise self.fail("header", f"{name} is {short(side)}, expected 1 to {MAX_SIDE_PX} px")
            width, height = width or known[0], height or known[1]
            if (width, height) != known:
                self.note(f"sensor size {width}x{height} as declared, although the file says {known[0]}x{known[1]}")
        return width, height

    def _scan(self, width: int | None, height: int | None, beside: Labels | None) -> tuple[int, int]:
        """Read the file once for the largest coordinates and the number of events."""
        count, largest_x, largest_y = 0, -1, -1
        fault: InputError | None = None
        try:
            for block in self._readable_blocks():
                count += len(block)
                if len(block):
                    largest_x, largest_y = max(largest_x, int(block.x.max())), max(largest_y, int(block.y.max()))
        except InputError as error:
            fault = error
        if beside is not None:
            self._adopt(beside, count, complete=fault is None)
        if width is not None and height is not None:
            return width, height
        if largest_x < 0 or largest_y < 0:
            raise fault or self.fail("", "holds no events to derive the sensor size from: give --width and --height")
        if max(largest_x, largest_y) >= MAX_SIDE_PX:
            raise self.fail("", f"a coordinate is {max(largest_x, largest_y)}, expected at most {MAX_SIDE_PX - 1}")
        size = (width or largest_x + 1, height or largest_y + 1)
        self.note(f"sensor size derived from the largest coordinate: {size[0]}x{size[1]}")
        return size

    def _adopt(self, beside: Labels, count: int, *, complete: bool) -> None:
        """Take the labels that lie beside the file if they belong to it."""
        if len(beside) == count or (not complete and len(beside) > count):
            self._labels, self.labelled = beside, True
            self.note(f"labels taken from {beside.path.name}")
        else:
            self.note(f"labels in {beside.path.name} ignored: {len(beside)} labels for {count} events")

    def _events(self, block: Block) -> Events:
        return Events(block.t, block.x, block.y, block.p, self.width, self.height, block.label)

    def _too_late(self, block: Block, row: int) -> InputError:
        return self.fail(
            block.where(row),
            f"time {int(block.t[row])} µs lies more than {self.options.chunk_events} events back in an unsorted file: "
            "'tiegocancel convert IN OUT --sort' reads it whole and sorts it",
        )

    def _close_books(self, late: int, fault: InputError | None, kept: int) -> None:
        """Note at the end of a pass what was sorted and what was lost."""
        if late:
            self.note(f"{late} events out of order, sorted by time")
        if fault is not None and self.options.keep_going:
            self.faults += 1
            self.note(f"stopped at {fault.where or 'a fault'}: {fault.problem}; kept {kept} events (--keep-going)")
