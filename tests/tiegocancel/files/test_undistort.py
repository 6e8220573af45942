"""Check that a recording read through its calibration lies where a pinhole would show it, event by event."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import CameraIntrinsics, InputError, open_events, read_events, write_events
from tiegocancel.errors import ConfigError
from tiegocancel.files.undistort import pixel_map, undistorted

LENS = "50.0 50.0 31.5 23.5 -0.4 0.1 0.001 0.0 0.0\n"
BARREL = CameraIntrinsics(fx=50.0, fy=50.0, cx=31.5, cy=23.5, distortion=(-0.4, 0.1, 0.001))


@pytest.fixture
def files(tmp_path, stream):
    events = stream(n=3000, labelled=True)
    write_events(tmp_path / "e.npz", events)
    (tmp_path / "calib.txt").write_text(LENS)
    return tmp_path / "e.npz", tmp_path / "calib.txt", events


def expected(events):
    """Map event by event, in the plainest way."""
    rows, places = [], []
    for row in range(len(events)):
        x, y = BARREL.undistort([float(events.x[row])], [float(events.y[row])])
        place = int(np.floor(x[0] + 0.5)), int(np.floor(y[0] + 0.5))
        if 0 <= place[0] < events.width and 0 <= place[1] < events.height:
            rows.append(row)
            places.append(place)
    return rows, np.array(places)


def test_each_event_moves_to_the_nearest_undistorted_pixel_or_is_dropped_and_counted(files):
    path, calibration, events = files
    rows, places = expected(events)
    assert 0 < len(rows) < len(events)
    with open_events(path, undistort=calibration) as reader:
        found = reader.read()
        assert f"undistorted with calib.txt: {3000 - len(rows)} of 3000 events left the sensor and were dropped" in (
            reader.notes
        )
    assert np.array_equal(found.x, places[:, 0])
    assert np.array_equal(found.y, places[:, 1])
    for name in ("t", "p", "label"):
        assert np.array_equal(getattr(found, name), getattr(events, name)[rows])


@pytest.mark.parametrize("chunk_events", [1, 7, 1000, 1 << 20])
def test_chunks_hold_the_same_events_as_the_whole(files, same, chunk_events):
    path, calibration, events = files
    whole = read_events(path, undistort=calibration)
    with open_events(path, undistort=calibration, chunk_events=chunk_events) as reader:
        assert (reader.format, reader.width, reader.height, reader.labelled) == ("npz", 64, 48, True)
        for _ in range(2):  # each iteration starts again from the first event
            assert same(type(events).concatenate(list(reader)), whole)
        assert sum("left the sensor" in note for note in reader.notes) == 1


def test_a_pinhole_changes_nothing(files, same):
    path, _, events = files
    with open_events(path) as plain:
        reader = undistorted(plain, BARREL.pinhole())
        assert same(reader.read(), events)
        assert any("0 of 3000 events" in note for note in reader.notes)


def test_several_pixels_may_fall_on_one_and_others_stay_empty():
    goal = pixel_map(BARREL, 64, 48)
    pincushion = pixel_map(CameraIntrinsics(fx=50.0, fy=50.0, cx=31.5, cy=23.5, distortion=(0.4,)), 64, 48)
    inside = goal[goal >= 0]
    assert len(np.unique(inside)) == len(inside)  # a barrel is spread out: none meet
    assert len(inside) < 64 * 48
    assert len(np.unique(pincushion)) < 64 * 48  # a pincushion is drawn together
    assert pincushion.min() >= 0


def test_a_map_built_in_blocks_is_the_map(monkeypatch):
    whole = pixel_map(BARREL, 64, 48)
    monkeypatch.setattr("tiegocancel.files.undistort._BLOCK", 100)
    assert np.array_equal(pixel_map(BARREL, 64, 48), whole)


def test_a_fault_is_still_named_and_what_came_before_is_counted(saved):
    path = saved("e.csv", "t x y p\n" + "".join(f"{k} 30 20 1\n" for k in range(10)) + "10 99 20 1\n")
    lens = saved("calib.txt", LENS)
    with pytest.raises(InputError, match=r"row 12.*x is 99"):
        read_events(path, width=64, height=48, time_unit="us", undistort=lens)
    with open_events(path, width=64, height=48, time_unit="us", undistort=lens, keep_going=True) as reader:
        assert len(reader.read()) == 10
        assert reader.faults == 1
        assert any("0 of 10 events left" in note for note in reader.notes)


def test_unsorted_files_are_sorted_and_late_rows_named(saved, monkeypatch):
    lens = saved("calib.txt", LENS)
    path = saved("e.csv", "t x y p\n5 30 20 1\n3 31 20 0\n9 32 20 1\n")
    events = read_events(path, width=64, height=48, time_unit="us", undistort=lens)
    assert events.t.tolist() == [3, 5, 9]
    monkeypatch.setattr("tiegocancel.files.text._BLOCK_BYTES", 100)
    rows = "".join(f"{k} {0 if k % 2 else 30} 20 1\n" for k in range(100, 200))
    path = saved("f.csv", "t x y p\n" + rows + "200 0 0 1\n3 31 20 0\n")
    with (
        open_events(path, width=64, height=48, time_unit="us", undistort=lens, chunk_events=10) as reader,
        pytest.raises(InputError, match="row 103"),
    ):
        list(reader)


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc to count open files")
def test_leaving_the_block_closes_the_file_in_the_middle_of_a_stream(files):
    path, calibration, _ = files
    before = len(os.listdir("/proc/self/fd"))
    with open_events(path, undistort=calibration, chunk_events=10) as reader:
        next(iter(reader))
    assert len(os.listdir("/proc/self/fd")) == before


def test_a_calibration_of_another_sensor_is_said(files, saved):
    path, _, _ = files
    lens = saved("c.toml", "fx = 50\nfy = 50\ncx = 31.5\ncy = 23.5\nwidth = 346\nheight = 260\n")
    with open_events(path, undistort=lens) as reader:
        assert "c.toml is for 346x260 px, the recording has 64x48 px" in reader.notes


def test_a_bad_calibration_is_one_line_and_a_giant_sensor_is_refused(files, saved):
    path, _, _ = files
    with pytest.raises(InputError, match=r"bad\.txt: holds 1 words"):
        open_events(path, undistort=saved("bad.txt", "x"))
    text = saved("e.csv", "t x y p\n0 0 0 1\n")
    with pytest.raises(ConfigError, match="too large to undistort"):
        open_events(text, width=60_000, height=60_000, time_unit="us", undistort=saved("calib.txt", LENS))
