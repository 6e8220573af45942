"""DAT: header, event type, wraps, faults at their byte, another decoder as witness."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import Events, InputError, open_events, read_events

Save = Callable[..., Path]
HEADER = b"% Data file containing CD events.\n% Version 2\n% Width 64\n% Height 48\n"


def dat(events: Events, kind: bytes = b"\x0c\x08") -> bytes:
    rows = np.zeros(len(events), [("t", "<u4"), ("data", "<u4")])
    rows["t"] = events.t & 0xFFFFFFFF
    rows["data"] = events.x.astype(np.uint32) | events.y.astype(np.uint32) << 14 | events.p.astype(np.uint32) << 28
    return HEADER + kind + rows.tobytes()


@pytest.mark.parametrize("kind", [b"\x00\x08", b"\x0c\x08"])
@pytest.mark.parametrize("start_us", [0, 2**32 - 5000])
def test_events_come_back_and_wraps_are_followed(
    kind: bytes, start_us: int, saved: Save, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(start_us=start_us)
    with open_events(saved("a.dat", dat(events, kind))) as reader:
        assert (reader.format, reader.width, reader.height) == ("dat", 64, 48)
        assert same(reader.read(), events)


@pytest.mark.parametrize(
    ("content", "where", "problem"),
    [
        (HEADER, len(HEADER), "event type"),
        (HEADER + b"\x0e\x08", len(HEADER), "type 14 of 8 bytes"),
        (HEADER + b"\x0c\x10", len(HEADER), "type 12 of 16 bytes"),
        (HEADER + b"\x0c\x08" + b"\0" * 11, len(HEADER) + 10, "3 bytes of a 8-byte word"),
        (HEADER + b"\x0c\x08" + b"\0" * 15 + b"\x20", len(HEADER) + 10, "polarity is 2"),
        (HEADER + b"\x0c\x08" + b"\0" * 12 + b"\x40\0\0\0", len(HEADER) + 10, "x is 64"),
    ],
)
def test_a_fault_is_named_by_its_byte(content: bytes, where: int, problem: str, saved: Save) -> None:
    with pytest.raises(InputError) as caught:
        read_events(saved("a.dat", content))
    assert caught.value.where == f"byte {where}"
    assert problem in caught.value.problem


def test_other_versions_are_refused(saved: Save) -> None:
    with pytest.raises(InputError, match="DAT version '1', expected 2"):
        read_events(saved("a.dat", HEADER.replace(b"Version 2", b"Version 1") + b"\x0c\x08"))


def test_other_decoders_agree(saved: Save, stream: Callable[..., Events]) -> None:
    expelliarmus, faery = pytest.importorskip("expelliarmus"), pytest.importorskip("faery")
    path = saved("a.dat", dat(stream(n=3000)))
    events = read_events(path)
    rows = expelliarmus.Wizard(encoding="dat").read(path)
    for name in "txyp":
        assert np.array_equal(rows[name], getattr(events, name))
    rows = faery.events_stream_from_file(path).to_array()
    for name, theirs in zip("txyp", ("t", "x", "y", "on"), strict=True):
        assert np.array_equal(rows[theirs], getattr(events, name))
