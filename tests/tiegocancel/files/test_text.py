"""Text recordings: columns, units and polarities as headers, flags and content say; exact times; true row numbers."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tiegocancel import ConfigError, Events, InputError, open_events, read_events
from tiegocancel.files import text

Save = Callable[..., Path]
PER_SECOND = {"s": 1, "ms": 1_000, "us": 1_000_000, "ns": 1_000_000_000}


def columns_of(path: Path, **options: Any) -> tuple[list[int], list[int], list[int], list[int]]:
    events = read_events(path, **options)
    return events.t.tolist(), events.x.tolist(), events.y.tolist(), events.p.tolist()


EXPECTED = ([11, 50], [3, 40], [4, 5], [1, 0])


@pytest.mark.parametrize(
    "content",
    [
        "x,y,p,t_us\n3,4,1,11\n40,5,0,50\n",
        "t_us x y p\n11 3 4 1\n50 40 5 0\n",
        "# t_us,x,y,p\n11,3,4,1\n50,40,5,0\n",
        "x;y;p;t [us]\r\n3;4;1;11\r\n40;5;0;50\r\n",
        "timestamp_s\tx\ty\tpolarity\n0.000011\t3\t4\t1\n0.00005\t40\t5\t-1\n",
        "time (ms), x, y, on\n.011, 3, 4, 1\n0.050, 40, 5, 0\n",
        "t_ns x y p\n11000 3 4 1\n49500 40 5 0\n",
        "\ufeffx,y,p,t_us\n3,4,1,11\n\n# a comment\n40,5,0,50 # another\n",
        "index,x,y,p,t_us\n0,3,4,1,11\n1,40,5,0,50\n",
        "x,y,p,t_s\n3.0,4.0,1.0,1.1e-05\n4.0e1,5.0,0.0,5e-05\n",
        "x,y,p,t_us\n3,4,+1,11\n40,5,-1,50",
    ],
)
def test_headers_decide_columns_and_unit(content: str, saved: Save) -> None:
    assert columns_of(saved("a.csv", content)) == EXPECTED


@pytest.mark.parametrize(
    ("content", "options"),
    [
        ("3,4,1,11\n40,5,0,50\n", {"time_unit": "us"}),
        ("11 3 4 1\n50 40 5 0\n", {"time_unit": "us"}),
        ("0.011 3 4 1\n0.050 40 5 0\n", {"time_unit": "ms"}),
        ("11 3 4 1\n50 40 5 -1\n", {"time_unit": "us", "columns": "txyp"}),
        ("7 11 3 4 1\n7 50 40 5 0\n", {"time_unit": "us", "columns": "-txyp"}),
        ("# made by hand\n11 3 4 1\n50 40 5 0\n", {"time_unit": "us"}),
    ],
)
def test_flags_and_content_decide_where_no_header_does(content: str, options: dict[str, Any], saved: Save) -> None:
    assert columns_of(saved("a.txt", content), **options) == EXPECTED


def test_a_first_row_of_two_numbers_is_the_sensor(saved: Save) -> None:
    with open_events(saved("a.txt", "240 180\n11 3 4 1\n50 40 5 0\n"), time_unit="us") as reader:
        assert (reader.width, reader.height) == (240, 180)
        assert any("240x180" in note for note in reader.notes)


def test_the_unit_is_never_guessed_and_the_message_names_the_flag(saved: Save) -> None:
    with pytest.raises(InputError, match=r"row 1: .*'0\.5 3 4 1'.*--time-unit s") as caught:
        open_events(saved("a.txt", "0.5 3 4 1\n0.6 40 5 0\n"))
    assert "\n" not in str(caught.value)


def test_the_layout_of_public_data_sets_is_in_seconds_and_says_so(saved: Save) -> None:
    path = saved("a.txt", "0.000000011 3 4 1\n0.000011001 40 5 0\n")
    with open_events(path) as reader:
        assert reader.time_unit == "s"
        assert any("time unit: s, as public data sets write" in note for note in reader.notes)
    assert read_events(path).t.tolist() == [0, 11]
    assert open_events(path, time_unit="ms").time_unit == "ms"
    with pytest.raises(InputError, match="--time-unit"):
        open_events(saved("b.csv", "0.000000011,3,4,1\n0.000011001,40,5,0\n"))


def test_the_unit_is_always_told(saved: Save) -> None:
    path = saved("a.csv", "x,y,p,t_us\n3,4,1,11\n")
    assert "time unit: us, from the header" in open_events(path).notes
    assert "time unit: ms, as declared, although the header says us" in open_events(path, time_unit="ms").notes
    assert open_events(path, time_unit="ms").time_unit == "ms"


@pytest.mark.parametrize("content", ["0 0 0 1\n1 1 1 1\n", "1 1 1 1\n", "3 4 5 9\n6 7 8 9\n"])
def test_an_ambiguous_order_is_refused_with_the_flag(content: str, saved: Save) -> None:
    with pytest.raises(InputError, match="--columns"):
        open_events(saved("a.txt", content), time_unit="us")


def test_columns_that_do_not_fit_are_a_usage_error(saved: Save) -> None:
    with pytest.raises(ConfigError, match="5"):
        open_events(saved("a.txt", "1 2 3 1\n"), time_unit="us", columns="txyp-")


@pytest.mark.parametrize(
    ("content", "where", "problem"),
    [
        ("x,y,p,t_us\n3,4,1,11\n40,5,zero,50\n", "row 3", "'zero'"),
        ("x,y,p,t_us\n3,4,1,11\n40,5,0\n", "row 3", "4 fields"),
        ("x,y,p,t_us\n3,4,1,11\n40,,5,0,50\n", "row 3", "4 fields"),
        ("x,y,p,t_us\n3,4,1,11\n,40,0,50\n", "row 3", "number"),
        ("x,y,p,t_us\n3,4,1,11\n40 5 0 50\n", "row 3", "parted by ','"),
        ("x,y,p,t_us\n# c\n3,4,1,11\n\n40,5,2,50\n", "row 5", "polarity"),
        ("x,y,p,t_us\n3,4,0,11\n40,5,-1,50\n", "row 3", "polarity"),
        ("x,y,p,t_us\n3,4,1,11\n40.5,5,0,50\n", "row 3", "whole number"),
        ("x,y,p,t_us\n3,4,1,11\n-1,5,0,50\n", "row 3", "x is -1"),
        ("x,y,p,t_us\n3,4,1,11\n4,70000,0,50\n", "row 3", "y is 70000"),
        ("x,y,p,t_us\n3,4,1,11\n4,5,0,1e40\n", "row 3", "2^60"),
        ("x,y,p,t_us\n3,4,1,11\n4,5,0,1152921504606846977\n", "row 3", "2^60"),
        ("x,y,p,t_us\n3,4,1,11\n4,5,0,nan\n", "row 3", "'nan'"),
        ("x,y,p,t_us\n3,4,1,11\n4,5,0,1_000\n", "row 3", "'1_000'"),
        ("x,y,p,t_us\n3,4,1,11\n4,5,0,1.2.3\n", "row 3", "'1.2.3'"),
        ("x,y,p,t_us\n3,4,1,11\n4,5,0,3-4\n", "row 3", "'3-4'"),
        ("x,y,p,t_us\n3,4,1,11\n4,5,0,.\n", "row 3", "'.'"),
    ],
)
def test_a_fault_is_named_by_its_row_after_the_rows_before_it(
    content: str, where: str, problem: str, saved: Save
) -> None:
    path = saved("a.csv", content)
    chunks: list[Events] = []
    with open_events(path, width=64, height=48) as reader, pytest.raises(InputError) as caught:
        chunks.extend(reader)
    assert caught.value.where == where
    assert problem in caught.value.problem
    assert [chunk.t.tolist() for chunk in chunks] == [[11]]
    assert len(read_events(path, width=64, height=48, keep_going=True)) == 1


@pytest.mark.parametrize("content", ["hello\n", "a,b,c,d\n1,2,3,4\n", "#\n#\n", "x,y,p,t_us\n", "1 2 3\n", "\n\n"])
def test_text_that_holds_no_events_is_one_clear_line(content: str, saved: Save) -> None:
    with pytest.raises(InputError) as caught:
        read_events(saved("a.txt", content), time_unit="us")
    assert "\n" not in str(caught.value)
    assert caught.value.where


def test_a_line_without_end_does_not_fill_the_memory(saved: Save) -> None:
    rows = "x,y,p,t_us\n" + "3,4,1,11\n" * 10
    with pytest.raises(InputError, match="row 12: longer than"):
        read_events(saved("a.csv", rows + "7" * 300_000))
    with pytest.raises(InputError, match="row 1: longer than"):
        read_events(saved("b.csv", "7" * 300_000))


decimals = st.builds(
    lambda sign, whole, fraction, point: f"{sign}{whole}{point}{fraction}" if point else f"{sign}{whole}",
    st.sampled_from(["", "-", "+"]),
    st.integers(0, 10**11).map(str),
    st.text("0123456789", max_size=12),
    st.sampled_from(["", "."]),
)


@given(times=st.lists(decimals, min_size=1, max_size=30), unit=st.sampled_from(["s", "ms", "us", "ns"]))
@example(times=["0.0000005", "0.0000004999999", "-0.0000005", "1600000000.123456499"], unit="s")
@example(times=["499.9", "500", "-500", "1499.999"], unit="ns")
@settings(max_examples=200)
def test_decimal_times_become_microseconds_exactly(times: list[str], unit: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.csv"
        path.write_text(f"x,y,p,t_{unit}\n" + "".join(f"{i},0,1,{t}\n" for i, t in enumerate(times)))
        events = read_events(path, height=1)
    exact = [Fraction(Decimal(t)) * 1_000_000 / PER_SECOND[unit] for t in times]
    rounded = [int(Decimal(1 if f >= 0 else -1) * int(abs(f) + Fraction(1, 2))) for f in exact]
    back = dict(zip(events.x.tolist(), events.t.tolist(), strict=True))
    assert [back[i] for i in range(len(times))] == rounded


@given(
    rows=st.lists(
        st.tuples(st.integers(0, 63), st.integers(0, 47), st.integers(0, 1), st.integers(0, 10**7)),
        min_size=1,
        max_size=60,
    ),
    seed=st.integers(0, 1000),
    block_bytes=st.sampled_from([16, 64, 1 << 20]),
)
@settings(max_examples=60)
def test_plain_and_line_by_line_parsing_agree(
    rows: list[tuple[int, int, int, int]], seed: int, block_bytes: int
) -> None:
    rng = np.random.default_rng(seed)
    rows = sorted(rows, key=lambda row: row[3])
    # An exponent somewhere sends its whole block down the slow path.
    lines = [f"{x},{y},{p},{t}{'e0' if rng.random() < 0.1 else ''}\n" for x, y, p, t in rows]
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(text, "_BLOCK_BYTES", block_bytes)
        path = Path(folder) / "a.csv"
        path.write_text("x,y,p,t_us\n" + "".join(lines))
        assert columns_of(path, width=64, height=48) == tuple([row[k] for row in rows] for k in (3, 0, 1, 2))


@pytest.mark.parametrize("digits", [10, 4299, 5000, 60_000])
def test_a_first_row_that_is_no_size_is_one_clear_line(digits: int, saved: Save) -> None:
    with pytest.raises(InputError, match=r"row 1: found '1111.* expected a sensor size") as caught:
        open_events(saved("a.txt", "1" * digits + " 5\n11 3 4 1\n"), time_unit="us")
    assert len(caught.value.problem) < 200
