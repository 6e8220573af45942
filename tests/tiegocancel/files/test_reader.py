"""What every reader does, whatever the format: sizes, labels beside the file, places that are no recordings."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import ConfigError, Events, InputError, open_events, read_events, write_events
from tiegocancel.files import ReadOptions, sniff

Save = Callable[..., Path]


def test_a_missing_size_is_derived_and_said(tmp_path: Path, stream: Callable[..., Events]) -> None:
    write_events(tmp_path / "a.csv", stream())
    with open_events(tmp_path / "a.csv") as reader:
        assert (reader.width, reader.height) == (64, 48)
        assert "sensor size derived from the largest coordinate: 64x48" in reader.notes
    with open_events(tmp_path / "a.csv", width=100) as reader:
        assert (reader.width, reader.height) == (100, 48)
    with open_events(tmp_path / "a.csv", width=100, height=90) as reader:
        assert (reader.width, reader.height) == (100, 90)
        assert not any("derived" in note for note in reader.notes)


def test_a_declared_size_wins_over_the_files_and_says_so(tmp_path: Path, stream: Callable[..., Events]) -> None:
    write_events(tmp_path / "a.npz", stream())
    with open_events(tmp_path / "a.npz", width=100, height=90) as reader:
        assert (reader.width, reader.height) == (100, 90)
        assert any("although the file says 64x48" in note for note in reader.notes)


def test_labels_beside_a_file_are_taken_when_they_fit(
    tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(n=300, labelled=True)
    write_events(tmp_path / "a.raw", events)
    with open_events(tmp_path / "a.raw", chunk_events=7) as reader:
        assert reader.labelled
        assert "labels taken from a.raw.labels.npy" in reader.notes
        assert same(Events.concatenate(list(reader)), events)
    np.save(tmp_path / "a.raw.labels.npy", np.zeros(299, np.uint8))
    with open_events(tmp_path / "a.raw") as reader:
        assert not reader.labelled
        assert "labels in a.raw.labels.npy ignored: 299 labels for 300 events" in reader.notes


def test_labels_follow_their_events_when_a_file_is_sorted(saved: Save, tmp_path: Path) -> None:
    path = saved("a.csv", "x,y,p,t_us\n1,0,1,30\n2,0,1,10\n3,0,1,20\n")
    np.save(tmp_path / "a.csv.labels.npy", np.array([0, 1, 2], np.uint8))
    for events in (read_events(path), next(iter(open_events(path)))):
        assert events.label is not None
        assert (events.x.tolist(), events.label.tolist()) == ([2, 3, 1], [1, 2, 0])


def test_labels_that_are_none_are_one_clear_line(saved: Save, tmp_path: Path) -> None:
    path = saved("a.csv", "x,y,p,t_us\n1,0,1,30\n")
    (tmp_path / "a.csv.labels.npy").write_bytes(b"nonsense")
    with pytest.raises(InputError, match=r"a\.csv\.labels\.npy: byte 0"):
        open_events(path)
    np.save(tmp_path / "a.csv.labels.npy", np.zeros(1))
    with pytest.raises(InputError, match="uint8"):
        open_events(path)
    np.save(tmp_path / "a.csv.labels.npy", np.array([3], np.uint8))
    with pytest.raises(InputError, match="label is 3"):
        read_events(path)


def test_each_iteration_starts_again(tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]) -> None:
    events = stream(n=300)
    write_events(tmp_path / "a.raw", events)
    with open_events(tmp_path / "a.raw", chunk_events=50) as reader:
        next(iter(reader))
        assert same(Events.concatenate(list(reader)), events)
        assert same(reader.read(), events)


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc to count open files")
def test_leaving_the_block_closes_the_file_in_the_middle_of_a_stream(
    tmp_path: Path, stream: Callable[..., Events]
) -> None:
    for name in ("a.npz", "a.npy", "a.csv", "a.raw"):
        write_events(tmp_path / name, stream(n=300))
        before = len(os.listdir("/proc/self/fd"))
        with open_events(tmp_path / name, chunk_events=10) as reader:
            chunks = iter(reader)
            next(chunks)
        assert len(os.listdir("/proc/self/fd")) == before


def test_a_unit_that_the_format_has_itself_is_not_overridden(tmp_path: Path, stream: Callable[..., Events]) -> None:
    write_events(tmp_path / "a.raw", stream())
    with open_events(tmp_path / "a.raw", time_unit="s") as reader:
        assert reader.time_unit == "us"
        assert any("s as declared is not used" in note for note in reader.notes)


def test_places_that_are_no_files_are_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        open_events(tmp_path / "none.npz")
    with pytest.raises(InputError, match="is a folder"):
        open_events(tmp_path)
    (tmp_path / "empty.npz").touch()
    with pytest.raises(InputError, match="empty"):
        open_events(tmp_path / "empty.npz")
    with pytest.raises(InputError, match="cannot be read"):
        open_events("a\0b")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in the file system here")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="pipe"):
        open_events(tmp_path / "pipe.csv")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="the super-user may read everything")
def test_a_file_that_may_not_be_read_is_one_clear_line(saved: Save) -> None:
    path = saved("a.csv", "x,y,p,t_us\n1,0,1,30\n")
    path.chmod(0)
    with pytest.raises(InputError, match="permission denied"):
        open_events(path)


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (b"\x93NUMPY\x01\x00", "npy"),
        (b"PK\x03\x04", "npz"),
        (b"#!AER-DAT2.0\r\n", "aedat2"),
        (b"#!AER-DAT4.0\r\n", "aedat4"),
        (b"\x89HDF\r\n\x1a\n", "hdf5"),
        (b"#ROSBAG V2.0\n", "rosbag"),
        (b"% evt 3.0\n\x00\x01", "evt3"),
        (b"% evt 2.0\n\x00\x01", "evt2"),
        (b"% format EVT3;height=720;width=1280\n% end\n", "evt3"),
        (b"% Data file containing CD events\n% Version 2\n\x0c\x08", "dat"),
        (b"1 2 3 1\n", "text"),
        (b"# x,y,p,t\n", "text"),
        (b"% a comment of a text file\n1 2 3 1\n", "text"),
    ],
)
@pytest.mark.parametrize("suffix", [".npz", ".raw", ".csv", ".bin"])
def test_the_header_decides_whatever_the_suffix_says(content: bytes, name: str, suffix: str, saved: Save) -> None:
    assert sniff(saved(f"a{suffix}", content)) == name


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("a.raw", b"\x00\x01\x02\x03", "--format evt2 or evt3"),
        ("a.raw", b"% Date 2020-01-01\n\x00\x01", "--format evt2 or evt3"),
        ("a.dat", b"\x00\x01\x02\x03", "--format dat"),
        ("a.bin", b"\x00\x01\x02\x03", "expected NPZ, NPY"),
        ("a.raw", b"% evt 2.1\n\x00\x01", "EVT21 is not read"),
        ("a.raw", b"% evt 7.0\n\x00\x01", "'evt7' is not known"),
        ("a.aedat", b"#!AER-DAT3.1\r\n", "'3.1' is not read"),
    ],
)
def test_what_is_not_read_is_named_with_a_way_out(name: str, content: bytes, problem: str, saved: Save) -> None:
    with pytest.raises(InputError) as caught:
        open_events(saved(name, content))
    assert problem in str(caught.value)


def test_a_declared_format_reads_data_without_a_header(saved: Save) -> None:
    words = np.array([0x80000001, 0x10000000 | 5 << 11 | 6], "<u4").tobytes()
    events = read_events(saved("a.raw", words), format="evt2")
    assert (events.t.tolist(), events.x.tolist(), events.y.tolist()) == ([64], [5], [6])


@pytest.mark.parametrize(
    ("option", "value"),
    [("width", 0), ("height", 65_537), ("time_unit", "h"), ("columns", "xyz"), ("chunk_events", 0)],
)
def test_a_declaration_that_cannot_be_meant_is_a_usage_error(option: str, value: object) -> None:
    with pytest.raises(ConfigError, match=str(value)):
        ReadOptions(**{option: value})  # type: ignore[arg-type]


def test_an_unknown_format_is_a_usage_error(saved: Save) -> None:
    with pytest.raises(ConfigError, match="'evt9'"):
        open_events(saved("a.raw", b"1"), format="evt9")
