"""Formats read through eventcv: right events, no guesses, no silence about what is cut off."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import Events, InputError, MissingExtraError, open_events, read_events

Save = Callable[..., Path]


@pytest.fixture
def by_eventcv(tmp_path: Path, stream: Callable[..., Events]) -> Callable[[str], tuple[Path, Events]]:
    """Return a function that lets eventcv write a file."""
    eventcv = pytest.importorskip("eventcv")

    def make(name: str) -> tuple[Path, Events]:
        events = stream(n=3000)
        rows = np.stack([events.x, events.y, events.t, events.p], axis=1).astype(np.uint64)
        eventcv.from_numpy(rows, sensor_size=(64, 48), time_unit="us").save(str(tmp_path / name))
        return tmp_path / name, events

    return make


@pytest.mark.parametrize(("name", "format"), [("a.h5", "hdf5"), ("a.bag", "rosbag")])
@pytest.mark.parametrize("suffix", ["", ".bin"])
def test_events_and_size_come_back(
    name: str, format: str, suffix: str, by_eventcv: Callable[[str], tuple[Path, Events]], same: Callable[..., bool]
) -> None:
    path, events = by_eventcv(name)
    path = path.rename(path.with_name(path.name + suffix))
    with open_events(path, time_unit="us", chunk_events=700) as reader:
        assert (reader.format, reader.width, reader.height) == (format, 64, 48)
        assert same(Events.concatenate(list(reader)), events)


def test_hdf5_without_a_declared_unit_is_refused_with_the_flag(
    by_eventcv: Callable[[str], tuple[Path, Events]],
) -> None:
    path, events = by_eventcv("a.h5")
    with pytest.raises(InputError, match="--time-unit"):
        open_events(path)
    assert np.array_equal(read_events(path, time_unit="ms").t, events.t * 1000)


def test_events_outside_a_declared_size_are_a_fault_and_not_dropped(
    by_eventcv: Callable[[str], tuple[Path, Events]],
) -> None:
    path, events = by_eventcv("a.bag")
    row = int(np.argmax((events.x >= 20) | (events.y >= 20)))
    with pytest.raises(InputError, match=f"row {row}: "):
        read_events(path, width=20, height=20)


@pytest.mark.parametrize("name", ["a.h5", "a.bag"])
@pytest.mark.parametrize("keep", [0.01, 0.5, 0.999])
def test_a_truncated_file_is_one_clear_line_and_nothing_on_the_error_stream(
    name: str, keep: float, by_eventcv: Callable[[str], tuple[Path, Events]], capfd: pytest.CaptureFixture[str]
) -> None:
    path, _ = by_eventcv(name)
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * keep)])
    with pytest.raises(InputError) as caught:
        read_events(path, time_unit="us")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""


def test_a_truncated_aedat4_is_a_fault_at_the_packet_that_is_cut(
    recording: Callable[[str], Path], tmp_path: Path
) -> None:
    pytest.importorskip("eventcv")
    content = recording("davis346_imu.aedat4").read_bytes()
    whole = read_events(recording("davis346_imu.aedat4"))
    path = tmp_path / "cut.aedat4"
    path.write_bytes(content[: len(content) // 2])
    chunks: list[Events] = []
    with open_events(path) as reader, pytest.raises(InputError, match=r"byte \d+: packet of \d+ bytes") as caught:
        chunks.extend(reader)
    kept = Events.concatenate(chunks)
    assert 0 < len(kept) < len(whole)
    assert np.array_equal(kept.t, whole.t[: len(kept)])
    assert int(caught.value.where.split()[1]) < len(content) // 2
    path.write_bytes(content[:100])
    with pytest.raises(InputError, match="byte 14"):
        open_events(path)


@pytest.mark.parametrize(
    ("name", "content"),
    [("a.aedat4", b"#!AER-DAT4.0\r\n"), ("a.h5", b"\x89HDF\r\n\x1a\n"), ("a.bag", b"#ROSBAG V2.0\n")],
)
def test_without_the_package_the_message_names_the_extra(
    name: str, content: bytes, saved: Save, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "eventcv", None)
    with pytest.raises(MissingExtraError, match=r"tiegocancel\[files\]"):
        open_events(saved(name, content), time_unit="us")


def test_the_error_stream_is_given_back(by_eventcv: Callable[[str], tuple[Path, Events]]) -> None:
    path, _ = by_eventcv("a.bag")
    before = os.fstat(2)
    read_events(path)
    assert os.path.samestat(before, os.fstat(2))
