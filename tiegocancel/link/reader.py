"""Read a line in a thread of its own: bytes in, decoded events into a bounded queue. It never touches Taichi."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

from tiegocancel.errors import LinkError, TiegoCancelError
from tiegocancel.link.event_queue import Arrival, EventQueue
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.opening import AnyLine
from tiegocancel.link.protocols.protocol import Decoder, Host

__all__ = ["LinkReader"]

_READ_BYTES = 1 << 16
_POLL_S = 0.02
_GATHER_S = 0.001
"""Bytes that come one by one are gathered for so long: a call of a decoder costs as much for one event as for fifty."""
_FIRST_WAIT_S, _LONGEST_WAIT_S = 0.05, 1.0


class LinkReader(threading.Thread):
    """Open a line, start the device, decode until told to stop, and stop the device.

    ``fault`` is the line of the error that ended it, ``None`` for a clean end; ``banner`` what the device called
    itself; ``reconnects`` how often the line came back; ``overruns``: bytes that the serial driver lost. After a fault
    of the line it is opened anew (see :class:`LineOptions`) and the device started again; the decoder stays, so time
    goes on.
    """

    def __init__(
        self,
        opener: Callable[[], AnyLine],
        *,
        port: str,
        decoder: Decoder,
        host: Host,
        queue: EventQueue,
        options: LineOptions,
    ) -> None:
        super().__init__(name="link reader", daemon=True)
        self._port = port
        self._open, self._decoder, self._host, self._queue, self._options = opener, decoder, host, queue, options
        self._stop_wanted = threading.Event()
        self.fault: str | None = None
        self.banner = ""
        self.reconnects = self.overruns = 0
        self.notes: list[str] = []
        self.started = threading.Event()

    def run(self) -> None:
        """Serve the line until the end; every way out closes line and queue."""
        try:
            self._serve()
        except TiegoCancelError as error:
            self.fault = str(error)
        except Exception as error:  # a thread that dies silently would look like a silent device
            self.fault = f"the link reader failed: {type(error).__name__}: {error}"
        finally:
            self.started.set()
            self._queue.close()

    def stop(self) -> None:
        """Ask for the end: the device is stopped, the line and then the queue are closed; this does not wait."""
        self._stop_wanted.set()

    def _serve(self) -> None:
        """Open and pump, again after each fault of the line that mends in time."""
        while not self._stop_wanted.is_set():
            line = self._connect()
            if line is None:
                return
            try:
                self._pump(line)
                return
            except LinkError as error:
                if not self._options.reconnect_s:
                    raise
                self.notes.append(f"{error}; opening it again")
                self.reconnects += 1
            finally:
                self.overruns += line.overruns()
                line.close()

    def _connect(self) -> AnyLine | None:
        """Open the line and start the device; on a line that was lost, again and again with waits that double."""
        deadline_s = time.monotonic() + self._options.reconnect_s
        wait_s = _FIRST_WAIT_S
        while not self._stop_wanted.is_set():
            line: AnyLine | None = None
            try:
                line = self._open()
                if line.answers:
                    self.banner = self._host.start(line) or self.banner
                self.started.set()
                return line
            except LinkError as fault:
                error = fault if fault.port else LinkError(self._port, fault.problem)
                if line is not None:
                    line.close()
                if not self.started.is_set():
                    raise error from None
                if time.monotonic() > deadline_s:
                    raise LinkError("", f"{error}, for {self._options.reconnect_s:g} s on") from None
            self._stop_wanted.wait(wait_s)
            wait_s = min(2 * wait_s, _LONGEST_WAIT_S)
        return None

    def _pump(self, line: AnyLine) -> None:
        """Read, decode, hand on; return at the end of a file, on a wish to stop; raise for a fault or long silence."""
        last_s = time.monotonic()
        unsettled = False
        hold_s = self._queue.options.hold_s
        while not self._stop_wanted.is_set():
            data = line.read(_READ_BYTES, min(max(hold_s, 0.001), _POLL_S) if unsettled else _POLL_S)
            arrived_s = time.perf_counter()
            if data:
                last_s, unsettled = time.monotonic(), True
                if len(data) < _READ_BYTES // 32:
                    time.sleep(_GATHER_S)
                    data += line.read(_READ_BYTES, 0.0)
                if not self._hand_on(data, arrived_s):
                    break
                continue
            if unsettled or line.ended:
                unsettled = False
                self._settle(arrived_s)
            if line.ended:
                return
            if self._options.silence_s and time.monotonic() - last_s > self._options.silence_s:
                raise TiegoCancelError(f"{line.port}: no byte for {self._options.silence_s:g} s")
        if line.answers:
            with contextlib.suppress(LinkError):
                self._host.stop(line)
        self._settle(time.perf_counter())

    def _hand_on(self, data: bytes, arrived_s: float) -> bool:
        """Decode bytes into the queue; return ``False`` when that was closed."""
        events = self._decoder.feed(data)
        lines = self._decoder.take_lines()
        return self._queue.put(Arrival(events, lines, arrived_s)) if len(events) or lines else True

    def _settle(self, arrived_s: float) -> None:
        """Hand on what the decoder held back."""
        events = self._decoder.settle()
        lines = self._decoder.take_lines()
        if len(events) or lines:
            self._queue.put(Arrival(events, lines, arrived_s))
