"""NPZ archives of other tools, and broken ones."""

from __future__ import annotations

import io
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiegocancel import Events, InputError, open_events, read_events, write_events


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


@pytest.mark.parametrize("odd", [np.nan, 0.5])
def test_an_odd_polarity_is_named_and_the_rows_before_it_are_kept(
    odd: float, tmp_path: Path, stream: Callable[..., Events]
) -> None:
    e = stream()
    p = np.where(e.p == 1, 1.0, -1.0)
    p[300] = odd
    np.savez(tmp_path / "a.npz", t=e.t, x=e.x, y=e.y, p=p, width=64, height=48)
    with pytest.raises(InputError, match=f"row 300: p is {odd}, expected a polarity"):
        read_events(tmp_path / "a.npz")
    assert np.array_equal(read_events(tmp_path / "a.npz", keep_going=True).p, e.p[:300])


def test_an_odd_polarity_does_not_decide_what_an_off_event_is(tmp_path: Path, stream: Callable[..., Events]) -> None:
    e = stream(n=4)
    np.savez(tmp_path / "a.npz", t=e.t, x=e.x, y=e.y, p=np.array([1.0, 1.0, 0.5, -1.0]))
    with pytest.raises(InputError, match=r"row 2: p is 0\.5"):
        read_events(tmp_path / "a.npz")


@pytest.mark.parametrize("precision", [np.float16, np.longdouble])
def test_numbers_of_any_precision_are_read_without_a_warning(precision: type[np.floating[Any]], tmp_path: Path) -> None:
    huge = np.finfo(precision).max
    columns = {"t": [1, 2, 3], "x": [1, 5, huge], "y": [3, 4, 5], "p": [1, 0, 1]}
    np.savez(tmp_path / "a.npz", **{key: np.array(value, precision) for key, value in columns.items()})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        events = read_events(tmp_path / "a.npz", time_unit="us", width=9, height=9, keep_going=True)
    assert (events.t.tolist(), events.x.tolist()) == ([1, 2], [1, 5])


def test_a_size_beyond_all_bounds_is_a_short_line(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", t=[1], x=[1], y=[1], p=[1], width=1e300, height=3)
    with pytest.raises(InputError, match=r"width is 1000.* expected 1 to") as caught:
        open_events(tmp_path / "a.npz")
    assert len(caught.value.problem) < 150


@pytest.mark.parametrize("structured", [True, False])
@pytest.mark.parametrize("beside", [True, False])
def test_one_array_of_rows_may_have_size_and_labels_beside_it(
    structured: bool, beside: bool, tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    e = stream(labelled=beside)
    rows = e.to_structured() if structured else np.stack([e.x, e.y, e.p, e.t], axis=1).astype(np.int64)
    extras = {"label": e.label} if beside else {}
    np.savez(tmp_path / "a.npz", events=rows, width=70, height=50, **extras)
    with open_events(tmp_path / "a.npz", time_unit="us", chunk_events=90) as reader:
        assert (reader.width, reader.height, reader.labelled, reader.format) == (70, 50, beside, "npz")
        assert same(Events.concatenate(list(reader)), e)
        assert same(reader.read(), e)


def test_labels_beside_rows_follow_them(tmp_path: Path) -> None:
    # Rows of the thesis with flag 1 are left out, and long rows are read fewer at a time.
    rows = np.array([[5, 6, 1, 0.25, 0], [1, 1, 0, 0.5, 1], [7, 8, 0, 0.75, 0]], np.float32)
    np.savez(tmp_path / "a.npz", slice=rows, label=[0, 1, 2])
    assert read_events(tmp_path / "a.npz").label.tolist() == [0, 2]
    n = 3000
    long = np.zeros(n, [("t", "<u8"), ("x", "<u2"), ("y", "<u2"), ("on", "?"), ("more", "V9000")])
    long["t"] = np.arange(n)
    label = np.arange(n) % 3
    np.savez_compressed(tmp_path / "b.npz", events=long, label=label)
    assert np.array_equal(read_events(tmp_path / "b.npz").label, label)


@pytest.mark.parametrize("label", [[0, 1], [[0]] * 500, ["a"] * 500])
def test_labels_that_do_not_fit_the_rows_are_one_clear_line(
    label: list[Any], tmp_path: Path, stream: Callable[..., Events]
) -> None:
    np.savez(tmp_path / "a.npz", events=stream().to_structured(), label=label)
    with pytest.raises(InputError, match=r"label\.npy.*expected") as caught:
        open_events(tmp_path / "a.npz")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "arrays",
    [{"t": [], "x": [], "y": [], "p": []}, {"events": np.zeros((0, 4))}, {"events": np.zeros(0, "f8,f8,f8,f8")}],
)
def test_an_empty_recording_needs_no_unit(arrays: dict[str, Any], tmp_path: Path) -> None:
    if "events" in arrays and arrays["events"].dtype.names:
        arrays["events"].dtype.names = tuple("txyp")
    np.savez(tmp_path / "a.npz", **arrays)
    events = read_events(tmp_path / "a.npz", width=30, height=20)
    assert (len(events), events.width, events.height) == (0, 30, 20)


@pytest.mark.parametrize("keep_going", [True, False])
def test_a_torn_archive_says_that_nothing_can_be_kept_and_what_can_be_done(
    keep_going: bool, tmp_path: Path, stream: Callable[..., Events]
) -> None:
    write_events(tmp_path / "a.npz", stream())
    content = (tmp_path / "a.npz").read_bytes()
    (tmp_path / "a.npz").write_bytes(content[:-400])
    with pytest.raises(InputError, match=rf"byte {len(content) - 400}: torn archive.*a\.npz\.spool\.npy") as caught:
        read_events(tmp_path / "a.npz", keep_going=keep_going)
    assert "--keep-going" in caught.value.problem
    assert "\n" not in str(caught.value)


def test_a_fault_inside_a_column_keeps_the_rows_before_it(tmp_path: Path) -> None:
    n = 300_000
    write_events(tmp_path / "a.npz", Events(np.arange(n), np.arange(n) % 60, np.zeros(n, int), np.ones(n, int), 64, 48))
    content = bytearray((tmp_path / "a.npz").read_bytes())
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        place = archive.getinfo("p.npy").header_offset
    content[place + 30 + 5 + 20 + 256 + 290_000] ^= 1
    (tmp_path / "a.npz").write_bytes(content)
    with open_events(tmp_path / "a.npz", keep_going=True) as reader:
        kept = reader.read()
    assert len(kept) >= 4 << 16
    assert np.array_equal(kept.t, np.arange(len(kept)))
    assert reader.faults == 1
