"""Send events to a device that cancels, and compare its decisions with the golden model's, event by event."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import LinkError
from tiegocancel.events import Events
from tiegocancel.link.latency import Latency
from tiegocancel.link.opening import AnyLine
from tiegocancel.link.protocols.framed.decoder import FramedDecoder
from tiegocancel.link.protocols.framed.encoder import FramedEncoder
from tiegocancel.link.protocols.framed.host import FramedHost
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["DeviceLoop", "Difference"]

_POLL_S = 0.02
_PIECE_EVENTS = 1024


@dataclass(frozen=True, slots=True)
class Difference:
    """The first event, by its ``index`` in the stream, on which device and golden model disagree."""

    index: int
    t_us: int
    x: int
    y: int
    p: int
    device_suppressed: bool

    def text(self) -> str:
        """Say it in a line."""
        device, golden = ("suppressed", "passed on") if self.device_suppressed else ("passed on", "suppressed")
        return (
            f"event {self.index} (t = {self.t_us} µs, x = {self.x}, y = {self.y}, {'ON' if self.p else 'OFF'}): "
            f"the device {device} it, the golden model {golden} it"
        )


class DeviceLoop:
    """Keep a device in the loop over one line; use it as a context manager.

    At most ``window`` events are under way: a device is sent no more until it has decided some. It that decides nothing
    for ``silence_s`` raises :class:`LinkError`. ``compared`` events so far, ``different`` among them, ``first`` the
    first of these; ``latency`` is from sending an event to its decision.
    """

    def __init__(self, line: AnyLine, options: ProtocolOptions, *, window: int = 8192, silence_s: float = 10.0) -> None:
        self._line, self._window, self._silence_s = line, window, silence_s
        self._encoder, self._decoder = FramedEncoder(options), FramedDecoder(options)
        self._host = FramedHost(options)
        self._size = (options.width, options.height)
        self._golden: deque[tuple[Events, NDArray[np.bool_], float]] = deque()
        self._changed = threading.Condition()
        self._ending = False
        self._fault: str | None = None
        self._thread = threading.Thread(target=self._listen, name="device loop", daemon=True)
        self.banner = ""
        self.sent = self.compared = self.different = 0
        self.first: Difference | None = None
        self.latency = Latency()

    def __enter__(self) -> Self:
        try:
            self.banner = self._host.start(self._line)
            hello = self._host.hello
            if hello is None or not hello.decides:
                raise LinkError(self._line.port, "the device does not decide events (its HELLO says so)")
            if (hello.width, hello.height) != self._size:
                raise LinkError(
                    self._line.port,
                    f"the device has {hello.width}×{hello.height} px, the events {self._size[0]}×{self._size[1]} px",
                )
            self._line.write(self._encoder.begin())
        except BaseException:
            self._line.close()
            raise
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._line.write(self._encoder.end())
                self._wait_until(self.sent)
        finally:
            self._ending = True
            self._thread.join(5.0)
            self._line.close()

    def exchange(self, events: Events, suppressed: NDArray[np.bool_]) -> None:
        """Send a chunk; ``suppressed`` bool[n] is what the golden model decided on it."""
        for first in range(0, len(events), _PIECE_EVENTS):
            piece = events[first : first + _PIECE_EVENTS]
            self._wait_until(self.sent + len(piece) - self._window)
            with self._changed:
                self._golden.append((piece, suppressed[first : first + _PIECE_EVENTS].copy(), time.perf_counter()))
                self.sent += len(piece)
            self._line.write(self._encoder.encode(piece))

    def to_json(self) -> dict[str, Any]:
        """Return what was compared."""
        return {
            "device": self.banner,
            "sent": self.sent,
            "compared": self.compared,
            "different": self.different,
            "first_difference": None if self.first is None else self.first.text(),
            "bad_bytes": self._decoder.counters.bad_bytes,
            "lost_frames": self._decoder.counters.lost_frames,
            "latency": self.latency.to_json(),
        }

    def _wait_until(self, compared: int) -> None:
        """Wait until so many events were compared; raise when the device stands still."""
        with self._changed:
            last, last_s = self.compared, time.monotonic()
            while self.compared < compared and self._fault is None:
                self._changed.wait(_POLL_S)
                if self.compared != last:
                    last, last_s = self.compared, time.monotonic()
                elif time.monotonic() - last_s > self._silence_s:
                    raise LinkError(
                        self._line.port,
                        f"the device has decided {self.compared:,} of {self.sent:,} events and nothing for "
                        f"{self._silence_s:g} s",
                    )
            if self._fault is not None:
                raise LinkError("", self._fault)

    def _listen(self) -> None:
        """Take decisions until the end; a fault of the line waits for the next exchange."""
        try:
            while not self._ending:
                self._decoder.feed(self._line.read(1 << 16, _POLL_S))
                for first, decided in self._decoder.take_decisions():
                    self._compare(first, decided)
        except LinkError as error:
            self._fail(str(error))

    def _compare(self, first: int, decided: NDArray[np.bool_]) -> None:
        """Lay decisions beside the golden ones; those that a lost frame took away are a fault."""
        now_s = time.perf_counter()
        with self._changed:
            if first != self.compared:
                self._fail(f"{self._line.port}: the decisions on {first - self.compared:,} events were lost")
                return
            while len(decided):
                if not self._golden:
                    self._fail(f"{self._line.port}: the device decided more events than it was sent")
                    return
                events, golden, sent_s = self._golden.popleft()
                count = min(len(decided), len(events))
                for row in np.flatnonzero(decided[:count] != golden[:count]).tolist():
                    self._differ(events, row, bool(decided[row]))
                self.latency.add(now_s - sent_s, count)
                self.compared += count
                decided = decided[count:]
                if count < len(events):
                    self._golden.appendleft((events[count:], golden[count:], sent_s))
            self._changed.notify_all()

    def _differ(self, events: Events, row: int, device_suppressed: bool) -> None:
        self.different += 1
        if self.first is None:
            t, x, y, p = (int(getattr(events, name)[row]) for name in "txyp")
            self.first = Difference(self.compared + row, t, x, y, p, device_suppressed)

    def _fail(self, fault: str) -> None:
        with self._changed:
            self._fault = fault
            self._changed.notify_all()
