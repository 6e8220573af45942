"""NPY arrays: structured rows, plain columns, the thesis's slice; hostile headers."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiegocancel import Events, InputError, open_events, read_events

Save = Callable[..., Path]


def plain(events: Events, order: str = "txyp") -> np.ndarray[Any, Any]:
    return np.stack([getattr(events, name).astype(np.int64) for name in order], axis=1)


@pytest.mark.parametrize("polarity", ["on", "p", "polarity"])
def test_structured_rows_are_read_by_field_name(
    polarity: str, tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream()
    # Prophesee's order and types, another tool's padding.
    dtype = np.dtype({"names": ["x", "y", polarity, "t"], "formats": ["<u2", "<u2", "<i2", "<i8"], "itemsize": 24})
    rows = np.zeros(len(events), dtype)
    rows["x"], rows["y"], rows[polarity], rows["t"] = events.x, events.y, events.p, events.t
    np.save(tmp_path / "a.npy", rows)
    with open_events(tmp_path / "a.npy") as reader:
        assert same(reader.read(), events)
        assert any(note.startswith("time unit: us") for note in reader.notes)
        assert any("64x48" in note for note in reader.notes)


@pytest.mark.parametrize("order", ["xypt", "txyp"])
@pytest.mark.parametrize("fortran", [False, True])
@pytest.mark.parametrize("dtype", ["<i8", ">i4", "<f8"])
def test_plain_columns_are_told_apart_by_content(
    order: str, fortran: bool, dtype: str, tmp_path: Path, stream: Callable[..., Events], same: Callable[..., bool]
) -> None:
    events = stream(n=300)
    rows = plain(events, order).astype(dtype)
    np.save(tmp_path / "a.npy", np.asfortranarray(rows) if fortran else rows)
    with open_events(tmp_path / "a.npy", time_unit="us", chunk_events=70) as reader:
        assert same(Events.concatenate(list(reader)), events)
        assert f"columns {','.join(order)}, decided by content" in reader.notes


def test_plain_columns_without_a_unit_are_refused_with_the_flag(tmp_path: Path, stream: Callable[..., Events]) -> None:
    np.save(tmp_path / "a.npy", plain(stream()))
    with pytest.raises(InputError, match="--time-unit"):
        open_events(tmp_path / "a.npy")


def test_plain_columns_that_fit_both_orders_are_refused_with_the_flag(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.ones((5, 4), np.int64))
    with pytest.raises(InputError, match="--columns"):
        open_events(tmp_path / "a.npy", time_unit="us")
    assert len(read_events(tmp_path / "a.npy", time_unit="us", columns="txyp")) == 5


def test_seconds_in_float32_round_to_the_nearest_microsecond(tmp_path: Path) -> None:
    rows = np.array([[5, 6, 1, 8.393328, 0], [7, 8, 0, 8.39333, 0], [1, 1, 0, 8.395, 1]], np.float32)
    np.save(tmp_path / "a.npy", rows)
    with open_events(tmp_path / "a.npy") as reader:
        events = reader.read()
        assert reader.time_unit == "s"
        assert any("predictions" in note for note in reader.notes)
    assert events.t.tolist() == [8393328, 8393330]
    assert events.x.tolist() == [5, 7]


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_float64_times_in_any_unit_come_back_exactly(unit: str, tmp_path: Path) -> None:
    per_microsecond = {"s": 1e6, "ms": 1e3, "us": 1.0}
    t = np.sort(np.random.default_rng(1).integers(0, 4_000_000_000_000_000, 2000))
    times = t * 1e3 if unit == "ns" else t / per_microsecond[unit]
    rows = np.stack([times, np.arange(2000) % 7, np.arange(2000) % 5, np.arange(2000) % 2], axis=1)
    np.save(tmp_path / "a.npy", rows)
    assert np.array_equal(read_events(tmp_path / "a.npy", time_unit=unit).t, t)


@pytest.mark.parametrize(
    ("column", "value", "problem"),
    [(0, np.nan, "finite"), (0, np.inf, "finite"), (1, 2.5, "whole"), (1, -1, "x is -1"), (3, 3, "polarity")],
)
def test_a_fault_is_named_by_its_row_after_the_rows_before_it(
    column: int, value: float, problem: str, tmp_path: Path, stream: Callable[..., Events]
) -> None:
    rows = plain(stream(n=5000)).astype(np.float64)
    rows[4321, column] = value
    np.save(tmp_path / "a.npy", rows)
    options: dict[str, Any] = {"time_unit": "us", "columns": "txyp", "width": 64, "height": 48}
    chunks: list[Events] = []
    with open_events(tmp_path / "a.npy", **options) as reader, pytest.raises(InputError, match="row 4321") as caught:
        chunks.extend(reader)
    assert sum(map(len, chunks)) == 4321
    assert problem in str(caught.value)


def npy_bytes(array: np.ndarray[Any, Any], **options: Any) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, array, **options)
    return buffer.getvalue()


def header(text: str) -> bytes:
    padded = text.encode("latin-1").ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(padded).to_bytes(2, "little") + padded


@pytest.mark.parametrize(
    "content",
    [
        b"\x93NUMPY",
        b"\x93NUMPY\x09\x00\x10\x00",
        b"\x93NUMPY\x02\x00\xff\xff\xff\xff",
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (4611686018427387904, 4), }"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 4), }"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (True, 4), }"),
        header("{'descr': '<f8', 'fortran_order': False}"),
        header("{'descr': '|V0', 'fortran_order': False, 'shape': (9, 4), }"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (), }"),
        header("{'descr': 'nonsense', 'fortran_order': False, 'shape': (1, 4), }"),
        header("{'descr': [('t', '<u8')], 'fortran_order': False, 'shape': (0,), }"),
        header("{'descr': '|O', 'fortran_order': False, 'shape': (1, 4), }") + b"\0" * 32,
        header("__import__('os').abort()"),
        header("(" * 110),
        header("[] + 1"),
        npy_bytes(np.zeros((3, 3))),
        npy_bytes(np.zeros((3, 4), np.complex128)),
        npy_bytes(np.zeros((3, 4), "U3")),
        npy_bytes(np.zeros((2, 3, 4))),
        npy_bytes(np.zeros(3, [("t", "<u8"), ("x", "<u2", (2,)), ("y", "<u2"), ("on", "?")])),
    ],
)
def test_a_hostile_or_useless_array_is_one_clear_line(content: bytes, saved: Save) -> None:
    with pytest.raises(InputError) as caught:
        read_events(saved("a.npy", content), time_unit="us", columns="txyp")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400 + len(caught.value.path)


def test_objects_are_never_unpickled(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{"t": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="objects"):
        open_events(tmp_path / "a.npy")


def test_a_truncated_array_is_named_by_its_size(tmp_path: Path, stream: Callable[..., Events], saved: Save) -> None:
    content = npy_bytes(stream().to_structured())
    with pytest.raises(InputError, match=rf"byte {len(content) - 5}: ends after"):
        open_events(saved("a.npy", content[:-5]))


@pytest.mark.parametrize(
    "shape", ["(0x1" + "0" * 4000 + ", 4)", "(9223372036854775808,)", "(" + "1, " * 65 + ")", "(" + "9" * 5000 + ", 4)"]
)
def test_an_absurd_shape_is_no_fault_of_an_archive(shape: str, saved: Save) -> None:
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}".encode().ljust(117) + b"\n"
    content = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
    with pytest.raises(InputError, match=r"header: .*shape") as caught:
        open_events(saved("a.npy", content))
    assert "ZIP" not in str(caught.value)
    assert len(caught.value.problem) < 200


def test_a_product_of_sides_that_is_absurd_is_a_short_line(saved: Save) -> None:
    sides = ", ".join(["4611686018427387904"] * 60)
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({sides})}}".encode() + b"\n"
    content = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
    with pytest.raises(InputError, match="ends after 0 bytes") as caught:
        open_events(saved("a.npy", content))
    assert len(caught.value.problem) < 300


def test_unsigned_columns_are_told_apart_by_content(tmp_path: Path) -> None:
    # Read as x, y, p, t the times would fall: 5, 3, 1.
    # Both orders fit, and the times of x, y, p, t would be 0, 1, 0.
    np.save(tmp_path / "a.npy", np.array([[5, 1, 1, 0], [6, 2, 1, 1], [7, 3, 0, 0]], np.uint64))
    assert read_events(tmp_path / "a.npy", time_unit="us").t.tolist() == [5, 6, 7]
