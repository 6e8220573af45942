"""Send events onward over a second line while the first is read: encode, queue, write in a thread of its own."""

from __future__ import annotations

import threading
from types import TracebackType
from typing import Self

from tiegocancel.errors import LinkError, TiegoCancelError
from tiegocancel.events import Events
from tiegocancel.link.opening import AnyLine
from tiegocancel.link.protocols.protocol import Encoder

__all__ = ["Forward"]

_CAPACITY_BYTES = 1 << 20
_CLOSE_S = 10.0


class Forward:
    """Write residual events to a line; use it as a context manager. ``events`` and ``bytes`` count what was taken.

    At most 1 MiB waits. A line that is slower than what comes makes :meth:`write` wait, so that the policy of the
    queue before it decides what gives; one that fails raises its :class:`LinkError` at the next write.
    """

    def __init__(self, line: AnyLine, encoder: Encoder) -> None:
        self._line, self._encoder = line, encoder
        self._waiting = bytearray()
        self._changed = threading.Condition()
        self._ending = False
        self._fault: TiegoCancelError | None = None
        self.events = self.bytes = 0
        self._thread = threading.Thread(target=self._pump, name="link forward", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self._put(self._encoder.begin())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self._fault is None:
                self._put(self._encoder.end())
        finally:
            with self._changed:
                self._ending = True
                self._changed.notify_all()
            self._thread.join(_CLOSE_S)
            self._line.close()
        if self._fault is not None and kind is None:
            raise self._fault

    def write(self, events: Events) -> None:
        """Send a chunk onward."""
        if len(events):
            self._put(self._encoder.encode(events))
            self.events += len(events)

    def _put(self, data: bytes) -> None:
        with self._changed:
            while len(self._waiting) > _CAPACITY_BYTES and self._fault is None:
                self._changed.wait(0.1)
            if self._fault is not None:
                raise self._fault
            self._waiting += data
            self.bytes += len(data)
            self._changed.notify_all()

    def _pump(self) -> None:
        """Write what waits until the end is wished and nothing waits."""
        while True:
            with self._changed:
                while not self._waiting and not self._ending:
                    self._changed.wait(0.5)
                data, self._waiting = bytes(self._waiting), bytearray()
                self._changed.notify_all()
            if not data:
                return
            try:
                self._line.write(data)
            except LinkError as error:
                with self._changed:
                    self._fault = error
                    self._changed.notify_all()
                return
