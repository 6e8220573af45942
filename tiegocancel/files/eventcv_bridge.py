"""Read formats through the package eventcv (the extra ``files``), on terms that leave it nothing to guess."""

from __future__ import annotations

import os
import tempfile
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from tiegocancel.errors import InputError, MissingExtraError
from tiegocancel.events import MAX_SIDE_PX
from tiegocancel.files.block import Block, place_namer
from tiegocancel.files.reader import EventReader
from tiegocancel.files.values import RowMaker

__all__ = ["EventcvReader"]

_BLOCK_ROWS = 1 << 18
_NO_LIMIT = (MAX_SIDE_PX, MAX_SIDE_PX)
"""The size passed on: eventcv drops events outside it without a word, and here they are faults."""


class EventcvReader(EventReader):
    """Decode with eventcv: time unit and sensor size are passed to it, and what it raises becomes one line.

    eventcv tells a format by its suffix, so a file of another name is shown to it under a link. HDF5 is read a
    block at a time; AEDAT4 and ROS bags it holds in memory whole.
    """

    suffix: ClassVar[str]
    eventcv_unit: ClassVar[dict[str, str]] = {
        "s": "seconds",
        "ms": "milliseconds",
        "us": "microseconds",
        "ns": "nanoseconds",
    }

    def _open(self) -> None:
        try:
            import eventcv
        except ImportError:
            raise MissingExtraError(f"reading {self.format.upper()} ({self.path})", "eventcv", "files") from None
        self._eventcv = eventcv
        self._fault_at_end: InputError | None = None
        self._arguments: dict[str, Any] = {}
        self._prepare()
        with self._one_line(), self._named() as path:
            self._size_of_file = tuple(eventcv.open(path, **self._arguments).sensor_size)

    @abstractmethod
    def _prepare(self) -> None:
        """Set ``time_unit``, the arguments for eventcv and the fault that is met after the last event."""

    def _blocks(self) -> Iterator[Block]:
        maker = RowMaker(self.path, "us")
        with self._named() as path:
            with self._one_line():
                recording = self._eventcv.open(path, **self._arguments | {"sensor_size": _NO_LIMIT})
                count = int(recording.n_events)
            for start in range(0, count, _BLOCK_ROWS):
                stop = min(start + _BLOCK_ROWS, count)
                with self._one_line():
                    rows = np.asarray(recording.slice_count(start, stop).numpy())
                if rows.shape != (stop - start, 4):
                    raise self.fail(f"row {start}", f"eventcv gave {len(rows)} of {stop - start} events")
                x, y, t, p = rows.T
                block, fault = maker.block(t, x, y, p, place_namer("row", range(start, stop)))
                yield block
                if fault is not None:
                    raise fault
        if self._fault_at_end is not None:
            raise self._fault_at_end

    @contextmanager
    def _named(self) -> Iterator[str]:
        """Yield a path to the file that ends in the suffix eventcv expects."""
        if self.path.suffix.lower() == self.suffix:
            yield str(self.path)
            return
        with tempfile.TemporaryDirectory() as folder:
            link = Path(folder) / f"recording{self.suffix}"
            link.symlink_to(self.path.resolve())
            yield str(link)

    @contextmanager
    def _one_line(self) -> Iterator[None]:
        """Turn what eventcv raises, a panic of its native code included, into one clear line."""
        try:
            with _quiet_native_code():
                yield
        except (KeyboardInterrupt, SystemExit, MemoryError, InputError):
            raise
        except BaseException as error:
            # A panic derives from BaseException, so that nobody catches it unawares; here it is meant.
            reason = " ".join(str(error).split()) or type(error).__name__
            raise self.fail("", f"eventcv cannot read it: {reason[:300]}") from None


@contextmanager
def _quiet_native_code() -> Iterator[None]:
    """Send to nowhere what native code writes on the error stream: a panic prints its stack there."""
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(nowhere)
        os.close(kept)
