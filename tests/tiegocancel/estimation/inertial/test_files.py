"""Read gyroscopes from text files, and say where a bad one is wrong."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.errors import ConfigError, InputError
from tiegocancel.estimation.inertial.files import read_gyro, write_gyro
from tiegocancel.estimation.inertial.gyro import GyroSamples

CSV = "timestamp,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s\n"


@pytest.fixture
def write(tmp_path):
    def put(text):
        target = tmp_path / "imu.csv"
        target.write_bytes(text if isinstance(text, bytes) else text.encode())
        return target

    return put


@given(
    times=st.lists(st.integers(-(1 << 60), 1 << 60), min_size=1, max_size=8, unique=True).map(sorted),
    rates=st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=24, max_size=24),
)
def test_round_trip_keeps_every_bit(tmp_path_factory, times, rates):
    before = GyroSamples(t_us=np.array(times), rate_rad_s=np.reshape(rates, (8, 3))[: len(times)])
    target = tmp_path_factory.mktemp("gyro") / "gyro.csv"
    write_gyro(before, target)
    after = read_gyro(target)
    assert np.array_equal(after.t_us, before.t_us)
    assert np.array_equal(after.rate_rad_s, before.rate_rad_s)
    assert after.source == "gyro.csv"


@pytest.mark.parametrize(
    ("text", "t_us", "rate"),
    [
        (CSV + "0.5,1,2,3\n0.501,4,5,6\n", [500_000, 501_000], [[1, 2, 3], [4, 5, 6]]),
        ("t_us;note;gyro_x_deg_s;gyro_y_deg_s;gyro_z_deg_s\n7;a;180;0;-90\n", [7], [[math.pi, 0, -math.pi / 2]]),
        ("gyro_z_dps\tt_ms\n360\t1.5\n", [1500], [[0, 0, 2 * math.pi]]),
        ("# timestamp, omega_x_rad_s, omega_y_rad_s, omega_z_rad_s\n1,1,2,3\n", [1_000_000], [[1, 2, 3]]),
        ("T_NS,Gyroscope_X_mrad_s,Gyroscope_Y_mrad_s,Gyroscope_Z_mrad_s\n1500,1000,0,0\n", [2], [[1, 0, 0]]),
        ("2.0000005 0 0 9.8 1 2 3\n2.001 0 0 9.8 4 5 6\n", [2_000_000, 2_001_000], [[1, 2, 3], [4, 5, 6]]),
        ("2,0,0,9.8,1,2,3\n", [2_000_000], [[1, 2, 3]]),
        ("\ufeff\n" + CSV + "\n1,1,2,3\n\n", [1_000_000], [[1, 2, 3]]),
    ],
)
def test_columns_are_told_by_their_names_and_units(write, text, t_us, rate):
    read = read_gyro(write(text))
    assert read.t_us.tolist() == t_us
    assert read.rate_rad_s == pytest.approx(np.array(rate, np.float64))


def test_notes_say_what_was_taken_for_granted(write):
    bare = read_gyro(write("2 0 0 9.8 1 2 3\n"))
    assert bare.notes == (
        "no header: columns taken as t ax ay az gx gy gz in s, m/s² and rad/s",
        "the camera's axes are x,y,z of the gyroscope's, by default for this format",
    )
    single = read_gyro(write("t,gyro_z_deg_s\n1,2\n"), axes="x,-y,-z")
    assert "a gyroscope of one axis: gyro_z_deg_s; x and y are taken as 0" in single.notes
    assert single.notes[-1] == "the camera's axes are x,-y,-z of the gyroscope's, as given"
    assert single.rate_rad_s[0, 2] == pytest.approx(-math.radians(2))


def test_rows_out_of_order_are_sorted_with_a_note(write):
    read = read_gyro(write(CSV + "2,0,0,2\n1,0,0,1\n2,0,0,4\n"))
    assert read.t_us.tolist() == [1_000_000, 2_000_000]
    assert read.rate_rad_s[:, 2].tolist() == [1.0, 3.0]
    assert any("1 of 3 moved" in note for note in read.notes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        (CSV, "holds a header and no rows"),
        ("timestamp,gyro_x,gyro_y,gyro_z\n", "header: gives 'gyro_z' without a unit"),
        ("timestamp,ax,ay\n", "header: lacks a gyroscope"),
        ("gyro_z_rad_s\n1\n", "header: lacks a time column"),
        ("t,gyro_x_rad_s,gyro_z_rad_s\n", "header: lacks the column gyro_y_rad_s"),
        ("t,t,gyro_z_rad_s\n", "header: names column 't' twice"),
        (CSV + "1,1,2,3\n2,1,2\n", "row 3: has 3 fields; expected 4"),
        (CSV + "1,1,2,3\n2,1,2,3,4\n", "row 3: has 5 fields; expected 4"),
        (CSV + "x,1,2,3\n", "row 2, column timestamp: expected a finite number, found 'x'"),
        (CSV + "1e999999999,1,2,3\n", "row 2, column timestamp: expected a time within"),
        (CSV + "1,1,2,nan\n", "row 2, column gyro_z_rad_s: expected a finite rate .* found 'nan'"),
        (CSV + "1,1,1e7,3\n", "row 2, column gyro_y_rad_s: expected a finite rate .* found '1e7'"),
        (CSV + "1_0,1,2,3\n", "row 2, column timestamp: .* found '1_0'"),
        ("1 2 3\n", "row 1: has 3 fields and no header"),
        ("1 0 0 0 0 0 0\n2 0 0 0\n", "row 2: has 4 fields; expected 7"),
        (b"\xff\xfe\x00", "byte 0: is not UTF-8 text"),
        (CSV + '1,"1', "row"),
    ],
)
def test_a_fault_is_one_line_with_its_place(write, text, message):
    path = write(text)
    with pytest.raises(InputError, match=message) as caught:
        read_gyro(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_keep_going_returns_what_came_before_the_fault(write):
    path = write(CSV + "1,1,2,3\n2,1,2,oops\n3,1,2,3\n")
    read = read_gyro(path, keep_going=True)
    assert read.t_us.tolist() == [1_000_000]
    assert any("stopped at a fault: row 3" in note for note in read.notes)
    with pytest.raises(InputError, match="row 2"):
        read_gyro(write(CSV + "1,1,2,oops\n"), keep_going=True)


def test_missing_file_and_folder_are_input_errors(tmp_path):
    for path, words in ((tmp_path / "none.csv", "no such file"), (tmp_path, "is a folder")):
        with pytest.raises(InputError, match=words):
            read_gyro(path)


def test_axes_that_are_no_map_are_a_configuration_error(write):
    with pytest.raises(ConfigError, match="axes must name each of x, y, z once"):
        read_gyro(write(CSV + "1,1,2,3\n"), axes="x,y")


@given(content=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_no_content_makes_it_crash(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("fuzz") / "imu.txt"
    path.write_bytes(content)
    with contextlib.suppress(InputError):
        read_gyro(path)


@given(rows=st.text(alphabet='0123456789.,-e\n "', max_size=80))
def test_no_row_makes_it_crash(tmp_path_factory, rows):
    path = tmp_path_factory.mktemp("fuzz") / "imu.csv"
    path.write_text(CSV + rows)
    with contextlib.suppress(InputError):
        read_gyro(path)


def test_a_log_of_edvs_lines_is_a_gyroscope(write):
    text = "# replies\n1200 -S10 0001a000 00000000 fffe0000\n1300 -S11 1 2 3\n1400 -S10 0001\n1400 -S10 0 0 10000\n"
    samples = read_gyro(write(text), axes="x,y,-z")
    assert samples.t_us.tolist() == [1200, 1400]
    assert np.degrees(samples.rate_rad_s) == pytest.approx(np.array([[1.625, 0.0, 2.0], [0.0, 0.0, -1.0]]))
    assert any("1 line(s) of the gyroscope malformed" in note for note in samples.notes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("12 -S10 0 0 0\nnoon -S10 0 0 0\n", "row 2: expected a time in whole µs and a reply"),
        ("12 -S10 0 0 0\n13\n", "row 2"),
        ("99999999999999999999 -S10 0 0 0\n", "t ax ay az gx gy gz"),
        ("5 -S11 0 0 0\n", "holds no line of a gyroscope"),
    ],
)
def test_a_faulty_log_is_one_line_with_its_place(write, text, message):
    with pytest.raises(InputError, match=message):
        read_gyro(write(text))
