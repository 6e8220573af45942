"""Read trackers' files by column name, and say where a bad one is wrong."""

from __future__ import annotations

import contextlib
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.errors import InputError
from tiegocancel.motion.affine import AffineTrajectory
from tiegocancel.motion.rotation import MAX_CENTER_PX, MAX_OMEGA_RAD_S, RotationTrajectory
from tiegocancel.motion.trajectory_csv import read_motion

HEADER = "timestamp,center_x,center_y,omega_rad_s\n"


@pytest.fixture
def write(tmp_path):
    def put(text):
        target = tmp_path / "path.csv"
        target.write_bytes(text if isinstance(text, bytes) else text.encode())
        return target

    return put


@given(
    times=st.lists(st.integers(-(1 << 60), 1 << 60), min_size=1, max_size=12, unique=True).map(sorted),
    center=st.floats(-MAX_CENTER_PX, MAX_CENTER_PX, allow_subnormal=False),
    omega=st.floats(-MAX_OMEGA_RAD_S, MAX_OMEGA_RAD_S, allow_subnormal=False),
)
def test_round_trip_keeps_every_bit(tmp_path_factory, times, center, omega):
    spread = np.array(times[:1] + [b for a, b in pairwise(times) if b - a > (1 << 58)], np.int64)
    count = len(spread)
    before = RotationTrajectory(
        t_us=spread, center_px=np.full((count, 2), center), omega_rad_s=np.full(count, omega), source="fit"
    )
    target = tmp_path_factory.mktemp("csv") / "motion.csv"
    before.to_csv(target)
    after = RotationTrajectory.from_csv(target)
    assert np.array_equal(after.t_us, before.t_us)
    assert np.array_equal(after.center_px, before.center_px)
    assert np.array_equal(after.omega_rad_s, before.omega_rad_s)
    assert after.source == "motion.csv"


@given(
    times=st.lists(st.integers(0, 1 << 30), min_size=1, max_size=12, unique=True).map(sorted),
    seed=st.integers(0, 1 << 31),
)
def test_causal_round_trip_keeps_every_row_however_close(tmp_path_factory, times, seed):
    rng = np.random.default_rng(seed)
    before = RotationTrajectory(
        t_us=np.array(times, np.int64),
        center_px=rng.normal(size=(len(times), 2)),
        omega_rad_s=rng.normal(size=len(times)),
        omega_dot_rad_s2=rng.normal(size=len(times)),
        interpolation="causal",
    )
    target = tmp_path_factory.mktemp("csv") / "causal.csv"
    before.to_csv(target)
    after = RotationTrajectory.from_csv(target)
    for name in ("t_us", "center_px", "omega_rad_s", "omega_dot_rad_s2"):
        assert np.array_equal(getattr(after, name), getattr(before, name))
    assert after.interpolation == "causal"
    assert any(note.startswith("causal") for note in after.notes)


@pytest.mark.parametrize("interpolation", ["linear", "causal"])
def test_affine_round_trip_keeps_every_bit(tmp_path, interpolation):
    rng = np.random.default_rng(0)
    before = AffineTrajectory(
        t_us=np.arange(50) * 777 - 9,
        rates=rng.normal(size=(50, 6)),
        rates_dot=rng.normal(size=(50, 6)) if interpolation == "causal" else None,
        interpolation=interpolation,
    )
    before.to_csv(tmp_path / "affine.csv")
    for after in (AffineTrajectory.from_csv(tmp_path / "affine.csv"), read_motion(tmp_path / "affine.csv")):
        assert isinstance(after, AffineTrajectory)
        assert np.array_equal(after.t_us, before.t_us)
        assert np.array_equal(after.rates, before.rates)
        assert np.array_equal(after.rates_dot, before.rates_dot)
        assert (after.interpolation, after.source) == (interpolation, "affine.csv")


def test_the_header_tells_a_rotation_from_an_affine_motion(write):
    assert isinstance(read_motion(write(HEADER + "0,1,2,3\n")), RotationTrajectory)
    affine = read_motion(write("rate_f,note,t_us,rate_a,rate_b,rate_c,rate_d,rate_e\n6,x,7,1,2,3,4,5\n"))
    assert isinstance(affine, AffineTrajectory)
    assert (affine.t_us.tolist(), affine.rates.tolist()) == ([7], [[1, 2, 3, 4, 5, 6]])


