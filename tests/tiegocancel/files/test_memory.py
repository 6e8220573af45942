"""A large file is read, and a large stream written, in memory that does not grow with it."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import Events, open_events, open_writer

CHUNK = 50_000
MEBIBYTE = 1 << 20


@contextmanager
def peak_below(limit_bytes: int) -> Iterator[None]:
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < limit_bytes
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(("name", "chunks"), [("a.npz", 90), ("a.npy", 90), ("a.raw", 290)])
def test_memory_is_bounded(name: str, chunks: int, tmp_path: Path, stream: Callable[..., Events]) -> None:
    chunk = stream(n=CHUNK, step_us=1)
    path = tmp_path / name
    span = chunk.span_us + 1
    with peak_below(16 * MEBIBYTE), open_writer(path, width=64, height=48) as writer:
        for i in range(chunks):
            writer.write(Events(chunk.t + i * span, chunk.x, chunk.y, chunk.p, 64, 48))
    assert path.stat().st_size > 55 * MEBIBYTE
    # A size that is not declared makes an NPY be scanned first: that must not hold it either.
    with peak_below(16 * MEBIBYTE), open_events(path, chunk_events=CHUNK) as reader:
        assert sum(len(part) for part in reader) == CHUNK * chunks


def test_a_sparse_array_larger_than_memory_is_read_from_its_start(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    rows = 1 << 38
    text = f"{{'descr': '<i8', 'fortran_order': False, 'shape': ({rows}, 4), }}".encode().ljust(117) + b"\n"
    with path.open("wb") as file:
        file.write(b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text)
        try:
            file.truncate(128 + rows * 32)
        except OSError:
            pytest.skip("the file system holds no sparse file of 8 TiB")
    with (
        peak_below(32 * MEBIBYTE),
        open_events(path, width=4, height=4, time_unit="us", columns="txyp", chunk_events=CHUNK) as reader,
    ):
        first = next(iter(reader))
    assert (len(first), np.unique(first.t).tolist()) == (CHUNK, [0])
