"""Events are checked once, name what is wrong, and slice without losing their order."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import EVENT_DTYPE, Events

GOOD: dict[str, Any] = {"t": [0, 5, 5], "x": [0, 1, 2], "y": [0, 1, 1], "p": [0, 1, 1], "width": 3, "height": 2}


def events(**changes: Any) -> Events:
    return Events(**{name: np.array(v) if isinstance(v, list) else v for name, v in (GOOD | changes).items()})


def test_columns_have_the_documented_types_and_cannot_be_written() -> None:
    e = events(label=[0, 1, 2])
    assert (e.t.dtype, e.x.dtype, e.y.dtype, e.p.dtype) == (np.int64, np.uint16, np.uint16, np.uint8)
    assert e.label is not None
    assert e.label.dtype == np.int8
    for part in (e, e[1:], e.select(np.array([True, False, True]))):
        for column in (part.t, part.x, part.y, part.p, part.label):
            with pytest.raises(ValueError, match="read-only"):
                column[0] = 0  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        e.width = 4  # type: ignore[misc]


def test_the_callers_own_arrays_stay_writable_and_change_nothing() -> None:
    x = np.array([0, 1, 2], np.uint16)
    e = events(x=x)
    x[0] = 9
    assert e.x.tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"x": [0, 3, 2]}, "x must be from 0 to 2: row 1 has 3"),
        ({"y": [0, 1, -1]}, "y must be from 0 to 1: row 2 has -1"),
        ({"p": [0, 2, 1]}, "p must be from 0 to 1: row 1 has 2"),
        ({"t": [0, 5, 4]}, "t must not decrease: row 2 has 4 µs after 5 µs"),
        ({"t": [0, 1, 1 << 61]}, "t must be from"),
        ({"t": [0.0, 1.0, 2.0]}, "t must be integers, not float64"),
        ({"t": [[0, 1, 2]]}, "t must be one-dimensional"),
        ({"x": [0, 1]}, "columns must have one length"),
        ({"label": [0, 1, 3]}, "label must be from 0 to 2: row 2 has 3"),
        ({"width": 0}, "width must be an integer from 1 to 65536 px, not 0"),
        ({"height": 2.5}, "height must be an integer"),
    ],
)
def test_a_broken_column_is_named_with_row_and_value(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        events(**changes)


def test_values_beyond_the_type_are_not_wrapped_into_range() -> None:
    with pytest.raises(ValueError, match="row 0 has 65536"):
        events(x=[65_536, 1, 2])


@given(st.lists(st.integers(-20, 20), max_size=40))
def test_unsorted_events_are_sorted_stably_and_counted(times: list[int]) -> None:
    index = list(range(len(times)))
    e, late = Events.from_unsorted(times, index, [0] * len(times), [0] * len(times), 64, 1)
    assert list(zip(e.t.tolist(), e.x.tolist(), strict=True)) == sorted(zip(times, index, strict=True))
    assert (late == 0) == (times == sorted(times))


def test_structured_dtype_makes_the_round_trip() -> None:
    e = events()
    rows = e.to_structured()
    assert rows.dtype == EVENT_DTYPE
    back = Events.from_structured(rows, 3, 2)
    assert back.t.tolist() == e.t.tolist()
    assert back.p.tolist() == e.p.tolist()
    with pytest.raises(ValueError, match="no times below 0"):
        events(t=[-1, 0, 0]).to_structured()
    with pytest.raises(ValueError, match="need the fields t, x, y and on"):
        Events.from_structured(np.zeros(1, [("t", "u8"), ("x", "u2")]), 3, 2)


def test_slices_share_memory_and_time_ranges_are_half_open() -> None:
    e = events()
    assert np.shares_memory(e[1:].t, e.t)
    assert len(e.between(0, 5)) == 1
    assert len(e.between(5, 6)) == 2
    assert e.span_us == 5
    assert events(t=[], x=[], y=[], p=[]).span_us == 0
    with pytest.raises(ValueError, match="step"):
        e[::-1]
    with pytest.raises(TypeError, match="takes a slice"):
        e[0]  # type: ignore[index]
    with pytest.raises(ValueError, match=r"mask must be bool\[3\]"):
        e.select(np.array([1, 0, 1]))  # type: ignore[arg-type]


def test_concatenate_joins_chunks_and_refuses_time_running_back() -> None:
    e = events(label=[0, 1, 2])
    joined = Events.concatenate([e[:1], e[1:]])
    assert joined.t.tolist() == e.t.tolist()
    assert joined.label is not None
    unlabelled = events()
    assert Events.concatenate([unlabelled[:0], e]).label is not None
    with pytest.raises(ValueError, match="either all chunks carry labels or none"):
        Events.concatenate([unlabelled[:2], e[2:]])
    with pytest.raises(ValueError, match="must not decrease"):
        Events.concatenate([e[1:], e[:1]])
    with pytest.raises(ValueError, match="one sensor size"):
        Events.concatenate([e, events(width=4)])