@pytest.mark.parametrize(
    ("text", "where", "problem"),
    [
        ("timestamp,rate_a\n0,1\n", "header", "lacks the column rate_b"),
        ("rate_a,rate_b,rate_c,rate_d,rate_e,rate_f\n1,2,3,4,5,6\n", "header", "lacks a time column"),
        ("t,rate_a,rate_b,rate_c,rate_d,rate_e,rate_f\n0,1,2,x,4,5,6\n", "row 2, column rate_c", "found 'x'"),
        ("t,rate_a,rate_b,rate_c,rate_d,rate_e,rate_f\n0,1,2e7,3,4,5,6\n", "row 2, column rate_b", "within ±1e+06"),
        ("t,rate_a,rate_b,rate_c,rate_d,rate_e,rate_f,rate_dot_a\n0,1,2,3,4,5,6,7\n", "header", "rate_dot_b"),
        ("t,rate_a,rate_b,rate_c,rate_d,rate_e,rate_f\n", "", "no rows"),
    ],
)
def test_faults_of_an_affine_file_name_their_place(write, text, where, problem):
    with pytest.raises(InputError) as caught:
        read_motion(write(text))
    assert caught.value.where == where
    assert problem in str(caught.value)


def test_rows_without_a_centre_are_skipped_and_counted(write):
    trajectory = RotationTrajectory.from_csv(write(HEADER + "1,,,10\n2,1,1,20\n3,1, ,30\n4,2,2,40\n"))
    assert trajectory.omega_rad_s.tolist() == [20, 40]
    assert "2 of 4 rows have no centre and were skipped" in trajectory.notes
    with pytest.raises(InputError, match="knows a centre in none of 1 rows"):
        RotationTrajectory.from_csv(write(HEADER + "1,,,10\n"))


def test_columns_of_an_estimator_are_understood_and_its_doubts_counted(write):
    text = (
        "timestamp,center_x,center_y,omega,omega_dot_rad_s2,center_sigma_px,omega_sigma_rad_s,sharpness,confident,"
        "events_used,doubt\n0.1,1,2,3,4,inf,inf,,0,9,few events\n0.1005,5,6,7,8,1,1,2.0,1,9,\n"
    )
    trajectory = RotationTrajectory.from_csv(write(text))
    assert (trajectory.omega_rad_s.tolist(), trajectory.omega_dot_rad_s2.tolist()) == ([3, 7], [4, 8])
    assert "1 of 2 rows are marked doubtful" in trajectory.notes


def test_dense_regular_rows_come_back_one_by_one(tmp_path):
    times = np.arange(1000) * 7 + (1 << 40)
    before = RotationTrajectory(
        t_us=times, center_px=np.random.default_rng(0).random((1000, 2)), omega_rad_s=times * 1e-9
    )
    before.to_csv(tmp_path / "dense.csv")
    after = RotationTrajectory.from_csv(tmp_path / "dense.csv")
    assert np.array_equal(after.t_us, times)
    assert np.array_equal(after.center_px, before.center_px)


@pytest.mark.parametrize(
    ("column", "cell", "expected_us"),
    [
        ("timestamp", "1.5", 1_500_000),
        ("timestamp", "1099511.627776", 1 << 40),
        ("timestamp", "-0.000001", -1),
        ("timestamp", "1e-3", 1000),
        ("t_us", "1099511627777", (1 << 40) + 1),
        ("timestamp_us", " 12.4 ", 12),
        ("timestamp_ms", "2.5", 2500),
        ("t_ns", "1999", 2),
        ("Time_S", "3", 3_000_000),
    ],
)
def test_time_column_carries_its_unit_in_its_name(write, column, cell, expected_us):
    trajectory = RotationTrajectory.from_csv(write(f"{column},center_x,center_y,omega_rad_s\n{cell},1,2,3\n"))
    assert trajectory.t_us.tolist() == [expected_us]
    assert (trajectory.center_px.tolist(), trajectory.omega_rad_s.tolist()) == ([[1.0, 2.0]], [3.0])
    assert column in trajectory.notes[0]


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + HEADER + "0.5,10,20,3\n",
        HEADER.replace("\n", "\r\n") + "0.5,10,20,3\r\n",
        HEADER.replace(",", ";") + "0.5;10;20;3\n",
        HEADER.replace(",", "\t") + "0.5\t10\t20\t3",
        "radius, omega_circlefit_rad_s ,center_y,extra,center_x,timestamp\n9,3,20,a b,10,0.5\n",
        "\n" + HEADER + "\n\n0.5,10,20,3\n\n",
        '"timestamp","center_x","center_y","omega"\n"0.5","10","20","3"\n',
        "timestamp,center_x_px,center_y_px,omega_rad_s,omega_std\n0.5,10,20,3,9\n",
    ],
)
def test_dialects_and_column_orders_read_alike(write, text):
    trajectory = RotationTrajectory.from_csv(write(text))
    assert trajectory.t_us.tolist() == [500_000]
    assert trajectory.center_px.tolist() == [[10.0, 20.0]]
    assert trajectory.omega_rad_s.tolist() == [3.0]


def test_unsorted_rows_are_sorted_and_said_so(write):
    trajectory = RotationTrajectory.from_csv(write(HEADER + "2,1,1,20\n1,1,1,10\n3,1,1,30\n"))
    assert trajectory.omega_rad_s.tolist() == [10, 20, 30]
    assert any("1 of 3 moved" in note for note in trajectory.notes)


