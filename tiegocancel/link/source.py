"""Be a stream of events that comes over a line: chunks sized by time, limits, latency, and an account of every loss."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from types import TracebackType
from typing import Any, Self

from tiegocancel.errors import ConfigError, LinkError, TiegoCancelError
from tiegocancel.events import Events
from tiegocancel.link.event_queue import Arrival, EventQueue, QueueOptions
from tiegocancel.link.latency import Latency
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.opening import AnyLine, open_line
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.protocol import Decoder, Host, TextLine
from tiegocancel.link.reader import LinkReader

__all__ = ["Limits", "LinkSource"]

_TICK_S = 0.05
"""A source gives an empty chunk at least so often, so that who iterates hears an interruption and shows what is new."""
_LONG_S = 1.0
"""Who waits so long for a decision has to be told."""
_JOIN_S = 10.0
"""More than a write to a dead device and the conversation at the end take."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Say when to stop: after so many events, after so many seconds since the first one came; ``None`` never."""

    max_events: int | None = None
    duration_s: float | None = None

    def __post_init__(self) -> None:
        if self.max_events is not None and self.max_events < 1:
            raise ConfigError(f"--max-events must be at least 1, not {self.max_events}")
        if self.duration_s is not None and not 0.0 < self.duration_s < float("inf"):
            raise ConfigError(f"--duration must be a number of seconds above 0, not {self.duration_s}")


