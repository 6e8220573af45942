"""A tiny wire protocol, lines of every kind, and a watch over threads and descriptors that a test leaves behind."""

from __future__ import annotations

import gc
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.errors import LinkError
from tiegocancel.link.emulator import Emulator
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.player import Pace
from tiegocancel.link.protocols.protocol import Line, LinkCounters, TextLine
from tiegocancel.link.pseudo_terminal import PseudoTerminal
from tiegocancel.link.source import LinkSource

WIDTH, HEIGHT = 64, 48
_ROW = np.dtype([("mark", "u1"), ("x", "u1"), ("y", "u1"), ("p", "u1"), ("t", "<u4")])


class TinyDecoder:
    """Eight bytes an event: a mark, x, y, polarity, time."""

    def __init__(self) -> None:
        self.width, self.height = WIDTH, HEIGHT
        self.counters = LinkCounters()
        self._rest = b""

    def feed(self, data: bytes) -> Events:
        self.counters.bytes += len(data)
        self._rest += data
        while self._rest and self._rest[0] != 0xA5:
            self._rest = self._rest[1:]
            self.counters.bad_bytes += 1
        whole = len(self._rest) // 8 * 8
        rows, self._rest = np.frombuffer(self._rest[:whole], _ROW), self._rest[whole:]
        self.counters.events += len(rows)
        return Events(rows["t"], rows["x"], rows["y"], rows["p"], WIDTH, HEIGHT)

    def settle(self) -> Events:
        return Events.empty(WIDTH, HEIGHT)

    def take_lines(self) -> list[TextLine]:
        return []


class TinyEncoder:
    def begin(self) -> bytes:
        return b""

    def encode(self, events: Events) -> bytes:
        rows = np.zeros(len(events), _ROW)
        rows["mark"], rows["t"] = 0xA5, events.t
        rows["x"], rows["y"], rows["p"] = events.x, events.y, events.p
        return rows.tobytes()

    def end(self) -> bytes:
        return b""


class TinyHost:
    """Say G and wait for the banner; say S at the end."""

    def start(self, line: Line) -> str:
        line.write(b"S\n")
        while line.read(1 << 16, 0.03):  # what an earlier stream left
            pass
        line.write(b"G\n")
        said, deadline = b"", time.monotonic() + 2.0
        while said != b"tiny\n":
            said += line.read(5 - len(said), 0.05)
            if time.monotonic() > deadline:
                raise LinkError("", "the device does not answer")
        return "tiny"

    def stop(self, line: Line) -> None:
        line.write(b"S\n")


class SilentHost:
    """Begin without a word, as on a file."""

    def start(self, line: Line) -> str:
        return ""

    def stop(self, line: Line) -> None:
        pass


class TinyDevice:
    def __init__(self) -> None:
        self.streaming = False

    def receive(self, data: bytes) -> bytes:
        reply = b""
        for byte in data:
            if byte == ord("G"):
                self.streaming, reply = True, b"tiny\n"
            elif byte == ord("S"):
                self.streaming = False
        return reply

    def encoder(self) -> TinyEncoder:
        return TinyEncoder()


def some_events(count: int, *, step_us: int = 10, seed: int = 0) -> Events:
    rng = np.random.default_rng(seed)
    return Events(
        np.arange(count) * step_us, rng.integers(0, WIDTH, count), rng.integers(0, HEIGHT, count),
        rng.integers(0, 2, count), WIDTH, HEIGHT,
    )  # fmt: skip


def equal(a: Events, b: Events) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in "txyp")


class Serving:
    """Run an emulator on a pseudo-terminal in a thread of the test."""

    def __init__(self, events: Events, pace: Pace) -> None:
        self.line = PseudoTerminal()
        self.stopped = threading.Event()
        self.emulator = Emulator(
            self.line, TinyDevice(), lambda: [events], pace=pace, stopped=self.stopped.is_set
        )  # fmt: skip
        self._thread = threading.Thread(target=self.emulator.serve, name="emulator", daemon=True)
        self._thread.start()

    @property
    def port(self) -> str:
        return self.line.port

    def end(self) -> None:
        self.stopped.set()
        self._thread.join(5.0)
        assert not self._thread.is_alive()
        self.line.close()


@pytest.fixture
def serve() -> Iterator[Callable[..., Serving]]:
    """Return a function that starts an emulator of the tiny protocol."""
    running: list[Serving] = []

    def begin(events: Events, **pace: float) -> Serving:
        running.append(Serving(events, Pace(**pace)))  # type: ignore[arg-type]
        return running[-1]

    yield begin
    for serving in running:
        serving.end()


@pytest.fixture
def tiny() -> SimpleNamespace:
    """Return the tiny protocol's parts and helpers."""
    return SimpleNamespace(
        Decoder=TinyDecoder, Encoder=TinyEncoder, Host=TinyHost, SilentHost=SilentHost, Device=TinyDevice,
        some_events=some_events, equal=equal, size=(WIDTH, HEIGHT), source=_source, received=_received,
    )  # fmt: skip


def _source(port: str, line: LineOptions, **more: object) -> LinkSource:
    more.setdefault("host", TinyHost())
    return LinkSource(port, "tiny", line=line, decoder=TinyDecoder(), **more)  # type: ignore[arg-type]


def _received(link: LinkSource) -> Events:
    with link:
        chunks = [Events.empty(WIDTH, HEIGHT)]
        for chunk in link:
            chunks.append(chunk)
            link.decided()
    return Events.concatenate(chunks)


@pytest.fixture
def line_options() -> LineOptions:
    return LineOptions(reconnect_s=0.0, silence_s=5.0, write_timeout_s=2.0)


def _descriptors() -> dict[str, str]:
    folder = Path("/proc/self/fd")
    found = {}
    for name in os.listdir(folder) if folder.is_dir() else []:
        try:
            found[name] = os.readlink(folder / name)
        except OSError:
            continue
    return found


@pytest.fixture(autouse=True)
def _nothing_is_left_behind() -> Iterator[None]:
    """Fail a test that leaves a thread, a port, a socket or a pipe open."""
    threads, before = set(threading.enumerate()), _descriptors()
    yield
    deadline = time.monotonic() + 2.0
    while set(threading.enumerate()) - threads and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not set(threading.enumerate()) - threads
    gc.collect()
    after = _descriptors()
    left = {what for name, what in after.items() if name not in before}
    assert not {what for what in left if what.startswith(("socket:", "pipe:", "/dev/pt"))}
