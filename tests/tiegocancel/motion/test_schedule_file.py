"""Check that a schedule's files give back every integer, and that a torn or wrong one names its place."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import AffineTrajectory, MotionSchedule
from tiegocancel.errors import InputError
from tiegocancel.motion.schedule import MAX_COEFFICIENT
from tiegocancel.motion.schedule_file import coefficient_bits, read_schedule, write_memory_image, write_schedule

WHOLE = st.integers(-MAX_COEFFICIENT, MAX_COEFFICIENT)


@pytest.fixture
def two(tmp_path):
    schedule = MotionSchedule(
        np.array([-5, 1000]), np.array([[1, -2, 3, -4, 5, -6], [0, 0, 70_000, 0, 0, -70_000]]), 20_000
    )
    write_schedule(schedule, tmp_path / "two.txt")
    return tmp_path / "two.txt"


@given(
    times=st.lists(st.integers(-(1 << 60), 1 << 60), min_size=1, max_size=8).map(sorted),
    data=st.data(),
    horizon=st.none() | st.integers(0, 1 << 40),
)
def test_round_trip_keeps_every_integer(tmp_path_factory, times, data, horizon):
    table = data.draw(st.lists(st.lists(WHOLE, min_size=6, max_size=6), min_size=len(times), max_size=len(times)))
    before = MotionSchedule(np.array(times, np.int64), np.array(table, np.int64), horizon)
    target = tmp_path_factory.mktemp("schedule") / "s.txt"
    write_schedule(before, target)
    after = read_schedule(target)
    assert np.array_equal(after.t_us, before.t_us)
    assert np.array_equal(after.coefficients, before.coefficients)
    assert after.horizon_us == before.horizon_us


def test_the_form_is_the_documented_one(two):
    assert two.read_bytes().decode().split("\n") == [
        "tiegocancel_schedule 1",
        "fraction_bits 16",
        "horizon_us 20000",
        "entries 2",
        "columns 7",
        "order t_us_a_b_c_d_e_f",
        "-5 1 -2 3 -4 5 -6",
        "1000 0 0 70000 0 0 -70000",
        "",
    ]


def test_a_schedule_for_any_horizon_says_minus_one(tmp_path):
    write_schedule(MotionSchedule.still(), tmp_path / "s.txt")
    assert "horizon_us -1\n" in (tmp_path / "s.txt").read_text()
    assert read_schedule(tmp_path / "s.txt").horizon_us is None


@pytest.mark.parametrize(
    ("old", "new", "where", "problem"),
    [
        ("tiegocancel_schedule 1", "tiegocancel_schedule 2", "row 1, tiegocancel_schedule", "expected 1, found '2'"),
        ("tiegocancel_schedule 1\n", "", "row 1", "expected 'tiegocancel_schedule 1' or alike"),
        ("fraction_bits 16", "fraction_bits 8", "row 2, fraction_bits", "expected 16, found '8'"),
        ("horizon_us 20000", "horizon_us -2", "row 3, horizon_us", "from -1"),
        ("horizon_us 20000", "horizon_us", "row 3", "found 'horizon_us'"),
        ("entries 2", "entries 3", "", "holds 2 entries, expected 3"),
        ("1000 0 0 70000 0 0 -70000\n", "", "", "holds 1 entries, expected 2"),
        ("entries 2", "entries 0", "row 4, entries", "from 1"),
        ("columns 7", "columns 4", "row 5, columns", "expected 7"),
        ("order t_us_a", "order a_t_us", "row 6", "expected 'order t_us_a_b_c_d_e_f'"),
        ("-5 1 -2", "-5 1 x", "row 7, column b", "found 'x'"),
        ("-5 1 -2", "-5 1 1_0", "row 7, column b", "found '1_0'"),
        ("-5 1 -2", "-5 1 2.0", "row 7, column b", "found '2.0'"),
        ("-5 1 -2", "-5 1  -2", "row 7", "has 8 fields"),
        (" 0 -70000", " 0", "row 8", "has 6 fields"),
        ("70000 0", f"{MAX_COEFFICIENT + 1} 0", "row 8, column c", "a whole number from"),
        ("1000 0", f"{10**30} 0", "row 8, column t_us", "a whole number from"),
        ("1000 0", "-6 0", "row 8, column t_us", "is -6 after -5: times must not decrease"),
        ("order", "ordér", "byte", "is not ASCII"),
    ],
)
def test_faults_name_row_and_column(two, old, new, where, problem):
    text = two.read_text()
    assert old in text
    two.write_bytes(text.replace(old, new).encode())
    with pytest.raises(InputError) as caught:
        read_schedule(two)
    assert caught.value.where == where or where == "byte"
    assert problem in str(caught.value)
    assert str(two) in str(caught.value)


def test_absent_and_empty_files_are_clear(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_schedule(tmp_path / "none.txt")
    (tmp_path / "empty.txt").touch()
    with pytest.raises(InputError, match="found the end of the file"):
        read_schedule(tmp_path / "empty.txt")


@given(data=st.binary(max_size=80))
def test_fuzzed_bytes_read_or_fail_cleanly(tmp_path_factory, data):
    target = tmp_path_factory.mktemp("fuzz") / "s.txt"
    write_schedule(MotionSchedule.still(), target)
    target.write_bytes(target.read_bytes()[: 100 - len(data)] + data)
    with contextlib.suppress(InputError):
        read_schedule(target)


def image_of(path, width):
    """Read a memory image as ``$readmemh`` does: words of hexadecimal digits, comments left out."""
    words = [int(line, 16) for line in path.read_text().splitlines() if not line.startswith("//")]
    rows = []
    for word in words:
        fields = [word >> width * place & ((1 << width) - 1) for place in range(5, -1, -1)]
        rows.append([field - (1 << width) if field >> (width - 1) else field for field in fields])
    return rows


@given(row=st.lists(WHOLE, min_size=6, max_size=6), spare=st.integers(0, 3))
def test_memory_image_holds_every_coefficient(tmp_path_factory, row, spare):
    schedule = MotionSchedule(np.zeros(1, np.int64), np.array([row]))
    width = max(coefficient_bits(schedule), 2) + spare
    target = tmp_path_factory.mktemp("image") / "s.hex"
    write_memory_image(schedule, target, width_bits=width)
    assert image_of(target, width) == [row]


def test_memory_image_of_a_motion_has_a_word_for_each_entry(tmp_path):
    schedule = AffineTrajectory.from_parts((120, 90), roll_rad_s=[3.0, 4.0], zoom_1_s=1.0, t_us=[0, 5000]).schedule(
        8000
    )
    write_memory_image(schedule, tmp_path / "s.hex", width_bits=30)
    assert image_of(tmp_path / "s.hex", 30) == schedule.coefficients.tolist()
    lines = (tmp_path / "s.hex").read_text().splitlines()
    assert lines[0] == "// 6 words of 6 x 30 bits: {a, b, c, d, e, f}, 16 fraction bits, for a horizon of 8000 us"
    assert lines[1] == "// t_us 0"
    assert {len(line) for line in lines[2::2]} == {45}


@pytest.mark.parametrize(("value", "bits"), [(0, 1), (-1, 1), (1, 2), (-2, 2), (127, 8), (-128, 8), (128, 9)])
def test_bits_count_the_sign(value, bits):
    assert coefficient_bits(MotionSchedule(np.zeros(1, np.int64), np.array([[0, 0, value, 0, 0, 0]]))) == bits


def test_a_coefficient_that_does_not_fit_is_refused_with_its_row(two, tmp_path):
    with pytest.raises(ValueError, match="row 1 has c = 70000, which needs 18 bits with its sign, not 17"):
        write_memory_image(read_schedule(two), tmp_path / "s.hex", width_bits=17)
    assert not (tmp_path / "s.hex").exists()
    with pytest.raises(ValueError, match="width_bits must be from 2 to 64, not 65"):
        write_memory_image(MotionSchedule.still(), tmp_path / "s.hex", width_bits=65)
