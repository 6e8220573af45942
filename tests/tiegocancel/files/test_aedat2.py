"""AEDAT 2.0: the layouts of DVS128 and DAVIS, the choice between them, wraps, words that are no events."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import Events, InputError, open_events, read_events

Save = Callable[..., Path]
VERSION = b"#!AER-DAT2.0\r\n# This is a raw AE data file - do not edit\r\n"


def named(chip: str) -> bytes:
    return VERSION + f"# HardwareInterface: test\r\n# AEChip: eu.seebetter.ini.chips.davis.{chip}\r\n".encode()


def records(address: np.ndarray, t: np.ndarray) -> bytes:
    rows = np.zeros(len(t), [("address", ">u4"), ("t", ">u4")])
    rows["address"], rows["t"] = address, t & 0xFFFFFFFF
    return rows.tobytes()


def dvs128(events: Events) -> bytes:
    address = events.y.astype(np.int64) << 8 | events.x.astype(np.int64) << 1 | (1 - events.p.astype(np.int64))
    return records(address, events.t)


def davis(events: Events) -> bytes:
    return records(
        events.y.astype(np.int64) << 22 | events.x.astype(np.int64) << 12 | events.p.astype(np.int64) << 11, events.t
    )


@pytest.mark.parametrize("header", [VERSION, named("DVS128"), VERSION + b"#End Of ASCII Header\r\n"])
@pytest.mark.parametrize("start_us", [0, 2**32 - 5000])
def test_dvs128(
    header: bytes, start_us: int, saved: Save, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(width=128, height=128, start_us=start_us)
    with open_events(saved("a.aedat", header + dvs128(events))) as reader:
        assert (reader.width, reader.height) == (128, 128)
        assert same(reader.read(), events)
    assert any("DVS128, as long as" in note for note in reader.notes) == (b"AEChip" not in header)


@pytest.mark.parametrize(
    ("chip", "size"), [("DAVIS240C", (240, 180)), ("Davis346BMono", (346, 260)), ("Davis640", (640, 480))]
)
def test_davis(
    chip: str, size: tuple[int, int], saved: Save, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(width=size[0], height=size[1])
    other = records(np.array([0x80000000, 0x00000400]), np.array([events.t[-1]] * 2))
    with open_events(saved("a.aedat", named(chip) + davis(events) + other)) as reader:
        assert (reader.width, reader.height) == size
        assert same(reader.read(), events)
    assert "2 words passed over that are no brightness changes" in reader.notes


def test_a_declared_davis_size_decides_where_no_chip_is_named(
    saved: Save, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(width=346, height=260)
    path = saved("a.aedat", VERSION + davis(events))
    assert same(read_events(path, width=346, height=260), events)
    with pytest.raises(InputError, match="--width and --height"):
        read_events(path)


def test_an_unknown_chip_is_refused(saved: Save) -> None:
    with pytest.raises(InputError, match="'Tmpdiff128' is not known"):
        read_events(saved("a.aedat", named("Tmpdiff128") + b"\0" * 8))


def test_an_address_beyond_the_chip_is_named_by_its_byte(saved: Save, stream: Callable[..., Events]) -> None:
    events = stream(n=10, width=128, height=128)
    content = VERSION + dvs128(events) + records(np.array([0x8001]), events.t[-1:])
    with pytest.raises(InputError, match=rf"byte {len(content) - 8}: address 0x8001"):
        read_events(saved("a.aedat", content))
    assert len(read_events(saved("b.aedat", named("DVS128") + content[len(VERSION) :]))) == 10


def test_a_truncated_record_is_named_by_its_byte(saved: Save, stream: Callable[..., Events]) -> None:
    content = VERSION + dvs128(stream(n=10, width=128, height=128))
    with pytest.raises(InputError, match=rf"byte {len(content) - 8}: ends after 5 bytes of a 8-byte word"):
        read_events(saved("a.aedat", content[:-3]))


def test_another_decoder_agrees_on_a_davis(saved: Save, stream: Callable[..., Events]) -> None:
    eventcv = pytest.importorskip("eventcv")
    path = saved("a.aedat", named("Davis346BMono") + davis(stream(width=346, height=260)))
    events = read_events(path)
    recording = eventcv.open(str(path), time_unit="us", sensor_size=(346, 260))
    rows = recording.slice_count(0, recording.n_events).numpy().astype(np.int64)
    # eventcv turns the picture over: it counts rows from the upper edge.
    assert np.array_equal(rows, np.stack([events.x, 259 - events.y.astype(np.int64), events.t, events.p], axis=1))
