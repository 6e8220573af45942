"""Recordings of real cameras: the events that other decoders find, and the numbers known of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import Events, open_events, read_events, write_events

Recording = Callable[[str], Path]


def test_the_disc_slice_of_the_thesis(recording: Recording) -> None:
    events = read_events(recording("anu_disc_10ms.npy"), width=1280, height=720)
    assert len(events) == 98_626
    rows = np.load(recording("anu_disc_10ms.npy"))
    real = rows[rows[:, 4] == 0].astype(np.float64)
    assert np.array_equal(events.t, np.round(real[:, 3] * 1e6).astype(np.int64))
    assert np.array_equal(events.p, real[:, 2])


def test_spinning_dot_in_evt2(recording: Recording) -> None:
    path = recording("spinning_dot_evt2.raw")
    with open_events(path) as reader:
        assert (reader.format, reader.width, reader.height) == ("evt2", 640, 480)
        events = reader.read()
    assert (len(events), events.span_us) == (539_481, 50_000)
    rows = pytest.importorskip("expelliarmus").Wizard(encoding="evt2").read(path)
    for name in "txyp":
        assert np.array_equal(rows[name], getattr(events, name))


def test_driving_in_evt3(recording: Recording) -> None:
    path = recording("driving_evt3.raw")
    with open_events(path, chunk_events=1000) as reader:
        assert (reader.format, reader.width, reader.height) == ("evt3", 1280, 720)
        events = Events.concatenate(list(reader))
    assert len(events) == 219_596
    theirs = pytest.importorskip("evt3").decode_file(str(path))
    for name in "txyp":
        assert np.array_equal(
            np.asarray(getattr(theirs, name)).astype(np.int64), getattr(events, name).astype(np.int64)
        )


def test_davis_in_aedat4(recording: Recording) -> None:
    path = recording("davis346_imu.aedat4")
    pytest.importorskip("eventcv")
    events = read_events(path)
    assert (len(events), events.width, events.height) == (78_830, 346, 260)
    decoder = pytest.importorskip("aedat").Decoder(str(path))
    rows = np.concatenate([packet["events"] for packet in decoder if "events" in packet])
    for name, theirs in zip("txyp", ("t", "x", "y", "on"), strict=True):
        assert np.array_equal(rows[theirs].astype(np.int64), getattr(events, name).astype(np.int64))


def test_moving_box_in_aedat2(recording: Recording) -> None:
    path = recording("dvs128_moving_box.aedat")
    events = read_events(path)
    assert (len(events), events.width, events.height) == (489_834, 128, 128)
    assert 39.7e6 < events.span_us < 39.9e6
    body = path.read_bytes()
    words = np.frombuffer(body[len(body) - 8 * len(events) :], ">u4").reshape(-1, 2)
    assert np.array_equal(events.x, (words[:, 0] >> 1) & 127)
    assert np.array_equal(events.y, (words[:, 0] >> 8) & 127)
    assert np.array_equal(events.p, 1 - (words[:, 0] & 1))


def test_shapes_rotation_in_text(recording: Recording) -> None:
    events = read_events(recording("ecd_shapes_rotation.txt"), time_unit="s")
    assert (len(events), events.width, events.height) == (9_058, 240, 180)
    rows = [line.split() for line in recording("ecd_shapes_rotation.txt").read_text().splitlines()]
    assert events.t.tolist() == [(int(row[0].replace(".", "")) + 500) // 1000 for row in rows]


def test_a_real_recording_round_trips_through_evt2(
    recording: Recording, tmp_path: Path, same: Callable[..., bool]
) -> None:
    events = read_events(recording("driving_evt3.raw"))
    write_events(tmp_path / "a.raw", events)
    assert same(read_events(tmp_path / "a.raw"), events)
    faery = pytest.importorskip("faery")
    rows = faery.events_stream_from_file(tmp_path / "a.raw").to_array()
    for name, theirs in zip("txyp", ("t", "x", "y", "on"), strict=True):
        assert np.array_equal(rows[theirs], getattr(events, name))
