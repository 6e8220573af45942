"""Write a recording in chunks: what every format shares."""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import ClassVar, Self

from tiegocancel.events import MAX_SIDE_PX, Events
from tiegocancel.files.sidecar import LabelsWriter, labels_path

__all__ = ["EventWriter"]


class EventWriter(ABC):
    """Write consecutive chunks of one stream; use it as a context manager, or call :meth:`close`.

    ``width`` and ``height`` in px are those of every chunk. With ``labelled`` every chunk carries labels; a format
    that cannot hold them gets them beside it, as ``NAME.labels.npy``. Without it labels are left out. Leaving the
    ``with`` block, also by an exception, finalises what was written; an exception before the first event leaves no
    file. What a killed process leaves is said by each format. ``count`` is the number of events written.

    ``holds_labels`` and ``holds_size`` say whether the format has a place for labels and for the sensor's size.
    A format implements :meth:`_begin`, :meth:`_append` and :meth:`_finish`.
    """

    format: ClassVar[str]
    holds_labels: ClassVar[bool]
    holds_size: ClassVar[bool]

    def __init__(self, path: Path, *, width: int, height: int, labelled: bool = False) -> None:
        for name, side in (("width", width), ("height", height)):
            if not 1 <= side <= MAX_SIDE_PX:
                raise ValueError(f"{name} must be from 1 to {MAX_SIDE_PX} px, not {side}")
        self.path = path
        self.width = width
        self.height = height
        self.labelled = labelled
        self.count = 0
        self._last_us: int | None = None
        self._closed = False
        self._begin()
        # Labels of a recording that is being replaced would be taken for those of the new one.
        labels_path(path).unlink(missing_ok=True)
        self._beside = LabelsWriter(labels_path(path)) if labelled and not self.holds_labels else None

    @abstractmethod
    def _begin(self) -> None:
        """Refuse what the format cannot hold, then create the file."""

    @abstractmethod
    def _append(self, events: Events) -> None:
        """Append a chunk that was checked."""

    @abstractmethod
    def _finish(self) -> None:
        """Finalise and close the file."""

    def _abandon(self) -> None:
        """Close the file and remove it."""
        with suppress(OSError):
            self._finish()
        # What is no regular file, such as /dev/null, was not created here.
        if self.path.is_file():
            self.path.unlink()

    @property
    def notes(self) -> list[str]:
        """What a user of the file must be told."""
        if self.holds_size:
            return []
        return [f"{self.format} holds no sensor size: pass --width {self.width} --height {self.height} when reading it"]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None and not self.count and not self._closed:
            self._closed = True
            if self._beside is not None:
                self._beside.close()
                labels_path(self.path).unlink(missing_ok=True)
            self._abandon()
        self.close()

    def write(self, events: Events) -> None:
        """Append a chunk; its size must be the writer's and its time must not decrease (``ValueError``)."""
        if self._closed:
            raise ValueError(f"{self.path} is closed")
        if (events.width, events.height) != (self.width, self.height):
            raise ValueError(
                f"chunks must come from a sensor of {self.width}x{self.height} px, not {events.width}x{events.height}"
            )
        if self.labelled and events.label is None:
            raise ValueError("a labelled recording needs labels in every chunk")
        if not len(events):
            return
        if self._last_us is not None and events.t[0] < self._last_us:
            raise ValueError(f"t must not decrease across chunks: {events.t[0]} µs after {self._last_us} µs")
        self._append(events)
        if self._beside is not None and events.label is not None:
            self._beside.write(events.label)
        self.count += len(events)
        self._last_us = int(events.t[-1])

    def close(self) -> None:
        """Finalise the file; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        if self._beside is not None:
            self._beside.close()
        self._finish()
