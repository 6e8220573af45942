"""Make streams, spoil bytes and count what is lost, for every wire protocol."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from itertools import pairwise

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.protocol import Decoder, LinkCounters

CASES = ["edvs-E2", "edvs-E3", "edvs-E4", "edvs-E1", "evt2", "evt3", "openmv", "framed"]


@pytest.fixture(params=CASES)
def options(request: pytest.FixtureRequest) -> tuple[str, ProtocolOptions]:
    """Every protocol by name, with options for a sensor of 128x128 px."""
    name, _, edvs_format = request.param.partition("-")
    edvs_format = edvs_format or "E3"
    return name, ProtocolOptions(width=128, height=128, edvs_format=edvs_format)


def stream(seed: int, n: int, *, step_us: int = 160, start_us: int = 0, side_px: int = 128) -> Events:
    """Return random events: steps up to ``step_us``, clusters of places, runs of one polarity."""
    rng = np.random.default_rng(seed)
    t = start_us + np.cumsum(rng.integers(0, step_us + 1, n))
    t -= t[0] - start_us if n else 0
    x, y = (np.clip(rng.normal(side_px / 2, side_px / 6, n), 0, side_px - 1).astype(int) for _ in range(2))
    p = np.repeat(rng.integers(0, 2, n // 5 + 1), 5)[:n]
    return Events(t, x, y, p, side_px, side_px)


def encoded(name: str, options: ProtocolOptions, events: Events) -> bytes:
    """Return a stream from its beginning to its end."""
    encoder = registry.encoder(name, options)
    return encoder.begin() + encoder.encode(events) + encoder.end()


def decoded(decoder: Decoder, data: bytes, cuts: Iterable[int] = ()) -> Events:
    """Feed ``data`` cut at ``cuts`` and settle."""
    places = [0, *sorted(cuts), len(data)]
    parts = [decoder.feed(data[a:b]) for a, b in pairwise(places)]
    return Events.concatenate([part for part in [*parts, decoder.settle()] if part.width == decoder.width])


def rows(events: Events) -> list[tuple[int, ...]]:
    """Return the events as tuples."""
    return list(zip(*(getattr(events, name).tolist() for name in "txyp"), strict=True))


def spoil(data: bytes, seed: int, share: float) -> tuple[bytes, int]:
    """Drop, double, flip a bit of or insert a byte at a ``share`` of the places; return how many were hit."""
    rng = np.random.default_rng(seed)
    hits = np.sort(rng.choice(len(data), max(int(len(data) * share), 1), replace=False)).tolist()
    parts, done = [], 0
    for place in hits:
        parts.append(data[done:place])
        byte = data[place : place + 1]
        what = rng.integers(4)
        if what == 1:
            byte += byte
        elif what == 2:
            byte = bytes([byte[0] ^ 1 << int(rng.integers(8))])
        elif what == 3:
            byte += bytes([int(rng.integers(256))])
        parts.append(b"" if what == 0 else byte)
        done = place + 1
    return b"".join([*parts, data[done:]]), len(hits)


def lost_and_false(sent: Events, came: Events) -> tuple[int, int]:
    """Return how many events did not come as they were sent, and how many came that were not sent."""
    a, b = Counter(rows(sent)), Counter(rows(came))
    return sum((a - b).values()), sum((b - a).values())


def counted(counters: LinkCounters) -> dict[str, int]:
    """Return the counters by name."""
    return {name: getattr(counters, name) for name in LinkCounters.__slots__}


@pytest.fixture
def make_line() -> Callable[..., object]:
    """Return a maker of lines to an emulated device, all in memory and without delay."""

    class DeviceLine:
        def __init__(self, device: object, answers: bool = True) -> None:
            self.device = device
            self.sent = b""
            self.waiting = b""
            self._answers = answers

        def read(self, most: int, timeout_s: float) -> bytes:
            data, self.waiting = self.waiting[:most], self.waiting[most:]
            return data

        def write(self, data: bytes) -> None:
            self.sent += data
            self.waiting += self.device.receive(data) if self._answers else b""

        def drop_input(self) -> None:
            self.waiting = b""

    return DeviceLine
