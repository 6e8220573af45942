"""Say what every wire protocol offers: decoder, encoder, the host's side of the conversation and the device's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from tiegocancel.events import Events

__all__ = ["Decoder", "Device", "Encoder", "Host", "Line", "LinkCounters", "TextLine"]


@dataclass(slots=True, kw_only=True)
class LinkCounters:
    """Count what came over a link and what was lost on it; nothing is lost silently.

    ``bytes`` fed; ``events`` decoded; ``bad_bytes`` that belong to nothing; ``lost_frames`` and ``lost_events`` where
    the protocol tells how many are missing; ``resyncs`` after which the decoder was in step again; ``time_jumps`` that
    were refused or bridged; ``outside`` events beyond the sensor; ``text_lines`` out of band.
    """

    bytes: int = 0
    events: int = 0
    bad_bytes: int = 0
    lost_frames: int = 0
    lost_events: int = 0
    resyncs: int = 0
    time_jumps: int = 0
    outside: int = 0
    text_lines: int = 0


@dataclass(frozen=True, slots=True)
class TextLine:
    """A line of text between events, without its end, at the time of the event before it."""

    t_us: int
    text: str


class Decoder(Protocol):
    """Decode a byte stream that may be cut anywhere; times in µs never decrease.

    ``width`` and ``height`` in px are those of the events returned; of a protocol that tells the size, they change
    with what it tells, and so does every later chunk.
    """

    width: int
    height: int
    counters: LinkCounters

    def feed(self, data: bytes) -> Events:
        """Take bytes; return the events that are complete, in order. What is cut waits for the next call."""
        ...

    def settle(self) -> Events:
        """Return what was held back until its successor confirms it: call it when the line is silent or has ended."""
        ...

    def take_lines(self) -> list[TextLine]:
        """Return and forget the text lines that came since the last call."""
        ...


class Encoder(Protocol):
    """Encode events as a device sends them; chunks may be cut anywhere."""

    def begin(self) -> bytes:
        """Return what goes before the first event."""
        ...

    def encode(self, events: Events) -> bytes:
        """Return the bytes of a chunk; what a frame still gathers waits for the next call."""
        ...

    def end(self) -> bytes:
        """Return what is still held and what goes after the last event."""
        ...


class Line(Protocol):
    """A byte line to talk over: what conversations need of a transport."""

    def read(self, most: int, timeout_s: float) -> bytes:
        """Return up to ``most`` bytes, as soon as there are any, nothing after ``timeout_s``."""
        ...

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        ...

    def drop_input(self) -> None:
        """Forget what has come and was not read."""
        ...


class Host(Protocol):
    """The host's side of the conversation around a stream."""

    def start(self, line: Line) -> str:
        """Make the device stream; return its banner, empty where there is none. Raise ``LinkError`` when it refuses."""
        ...

    def stop(self, line: Line) -> None:
        """Make the device stop."""
        ...


class Device(Protocol):
    """The device's side, for emulation: commands in, replies out, and whether it streams now."""

    streaming: bool

    def receive(self, data: bytes) -> bytes:
        """Take bytes from the host; return the reply."""
        ...

    def encoder(self) -> Encoder:
        """Return an encoder of the format that the host has chosen, its clock as the commands have set it."""
        ...
