"""Read the gyroscope's lines of an eDVS, whole or spoilt."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.inertial.edvs_lines import RAW_STEP_RAD_S, gyro_of_lines, parse_edvs_line


def hexed(degrees_s):
    return f"{round(degrees_s * 65536) & 0xFFFFFFFF:08X}"


@pytest.mark.parametrize(
    ("line", "degrees_s"),
    [
        ("-S10 00010000 FFFF0000 00008000", (1.0, -1.0, 0.5)),
        ("-S10 10000 ffff8000 0\r\n", (1.0, -0.5, 0.0)),
        ("  -S10\t80000000 7FFFFFFF 0", (-32768.0, 32768.0 - 1 / 65536, 0.0)),
        ("-S7 16384 -16384 +0", (1000.0, -1000.0, 0.0)),
        ("-S7 -32768 32767 1", (-2000.0, 2000.0 * 32767 / 32768, 2000.0 / 32768)),
    ],
)
def test_gyro_lines_become_rates(line, degrees_s):
    parsed = parse_edvs_line(line)
    assert parsed.kind == "gyro"
    assert parsed.rate_rad_s == pytest.approx([math.radians(value) for value in degrees_s])


@pytest.mark.parametrize("line", ["", "EDVS-4337, V1.0", "-S11 1 2 3", "-S8 1 2 3", "-E2", "-S", "-Sx 1"])
def test_other_lines_are_left_alone(line):
    assert parse_edvs_line(line).kind == "other"


@pytest.mark.parametrize(
    "line",
    [
        "-S10 1 2",
        "-S10 1 2 3 4",
        "-S10 1 2 G",
        "-S10 1 2 123456789",
        "-S10 1 2 -3",
        "-S10 1 2 0x3",
        "-S10",
        "-S1010000 2 3",
        "-S7 1 2 32768",
        "-S7 1 2 1.5",
        "-S7 1 2 999999",
        "-S7\x80 1 2 3",
    ],
)
def test_spoilt_gyro_lines_are_told_from_others(line):
    assert parse_edvs_line(line).kind == "malformed"


@given(st.text(max_size=40))
def test_no_text_raises(text):
    assert parse_edvs_line(text).kind in ("gyro", "other", "malformed")
    assert parse_edvs_line("-S10 " + text).kind in ("gyro", "malformed")


@given(st.lists(st.integers(-(1 << 31), (1 << 31) - 1), min_size=3, max_size=3))
def test_hex_round_trip(values):
    line = "-S10 " + " ".join(f"{value & 0xFFFFFFFF:X}" for value in values)
    assert [rate / math.radians(1 / 65536) for rate in parse_edvs_line(line).rate_rad_s] == pytest.approx(values)


def test_lines_of_one_time_are_averaged_and_everything_is_counted():
    lines = [
        (100, "EDVS-4337"),
        (100, f"-S10 {hexed(1)} {hexed(0)} {hexed(-4)}"),
        (100, f"-S10 {hexed(3)} {hexed(0)} {hexed(-4)}"),
        (200, "-S10 12"),
        (300, f"-S10 {hexed(5)} {hexed(6)} {hexed(7)}"),
        (250, f"-S10 {hexed(9)} {hexed(9)} {hexed(9)}"),
    ]
    read = gyro_of_lines(iter(lines))
    assert (read.lines, read.other, read.malformed, read.merged, read.late) == (6, 1, 1, 1, 1)
    assert read.samples.t_us.tolist() == [100, 300]
    assert read.samples.rate_rad_s[0] == pytest.approx([math.radians(value) for value in (2, 0, -4)])
    assert read.samples.notes == (
        "1 line(s) of the gyroscope malformed",
        "1 line(s) of the gyroscope merged",
        "1 line(s) of the gyroscope late",
    )


def test_no_gyro_line_gives_no_samples():
    assert gyro_of_lines([(0, "-S11 1 2 3")]).samples is None
    assert gyro_of_lines([]).lines == 0


def test_raw_step_is_the_full_scale_over_15_bits():
    assert math.isclose(RAW_STEP_RAD_S * 32768, math.radians(2000))