def test_sorted_rows_are_not_called_unsorted(write):
    trajectory = RotationTrajectory.from_csv(write(HEADER + "1,1,1,10\n2,1,1,20\n"))
    assert len(trajectory.notes) == 1


def test_blobs_of_one_instant_become_their_median(write):
    rows = [
        f"{k * 0.05 + blob * 1e-5},{600 + blob},{300},{3.0 if blob else 99.0}\n" for k in range(4) for blob in range(3)
    ]
    trajectory = RotationTrajectory.from_csv(write(HEADER + "".join(rows)))
    assert trajectory.t_us.tolist() == [10, 50_010, 100_010, 150_010]
    assert trajectory.omega_rad_s.tolist() == [3.0] * 4
    assert trajectory.center_px[:, 0].tolist() == [601.0] * 4
    assert any("12 rows at 4 instants" in note for note in trajectory.notes)


def test_equal_times_are_merged_even_when_all_are_equal(write):
    trajectory = RotationTrajectory.from_csv(write(HEADER + "1,1,1,1\n1,2,2,2\n1,9,9,9\n"))
    assert trajectory.omega_rad_s.tolist() == [2.0]


@pytest.mark.parametrize(
    ("text", "where", "problem"),
    [
        ("", "", "is empty"),
        (HEADER, "", "no rows"),
        ("1.0,2.0,3.0,4.0\n", "header", "lacks a time column"),
        ("timestamp,center_y,omega\n1,2,3\n", "header", "lacks the column center_x"),
        ("timestamp,center_x,center_y\n1,2,3\n", "header", "lacks the column omega_rad_s"),
        ("timestamp,center_x,center_y,omega_a,omega_b\n1,2,3,4,5\n", "header", "more than one: 'omega_a', 'omega_b'"),
        ("timestamp,center_x,center_y,omega_rev_s\n1,2,3,4\n", "header", "expected rad/s"),
        ("timestamp,center_x,center_y,omega_rpm\n1,2,3,4\n", "header", "expected rad/s"),
        ("timestamp,center_x,center_y,omega_deg_s\n1,2,3,4\n", "header", "expected rad/s"),
        ("timestamp,center_x,center_x,center_y,omega\n1,2,3,4,5\n", "header", "twice"),
        (HEADER + "1,2,3,4\n1.1,2,3\n", "row 3", "has 3 fields"),
        (HEADER + "1,2,3,4\n\n1.1,2,oops,4\n", "row 4, column center_y", "expected a finite number, found 'oops'"),
        (HEADER + "nan,2,3,4\n", "row 2, column timestamp", "found 'nan'"),
        (HEADER + "1,inf,3,4\n", "row 2, column center_x", "found 'inf'"),
        (HEADER + "1,2,3,\n", "row 2, column omega_rad_s", "found ''"),
        (HEADER + "1,2,3,1_0\n", "row 2, column omega_rad_s", "found '1_0'"),
        (HEADER + "1e30,2,3,4\n", "row 2, column timestamp", "within ±2^60 µs"),
        (HEADER + "1e999999999,2,3,4\n", "row 2, column timestamp", "within ±2^60 µs"),
        (HEADER + "1,2e9,3,4\n", "row 2, column center_x", "within ±"),
        (HEADER + "1,2,3,4e7\n", "row 2, column omega_rad_s", "within ±1e+06"),
        (HEADER.encode() + b"1,2,\xff,4\n", "byte 44", "not UTF-8"),
    ],
)
def test_faults_name_file_place_and_value_in_one_line(write, text, where, problem):
    target = write(text)
    with pytest.raises(InputError) as caught:
        RotationTrajectory.from_csv(target)
    message = str(caught.value)
    assert message.startswith(str(target))
    assert caught.value.where == where
    assert problem in message
    assert "\n" not in message


def test_absent_file_and_folder_are_clear(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        RotationTrajectory.from_csv(tmp_path / "none.csv")
    with pytest.raises(InputError, match="cannot be read"):
        RotationTrajectory.from_csv(tmp_path)


@given(data=st.binary(max_size=200))
def test_fuzzed_bytes_read_or_fail_cleanly(tmp_path_factory, data):
    target = tmp_path_factory.mktemp("fuzz") / "fuzz.csv"
    target.write_bytes(HEADER.encode() + b"1,2,3,4\n" + data)
    with contextlib.suppress(InputError):
        assert len(RotationTrajectory.from_csv(target)) >= 1


def test_real_tracker_file_has_the_known_centre_and_speed(recording):
    trajectory = RotationTrajectory.from_csv(recording("anu_disc_tracker.csv"))
    center, omega = trajectory.mean()
    assert len(trajectory) == 207
    assert center == pytest.approx((665.3, 337.7), abs=0.3)
    assert omega == pytest.approx(3.612, abs=0.02)
    center, omega = trajectory.mean(start_us=8_393_328, stop_us=8_403_327)
    assert center == pytest.approx((665.5, 337.8), abs=0.3)
    assert omega == pytest.approx(3.64, abs=0.02)
