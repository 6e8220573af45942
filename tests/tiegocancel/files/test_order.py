"""A slightly unsorted stream is put in order; one that is worse is refused with the way out."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import Events, InputError, open_events, read_events
from tiegocancel.files.block import Block
from tiegocancel.files.order import ReorderWindow


def block(times: list[int], tag: int = 0) -> Block:
    n = len(times)
    index = np.arange(tag, tag + n)
    return Block(np.array(times, np.int64), index, index, np.ones(n, np.uint8), lambda i: f"row {tag + i}")


@given(
    base=st.lists(st.integers(0, 50), max_size=120),
    shift=st.lists(st.integers(0, 3), min_size=120, max_size=120),
    chunk=st.integers(1, 20),
    size=st.integers(1, 30),
)
def test_rows_leave_in_stable_order_or_are_named_as_too_late(
    base: list[int], shift: list[int], chunk: int, size: int
) -> None:
    times = [t - s for t, s in zip(sorted(base), shift, strict=False)]
    window = ReorderWindow(chunk)
    out: list[Block] = []
    kept = len(times)
    for start in range(0, len(times), size):
        late = window.push(block(times[start : start + size], start))
        out += window.ready()
        if late is not None:
            kept = start + late
            break
    out += window.rest()
    expected = sorted(range(kept), key=lambda i: times[i])
    assert [int(i) for part in out for i in part.x] == expected
    assert all(len(part) == chunk for part in out[:-1])
    assert window.late == sum(t < max(times[: i + 1]) for i, t in enumerate(times[:kept]))


def save_rows(path: Path, times: list[int]) -> Path:
    np.savez(
        path, t=np.array(times), x=np.zeros(len(times), int), y=np.arange(len(times)) % 4, p=np.ones(len(times), int)
    )
    return path


def test_a_late_event_within_the_window_is_sorted_and_counted(tmp_path: Path) -> None:
    path = save_rows(tmp_path / "a.npz", [0, 10, 20, 5, 30, 40])
    with open_events(path, chunk_events=4) as reader:
        assert Events.concatenate(list(reader)).t.tolist() == [0, 5, 10, 20, 30, 40]
    assert "1 events out of order, sorted by time" in reader.notes


def test_a_later_event_is_refused_with_the_way_out_after_the_events_before_it(tmp_path: Path) -> None:
    n = 200_000
    path = save_rows(tmp_path / "a.npz", [*range(n), 3])
    chunks: list[Events] = []
    with (
        open_events(path, chunk_events=1000) as reader,
        pytest.raises(InputError, match=r"row 200000: .*--sort") as caught,
    ):
        chunks.extend(reader)
    assert "\n" not in str(caught.value)
    assert sum(map(len, chunks)) == n
    with open_events(path, chunk_events=1000, keep_going=True) as reader:
        assert sum(map(len, reader)) == n
    assert reader.faults == 1


def test_reading_whole_sorts_over_any_distance(tmp_path: Path, stream: Callable[..., Events]) -> None:
    n = 100_000
    path = save_rows(tmp_path / "a.npz", list(range(n, 0, -1)))
    events = read_events(path, chunk_events=10)
    assert events.t.tolist() == list(range(1, n + 1))
    with open_events(path) as reader:
        reader.read()
    assert f"{n - 1} events out of order, sorted by time" in reader.notes


def test_equal_times_keep_their_order() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.npz"
        np.savez(path, t=[5, 5, 1, 5, 1], x=[0, 1, 2, 3, 4], y=[0] * 5, p=[1] * 5)
        assert read_events(path).x.tolist() == [2, 4, 0, 1, 3]
        assert Events.concatenate(list(open_events(path, chunk_events=2))).x.tolist() == [2, 4, 0, 1, 3]