class LinkSource:
    """Iterate over the events of a line; use it as a context manager, which starts and ends its thread.

    Each chunk holds what came since the last one and was held for at most the queue's ``hold_s``; an empty chunk means
    that time passed. Call :meth:`decided` once a chunk is decided: that closes the latency of its events. When the line
    fails for good, what was received is given first and :class:`LinkError` raised after it. ``on_lines`` takes the
    text lines that came among the events, before these are given.
    """

    def __init__(
        self,
        port: str,
        protocol: str,
        *,
        line: LineOptions | None = None,
        queue: QueueOptions | None = None,
        options: ProtocolOptions | None = None,
        limits: Limits | None = None,
        decoder: Decoder | None = None,
        host: Host | None = None,
        opener: Callable[[], AnyLine] | None = None,
    ) -> None:
        self.port, self.protocol = port, protocol
        self._line = line or LineOptions()
        self._limits = limits or Limits()
        self.decoder = decoder or registry.decoder(protocol, options)
        self.queue = EventQueue(queue or QueueOptions())
        self.latency = Latency()
        self.on_lines: Callable[[list[TextLine]], None] = lambda lines: None
        self.events = 0
        self._reader = LinkReader(
            opener or (lambda: open_line(port, self._line)),
            port=port,
            decoder=self.decoder,
            host=host or registry.host(protocol, options),
            queue=self.queue,
            options=self._line,
        )
        self._ahead: list[Arrival] = []
        self._given: list[tuple[float, int]] = []
        self._first_s: float | None = None
        self._last_s = 0.0
        self._stopped = False

    def __enter__(self) -> Self:
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Stop the device, close the line and end the thread; what still waits is discarded."""
        self._stopped = True
        self._reader.stop()
        self.queue.close()
        if self._reader.ident is not None:
            self._reader.join(_JOIN_S)

    def stop(self) -> None:
        """Ask the device to stop; what was received until then is still given."""
        self._stopped = True
        self._reader.stop()

    @property
    def banner(self) -> str:
        """What the device called itself, empty where the protocol has no such thing."""
        return self._reader.banner

    @property
    def reconnects(self) -> int:
        """How often the line was lost and came back."""
        return self._reader.reconnects

    def wait_for_size(self) -> tuple[int, int]:
        """Wait for the first events; return the sensor's size. Raise :class:`LinkError` when the line ends before."""
        while not any(len(arrival.events) for arrival in self._ahead):
            self._ahead += (taken := self.queue.take(_TICK_S))
            if not taken and self.queue.closed:
                self._raise_fault()
                raise LinkError(self.port, f"ended without an event of the protocol {self.protocol}")
        first = next(arrival.events for arrival in self._ahead if len(arrival.events))
        return first.width, first.height

    def __iter__(self) -> Iterator[Events]:
        size = self.wait_for_size()
        while True:
            taken = self._ahead or self.queue.take(_TICK_S)
            self._ahead = []
            if not taken and self.queue.closed:
                break
            if lines := [line for arrival in taken for line in arrival.lines]:
                self.on_lines(lines)
            chunk = self._chunk(taken, size)
            if self._limits.max_events is not None and self.events + len(chunk) >= self._limits.max_events:
                yield self._count(chunk[: self._limits.max_events - self.events])
                self.close()
                return
            yield self._count(chunk)
            if self._late():
                self.stop()
        self._raise_fault()

    def decided(self) -> None:
        """Close the latency of the chunk that was given last."""
        now_s = time.perf_counter()
        for arrived_s, events in self._given:
            self.latency.add(now_s - arrived_s, events)
        self._given = []

    def rate_hz(self) -> float:
        """Return the mean rate of events since the first one."""
        seconds = self._last_s - (self._first_s or self._last_s)
        return self.events / seconds if seconds > 0 else 0.0

    def to_json(self) -> dict[str, Any]:
        """Return everything that is counted about the link."""
        return {
            "port": self.port,
            "protocol": self.protocol,
            "baud": self._line.baud,
            "banner": self.banner,
            "events": self.events,
            "rate_hz": self.rate_hz(),
            "reconnects": self.reconnects,
            "driver_overruns": self._reader.overruns,
            "decoder": asdict(self.decoder.counters),
            "queue": {"policy": self.queue.options.policy, **self.queue.counters.to_json()},
            "latency": self.latency.to_json(),
        }

    def notes(self) -> list[str]:
        """Say what was lost or put right, in lines for the user."""
        wire, queue = self.decoder.counters, self.queue.counters
        said = list(dict.fromkeys(self._reader.notes))
        for count, what in (
            (
                self._reader.overruns,
                "bytes were lost in the serial driver: the machine was too slow, or no flow control",
            ),
            (wire.bad_bytes, "bytes of the line belong to no event"),
            (wire.lost_frames, "frames were lost on the line"),
            (wire.lost_events, "events were lost on the line"),
            (wire.resyncs, "times the decoder found its step again"),
            (wire.time_jumps, "jumps in time were refused or bridged"),
            (wire.outside, "events lay beyond the sensor"),
            (queue.dropped, "events were dropped because processing fell behind (drop-oldest)"),
            (queue.thinned, "events were thinned out because processing fell behind (thin)"),
        ):
            if count:
                said.append(f"{self.port}: {count:,} {what}")
        if self.latency.max_s >= _LONG_S:
            said.append(
                f"{self.port}: events waited for up to {self.latency.max_s:.1f} s: processing fell behind. A longer "
                "--step-us, --no-controls, or --policy drop-oldest with a smaller --queue keeps it in time"
            )
        if queue.blocked_s >= 0.1:
            said.append(f"{self.port}: processing fell behind; the reader waited for {queue.blocked_s:.1f} s (block)")
        return said

    def _chunk(self, taken: list[Arrival], size: tuple[int, int]) -> Events:
        """Join arrivals; refuse a sensor that changes its size."""
        parts = [arrival.events for arrival in taken if len(arrival.events)]
        for part in parts:
            if (part.width, part.height) != size:
                raise LinkError(
                    self.port,
                    f"the sensor was {size[0]}×{size[1]} px and is now {part.width}×{part.height} px: begin anew",
                )
        self._given = [(arrival.arrived_s, len(arrival.events)) for arrival in taken]
        return Events.concatenate(parts) if parts else Events.empty(*size)

    def _count(self, chunk: Events) -> Events:
        if len(chunk):
            now_s = time.perf_counter()
            if self._first_s is None:
                self._first_s = now_s
            self._last_s = now_s
            self.events += len(chunk)
        return chunk

    def _late(self) -> bool:
        """Tell whether the duration is over, by the clock of the host."""
        limit_s = self._limits.duration_s
        return (
            limit_s is not None
            and self._first_s is not None
            and not self._stopped
            and time.perf_counter() - self._first_s >= limit_s
        )

    def _raise_fault(self) -> None:
        """Raise what ended the reader, if it was a fault."""
        if self._reader.fault is not None:
            raise TiegoCancelError(self._reader.fault)
