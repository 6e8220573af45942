"""Words of EVT 3.0 as they are written: the fewest that say it, and every event comes back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import Events, read_events
from tiegocancel.files.evt3_encoding import Evt3Encoding
from tiegocancel.files.evt3_words import Evt3State, decode_words


def events_of(rows: list[tuple[int, int, int, int]]) -> Events:
    t, x, y, p = (np.array(column, np.int64) for column in zip(*rows, strict=True))
    return Events(t, x, y, p, 2048, 2048)


def decoded(words: np.ndarray) -> list[tuple[int, int, int, int]]:
    block, left_out = decode_words(words, (words >> 12).astype(np.uint8), Evt3State())
    assert left_out == 0
    return list(zip(block.t.tolist(), block.x.tolist(), block.y.tolist(), block.p.tolist(), strict=True))


def test_words_are_those_of_the_specification() -> None:
    words = Evt3Encoding().encode(events_of([(0x1234, 5, 7, 1), (0x1234, 9, 7, 0), (0x1235, 9, 8, 0)]))
    assert [f"{word:04x}" for word in words] == ["8001", "6234", "0007", "2805", "2009", "6235", "0008", "2009"]


def test_three_columns_of_a_window_make_a_vector_and_the_next_window_needs_no_base() -> None:
    row = [(0, x, 3, 1) for x in (100, 103, 111, 113, 120, 140)]
    words = Evt3Encoding().encode(events_of(row))
    # Base 100; columns 100, 103, 111; then 112 + 1 and 112 + 8; the last alone.
    assert [f"{word:04x}" for word in words[3:]] == ["3864", "4809", "4102", "288c"]
    assert decoded(words) == row


@given(
    st.lists(
        st.tuples(
            st.sampled_from([0, 0, 0, 1, 5000]), st.integers(0, 60), st.sampled_from([0, 0, 1]), st.integers(0, 3)
        ),
        min_size=1,
        max_size=80,
    ),
    st.integers(1, 80),
)
@settings(max_examples=150)
def test_any_events_in_any_chunks_come_back_in_order(steps: list[tuple[int, int, int, int]], size: int) -> None:
    t = np.cumsum([step[0] for step in steps])
    rows = [(int(time), x, y, int(p > 0)) for time, (_, x, y, p) in zip(t, steps, strict=True)]
    events = events_of(rows)
    encoding = Evt3Encoding()
    words = np.concatenate([encoding.encode(events[at : at + size]) for at in range(0, len(events), size)])
    assert decoded(words) == rows
    assert len(words) <= 4 * len(events)


def test_a_real_recording_with_vectors_takes_no_more_words_than_its_file(recording: Callable[[str], Path]) -> None:
    path = recording("driving_evt3.raw")
    events = read_events(path)
    words = Evt3Encoding().encode(events)
    assert 2 * len(words) <= path.stat().st_size
    assert [row[1:] for row in decoded(words)[::997]] == list(
        zip(*(getattr(events, name)[::997].tolist() for name in "xyp"), strict=True)
    )


def test_no_events_make_no_words() -> None:
    assert len(Evt3Encoding().encode(Events.empty(4, 4))) == 0


@pytest.mark.parametrize("start_us", [(1 << 24) - 3, 5 << 24])
def test_times_beyond_the_range_wrap(start_us: int) -> None:
    words = Evt3Encoding().encode(events_of([(start_us + step, 1, 1, 1) for step in range(6)]))
    first = start_us % (1 << 24)
    assert [row[0] for row in decoded(words)] == [first + step for step in range(6)]
