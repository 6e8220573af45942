"""NPZ archives of other tools, and broken ones."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiegocancel import Events, InputError, open_events, read_events


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_archives_of_numpy_are_read(
    save: Callable[..., None], tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    e = stream(labelled=True)
    save(tmp_path / "a.npz", t=e.t, x=e.x, y=e.y, p=e.p, label=e.label, width=70, height=50, other=np.array("text"))
    with open_events(tmp_path / "a.npz") as reader:
        assert (reader.width, reader.height, reader.labelled, reader.format) == (70, 50, True, "npz")
        assert same(reader.read(), e)


def test_polarity_of_minus_one_and_boolean_polarity_are_understood(
    tmp_path: Path, stream: Callable[..., Events]
) -> None:
    e = stream()
    for p in (np.where(e.p == 1, 1, -1), e.p.astype(bool), e.p.astype(np.float64)):
        np.savez(tmp_path / "a.npz", t=e.t, x=e.x, y=e.y, p=p)
        assert np.array_equal(read_events(tmp_path / "a.npz").p, e.p)


def test_fractional_times_need_their_unit(tmp_path: Path, stream: Callable[..., Events]) -> None:
    e = stream()
    np.savez(tmp_path / "a.npz", t=e.t / 1e6, x=e.x, y=e.y, p=e.p)
    with pytest.raises(InputError, match="--time-unit"):
        open_events(tmp_path / "a.npz")
    assert np.array_equal(read_events(tmp_path / "a.npz", time_unit="s").t, e.t)


@pytest.mark.parametrize("structured", [True, False])
def test_a_single_array_is_read_as_an_npy(
    structured: bool, tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    e = stream()
    rows = e.to_structured() if structured else np.stack([e.x, e.y, e.p, e.t], axis=1).astype(np.int64)
    np.savez_compressed(tmp_path / "a.npz", events=rows)
    assert same(read_events(tmp_path / "a.npz", time_unit="us"), e)


def test_a_declared_size_that_is_too_small_is_named_by_the_row(tmp_path: Path, stream: Callable[..., Events]) -> None:
    e = stream()
    np.savez(tmp_path / "a.npz", t=e.t, x=e.x, y=e.y, p=e.p)
    row = int(np.argmax(e.x >= 20))
    with pytest.raises(InputError, match=rf"row {row}: x is {e.x[row]}, expected 0 to 19 on a sensor of 20x48 px"):
        read_events(tmp_path / "a.npz", width=20, height=48)


@pytest.mark.parametrize(
    ("arrays", "problem"),
    [
        ({"t": [1], "x": [1], "y": [1]}, "found t, x, y"),
        ({"t": [1, 2], "x": [1], "y": [1], "p": [1]}, "one length"),
        ({"t": [[1]], "x": [[1]], "y": [[1]], "p": [[1]]}, "one number an event"),
        ({"t": ["a"], "x": [1], "y": [1], "p": [1]}, "numbers"),
        ({"t": [1], "x": [1], "y": [1], "p": [1], "width": [1, 2], "height": 3}, "one whole number"),
        ({"t": [1], "x": [1], "y": [1], "p": [1], "width": 0, "height": 3}, "width is 0"),
        ({"t": [1], "x": [1], "y": [1], "p": [1], "width": 3, "height": 10**9}, "height is 1000000000"),
        ({"t": [1], "x": [1], "y": [1], "p": [1], "label": [3]}, "label is 3"),
        ({"t": np.array([2**63], np.uint64), "x": [1], "y": [1], "p": [1]}, "2^60"),
        (dict.fromkeys("txyp", np.zeros(0, np.int64)), "--width"),
    ],
)
def test_arrays_that_are_no_events_are_one_clear_line(arrays: dict[str, Any], problem: str, tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **{name: np.asarray(value) for name, value in arrays.items()})
    with pytest.raises(InputError) as caught:
        read_events(tmp_path / "a.npz")
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_member_that_claims_more_than_it_holds_is_refused(tmp_path: Path) -> None:
    text = b"{'descr': '<i8', 'fortran_order': False, 'shape': (1000000000000,), }".ljust(117) + b"\n"
    head = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        for name in "txyp":
            archive.writestr(f"{name}.npy", head)
    with pytest.raises(InputError, match="expected 8000000000000"):
        read_events(tmp_path / "a.npz")


def test_a_broken_archive_is_one_clear_line(tmp_path: Path, stream: Callable[..., Events]) -> None:
    e = stream()
    buffer = io.BytesIO()
    np.savez_compressed(buffer, t=e.t, x=e.x, y=e.y, p=e.p)
    content = buffer.getvalue()
    for broken in (content[:100], content[:-30], b"PK\x03\x04", b"PK\x05\x06" + b"\0" * 18):
        (tmp_path / "a.npz").write_bytes(broken)
        with pytest.raises(InputError) as caught:
            read_events(tmp_path / "a.npz")
        assert "\n" not in str(caught.value)
