"""What is written comes back, whole and in chunks, in every format."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import ConfigError, Events, open_events, open_writer, read_events, write_events
from tiegocancel.files import WRITABLE

FORMATS = sorted(WRITABLE)


@given(
    seed=st.integers(0, 2**32),
    n=st.integers(1, 400),
    start_us=st.sampled_from([0, 1, 63, 2**33, 2**34 - 30_000]),
    step_us=st.sampled_from([0, 1, 60]),
    cuts=st.lists(st.integers(0, 400), max_size=4),
    chunk_events=st.integers(1, 450),
    labelled=st.booleans(),
    name=st.sampled_from(FORMATS),
)
@settings(max_examples=150)
def test_round_trip(
    seed: int,
    n: int,
    start_us: int,
    step_us: int,
    cuts: list[int],
    chunk_events: int,
    labelled: bool,
    name: str,
    stream: Callable[..., Events],
    same: Callable[..., bool],
) -> None:
    events = stream(seed, n, start_us=start_us, step_us=step_us, labelled=labelled)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recording.bin"
        with open_writer(path, width=64, height=48, labelled=labelled, format=name) as writer:
            bounds = [0, *sorted(cuts), n]
            for first, last in pairwise(bounds):
                writer.write(events[first:last])
        assert writer.count == n
        options: dict[str, Any] = {"width": 64, "height": 48}
        assert same(read_events(path, **options), events)
        with open_events(path, chunk_events=chunk_events, **options) as reader:
            assert reader.labelled == labelled
            chunks = list(reader)
        assert all(len(chunk) <= chunk_events for chunk in chunks)
        assert same(Events.concatenate(chunks), events)


@pytest.mark.parametrize("name", ["npz", "npy", "csv"])
def test_times_far_from_zero(
    name: str, tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(start_us=2**59)
    write_events(tmp_path / "far", events, format=name)
    assert same(read_events(tmp_path / "far"), events)


@pytest.mark.parametrize("name", ["npz", "csv"])
def test_times_below_zero(name: str, tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]) -> None:
    events = stream(start_us=-5000)
    write_events(tmp_path / "early", events, format=name)
    assert same(read_events(tmp_path / "early"), events)


@pytest.mark.parametrize(("name", "start_us"), [("npy", -1), ("evt2", -1), ("evt2", 2**34)])
def test_a_time_the_format_cannot_hold_is_refused(
    name: str, start_us: int, tmp_path: Path, stream: Callable[..., Events]
) -> None:
    with pytest.raises(ConfigError, match="write NPZ or CSV"):
        write_events(tmp_path / "file", stream(start_us=start_us, n=3, step_us=0), format=name)


def test_a_sensor_too_large_for_evt2_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="2048x2048"):
        open_writer(tmp_path / "a.raw", width=2049, height=10)
    assert not (tmp_path / "a.raw").exists()


@pytest.mark.parametrize("name", FORMATS)
def test_an_exception_in_the_body_keeps_what_was_written(
    name: str, tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(labelled=True)
    path = tmp_path / "file"

    def stop_in_the_middle() -> None:
        with open_writer(path, width=64, height=48, labelled=True, format=name) as writer:
            writer.write(events[:200])
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        stop_in_the_middle()
    assert same(read_events(path, width=64, height=48), events[:200])


@pytest.mark.parametrize("name", ["npy", "csv", "evt2"])
def test_a_writer_that_never_closes_leaves_every_chunk(
    name: str, tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(labelled=True)
    writer = open_writer(tmp_path / "file", width=64, height=48, labelled=True, format=name)
    writer.write(events[:200])
    assert same(read_events(tmp_path / "file", width=64, height=48), events[:200])
    writer.close()


def test_a_killed_npz_writer_leaves_a_spool_that_is_a_recording(
    tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(labelled=True)
    writer = open_writer(tmp_path / "a.npz", width=64, height=48, labelled=True)
    writer.write(events[:200])
    assert not (tmp_path / "a.npz").exists()
    assert same(read_events(tmp_path / "a.npz.spool.npy", width=64, height=48), events[:200])
    # The way out that the documentation names reads the spool while it writes the archive of that name.
    with (
        open_events(tmp_path / "a.npz.spool.npy", width=64, height=48) as reader,
        open_writer(tmp_path / "a.npz", width=64, height=48, labelled=True) as second,
    ):
        for chunk in reader:
            second.write(chunk)
    assert same(read_events(tmp_path / "a.npz"), events[:200])
    writer.close()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.npz"]


def test_numpy_reads_an_npz(tmp_path: Path, stream: Callable[..., Events]) -> None:
    events = stream(labelled=True)
    write_events(tmp_path / "a.npz", events)
    with np.load(tmp_path / "a.npz") as arrays:
        assert sorted(arrays) == ["height", "label", "p", "t", "width", "x", "y"]
        assert (int(arrays["width"]), int(arrays["height"])) == (64, 48)
        for name in ("t", "x", "y", "p", "label"):
            assert arrays[name].dtype == getattr(events, name).dtype
            assert np.array_equal(arrays[name], getattr(events, name))


def test_numpy_reads_an_npy(tmp_path: Path, stream: Callable[..., Events]) -> None:
    events = stream()
    write_events(tmp_path / "a.npy", events)
    assert np.array_equal(np.load(tmp_path / "a.npy"), events.to_structured())


@pytest.mark.parametrize("name", ["npz", "evt2"])
def test_a_stream_without_events_round_trips(name: str, tmp_path: Path) -> None:
    write_events(tmp_path / "none", Events.empty(30, 20), format=name)
    back = read_events(tmp_path / "none")
    assert (len(back), back.width, back.height) == (0, 30, 20)


def test_old_labels_do_not_stay_beside_a_new_recording(tmp_path: Path, stream: Callable[..., Events]) -> None:
    write_events(tmp_path / "a.csv", stream(labelled=True))
    assert (tmp_path / "a.csv.labels.npy").exists()
    write_events(tmp_path / "a.csv", stream())
    assert read_events(tmp_path / "a.csv").label is None


def test_chunks_that_do_not_belong_together_are_a_programmers_error(
    tmp_path: Path, stream: Callable[..., Events]
) -> None:
    with open_writer(tmp_path / "a.npz", width=64, height=48, labelled=True) as writer:
        with pytest.raises(ValueError, match="64x48"):
            writer.write(stream(width=65))
        with pytest.raises(ValueError, match="labels"):
            writer.write(stream())
        writer.write(stream(start_us=10_000, labelled=True))
        with pytest.raises(ValueError, match="decrease"):
            writer.write(stream(start_us=0, n=2, labelled=True))
    with pytest.raises(ValueError, match="closed"):
        writer.write(stream(labelled=True))


@pytest.mark.parametrize(("target", "problem"), [("a.xyz", "suffix"), ("none/a.npz", "no folder"), (".", "suffix")])
def test_a_place_that_cannot_be_written_is_one_line(target: str, problem: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=problem):
        open_writer(tmp_path / target, width=1, height=1)


def leave_at_once(path: Path, **options: Any) -> None:
    with open_writer(path, width=64, height=48, labelled=True, **options):
        raise RuntimeError("stop")


@pytest.mark.parametrize("name", FORMATS)
def test_an_exception_before_the_first_event_leaves_no_file(name: str, tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="stop"):
        leave_at_once(tmp_path / "file", format=name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", FORMATS)
def test_a_body_that_ends_without_events_leaves_a_file(name: str, tmp_path: Path) -> None:
    with open_writer(tmp_path / "file", width=64, height=48, format=name):
        pass
    assert (tmp_path / "file").stat().st_size > 0


def test_an_archive_that_could_not_be_replaced_stays(
    tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(labelled=True)
    write_events(tmp_path / "a.npz", events)
    with pytest.raises(RuntimeError, match="stop"):
        leave_at_once(tmp_path / "a.npz")
    assert same(read_events(tmp_path / "a.npz"), events)
    assert [file.name for file in tmp_path.iterdir()] == ["a.npz"]


@pytest.mark.skipif(not Path("/dev/null").exists(), reason="no /dev/null here")
def test_what_is_no_regular_file_is_never_removed(tmp_path: Path) -> None:
    (tmp_path / "link.csv").symlink_to("/dev/null")
    with pytest.raises(RuntimeError, match="stop"):
        leave_at_once(tmp_path / "link.csv")
    assert (tmp_path / "link.csv").is_symlink()


@pytest.mark.parametrize("name", FORMATS)
def test_a_writer_tells_what_its_format_cannot_hold(name: str, tmp_path: Path, stream: Callable[..., Events]) -> None:
    events = stream(width=65, height=49)[1:]
    inside = (events.x < 60) & (events.y < 40)
    events = Events(events.t[inside], events.x[inside], events.y[inside], events.p[inside], 65, 49)
    with open_writer(tmp_path / "file", width=65, height=49, format=name) as writer:
        writer.write(events)
    back = read_events(tmp_path / "file")
    assert writer.holds_size == ((back.width, back.height) == (65, 49))
    assert writer.holds_size == (not any("--width 65 --height 49" in note for note in writer.notes))
