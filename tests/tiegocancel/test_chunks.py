"""Chunks of one size come out, whatever came in."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import Events, InputError
from tiegocancel.chunks import rechunk


def stream(count: int) -> Events:
    return Events(np.arange(count), np.arange(count), np.zeros(count, int), np.ones(count, int), 1000, 1)


@given(st.lists(st.integers(0, 30), max_size=12), st.integers(1, 40))
def test_every_event_comes_out_once_in_chunks_of_the_size(lengths: list[int], size: int) -> None:
    whole = stream(sum(lengths))
    cuts = np.cumsum([0, *lengths])
    chunks = list(rechunk((whole[a:b] for a, b in itertools.pairwise(cuts)), size))
    assert [len(chunk) for chunk in chunks[:-1]] == [size] * max(len(chunks) - 1, 0)
    assert [x for chunk in chunks for x in chunk.x.tolist()] == whole.x.tolist()
    assert all(len(chunk) for chunk in chunks)


def test_what_came_before_a_fault_is_yielded_before_the_fault() -> None:
    def broken() -> Iterator[Events]:
        yield stream(5)
        raise InputError("f", "byte 9", "torn")

    chunks = rechunk(broken(), 100)
    assert len(next(chunks)) == 5
    with pytest.raises(InputError, match="byte 9"):
        next(chunks)
