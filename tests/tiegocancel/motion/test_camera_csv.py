"""Read a camera's turning about three axes, and tell such a file from the others."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.errors import InputError
from tiegocancel.motion.camera_csv import names_turns, read_camera
from tiegocancel.motion.intrinsics import CameraIntrinsics
from tiegocancel.motion.trajectory_csv import read_motion

LENS = CameraIntrinsics(fx=150.0, fy=150.0, cx=79.5, cy=59.5, width=160, height=120)
HEADER = "timestamp,omega_x_rad_s,omega_y_rad_s,omega_z_rad_s\n"


@pytest.fixture
def write(tmp_path):
    def put(text):
        target = tmp_path / "turns.csv"
        target.write_text(text, encoding="utf-8")
        return target

    return put


def test_rows_are_sorted_and_linear_in_between(write):
    camera = read_camera(write(HEADER + "0.01,0,0.2,-1\n0,0,0.1,1\n"), LENS)
    assert (camera.width, camera.height) == (160, 120)
    assert camera.interpolation == "linear"
    assert camera.at(np.array([0, 5_000, 20_000])) == pytest.approx(
        np.array([[0.0, 0.1, 1.0], [0.0, 0.15, 0.0], [0.0, 0.2, -1.0]])
    )
    assert camera.source == "turns.csv"
    assert any("omega_x_rad_s to omega_z_rad_s" in note for note in camera.notes)


def test_the_prediction_is_that_of_the_camera(write):
    camera = read_camera(write(HEADER + "0,0,0,-2\n"), LENS)
    x, y = camera.predict(np.array([0]), np.array([129], np.uint16), np.array([59], np.uint16), 100_000)
    # The camera turns against x towards y, so the image turns by +0.2 rad about the principal point.
    assert (int(x[0]), int(y[0])) == (128, 69)


def test_each_kind_of_file_is_told_from_the_others(write, tmp_path):
    assert names_turns(write(HEADER + "0,0,0,1\n")) == "only"
    assert names_turns(write("timestamp,center_x,center_y,omega_rad_s\n0,1,2,3\n")) == "no"
    tracker = write("timestamp,center_x,center_y,omega_rad_s,omega_x_rad_s\n0,1,2,3,4\n")
    assert names_turns(tracker) == "too"
    assert read_motion(tracker).omega_rad_s.tolist() == [3.0]
    assert names_turns(write("nothing\n")) == "no"
    assert names_turns(tmp_path / "absent.csv") == "no"


def test_estimates_hold_from_their_own_time_on(write):
    header = HEADER.replace("\n", ",omega_dot_rad_s2\n")
    camera = read_camera(write(header + "0,0,0.1,1,0\n0.01,0,0.2,-1,0\n"), LENS)
    assert camera.interpolation == "causal"
    assert camera.at(np.array([9_999]))[0].tolist() == [0.0, 0.1, 1.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("timestamp,omega_x_rad_s,omega_z_rad_s\n0,1,2\n", "omega_y_rad_s"),
        (HEADER + "0,0,x,1\n", "omega_y_rad_s"),
        (HEADER + "0,0,2e6,1\n", "omega_y_rad_s"),
    ],
)
def test_a_fault_names_its_column(write, text, message):
    with pytest.raises(InputError, match=message):
        read_camera(write(text), LENS)
