"""Every source of motion gives a feed, and a setting that would have no effect is refused in one line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiegocancel import CancelConfig, ConfigError, Events, InputError, RotationTrajectory
from tiegocancel.estimation.inertial.files import write_gyro
from tiegocancel.estimation.inertial.gyro import GyroSamples
from tiegocancel.motion.camera import CameraTrajectory
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.motion.schedule_file import write_schedule
from tiegocancel.study import Settings
from tiegocancel.study.feed import FixedMotion, ScheduledMotion, TrackedMotion
from tiegocancel.study.motion_source import Found, motion_inputs, open_motion
from tiegocancel.study.settings import EstimateSettings, MotionSettings

CANCEL = CancelConfig(horizon_us=12_000)
CENTER = (80.0, 60.0)


def never() -> Events:
    raise AssertionError("nothing asks for a sample here")


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Lay out one file of each kind in the working folder."""
    monkeypatch.chdir(tmp_path)
    Path("turn.csv").write_text(
        "timestamp,center_x,center_y,omega_rad_s\n0,80,60,10\n0.04,80,60,13.2\n0.09,80,60,17.2\n", encoding="utf-8"
    )
    Path("field.csv").write_text(
        "timestamp,rate_a,rate_b,rate_c,rate_d,rate_e,rate_f\n0,0,-9,540,9,0,-720\n0.1,0,-9,540,9,0,-720\n",
        encoding="utf-8",
    )
    write_schedule(MotionSchedule.rotation(center_px=CENTER, omega_rad_s=13, horizon_us=12_000), "m.schedule")
    write_schedule(MotionSchedule.rotation(center_px=CENTER, omega_rad_s=13, horizon_us=20_000), "other.schedule")
    Path("broken.schedule").write_text("tiegocancel_schedule 1\nfraction_bits 12\n", encoding="utf-8")
    Path("flat.schedule").write_text(
        "tiegocancel_schedule 1\nfraction_bits 16\nhorizon_us 12000\nentries 1\ncolumns 7\n"
        "order t_us_a_b_c_d_e_f\n0 -65536 0 0 0 0 0\n",
        encoding="utf-8",
    )
    Path("camera.csv").write_text(
        "timestamp,omega_x_rad_s,omega_y_rad_s,omega_z_rad_s\n0,0.5,0.25,-3\n0.1,0.5,0.25,-3\n", encoding="utf-8"
    )
    t = np.arange(0, 90_000, 1000)
    write_gyro(GyroSamples(t_us=t, rate_rad_s=np.tile([0.5, 0.25, -3.0], (len(t), 1))), "gyro.csv")
    Path("lens.toml").write_text(
        "fx = 150.0\nfy = 150.0\ncx = 79.5\ncy = 59.5\nwidth = 160\nheight = 120\n", encoding="utf-8"
    )
    return tmp_path


def found(source: str, sample: Any = never, *, estimate: dict[str, Any] | None = None, **motion: Any) -> Found:
    wanted = Settings(
        cancel=CANCEL,
        motion=MotionSettings(source=source, **motion),
        estimate=EstimateSettings(**(estimate or {})),
    )
    return open_motion(wanted, sample=sample, width=160, height=120)


def test_each_source_gives_its_feed(files: Path, markers: Events) -> None:
    gyro = {"gyro": "gyro.csv"}
    assert isinstance(found("track").feed, TrackedMotion)
    assert found("track", estimate=gyro).feed.source == "track, gyro.csv"
    assert found("TRACK", estimate={"method": "circle"}).feed.source == "track, circle fit"
    assert isinstance(found(" gyro ", estimate=gyro).feed, TrackedMotion)
    assert isinstance(found("m.schedule").feed, ScheduledMotion)
    assert found("m.schedule").feed.source == "m.schedule"
    assert isinstance(found("turn.csv").feed, FixedMotion)
    assert found("field.csv").feed.source == "field.csv"
    assert found("80,60,13").feed.source == "constant"
    fitted = found("fit", lambda: markers)
    assert fitted.fit is not None
    assert fitted.feed.source == "fit"


def test_a_gyroscope_with_calibration_turns_the_camera_about_three_axes(files: Path) -> None:
    feed = found("gyro", estimate={"gyro": "gyro.csv", "calibration": "lens.toml", "gyro_bias": "none"}).feed
    camera = feed.trajectory
    assert isinstance(camera, CameraTrajectory)
    assert camera.omega_rad_s[0] == pytest.approx([0.5, 0.25, -3.0])
    assert any("px off" in note for note in camera.notes)
    assert any("axes" in note for note in camera.notes)
    assert feed.waits


def test_a_file_of_three_axes_with_calibration_turns_the_camera_like_its_gyroscope(files: Path) -> None:
    camera = found("camera.csv", estimate={"calibration": "lens.toml"}).feed.trajectory
    assert isinstance(camera, CameraTrajectory)
    assert any("px off" in note for note in camera.notes)
    gyro = {"gyro": "gyro.csv", "calibration": "lens.toml", "gyro_bias": "none"}
    measured = found("gyro", estimate=gyro).feed.trajectory
    assert measured is not None
    same = [each.schedule(12_000, start_us=0, stop_us=0).coefficients for each in (camera, measured)]
    assert np.array_equal(*same)


def test_a_gyroscope_alone_turns_about_the_principal_point(files: Path, markers: Events) -> None:
    feed = found("gyro", estimate={"gyro": "gyro.csv", "gyro_bias": "none"}).feed
    feed.advance(markers)
    assert isinstance(feed.trajectory, RotationTrajectory)
    assert feed.trajectory.omega_rad_s[5] == pytest.approx(3.0)  # the image turns against the camera
    assert feed.trajectory.center_px[5].tolist() == [79.5, 59.5]
    assert any("axes" in note for note in feed.trajectory.notes)


@pytest.mark.parametrize("interpolation", ["linear", "spline", "causal"])
def test_rows_of_a_file_are_interpolated_as_asked_for(files: Path, interpolation: str) -> None:
    chosen = found("turn.csv", interpolation=interpolation).feed.trajectory
    assert isinstance(chosen, RotationTrajectory)
    omega = float(chosen.at(np.array([20_000]))[2][0])
    expected = {"linear": 11.6, "spline": 11.6, "causal": 10.0}[interpolation]
    assert omega == pytest.approx(expected, abs=0.05)
    assert chosen.interpolation == interpolation


@pytest.mark.parametrize("source", ["fit", "83,58,12", "turn.csv"])
def test_refining_corrects_what_the_residuals_show(files: Path, turning_scene: Events, source: str) -> None:
    if source == "turn.csv":
        Path(source).write_text("timestamp,center_x,center_y,omega_rad_s\n0,83,58,12\n0.1,83,58,12\n", encoding="utf-8")
    refined = found(source, lambda: turning_scene, refine=True)
    (cx, cy), omega = refined.feed.trajectory.mean()  # type: ignore[misc, union-attr]
    assert (cx, cy) == pytest.approx(CENTER, abs=1.0)
    assert omega == pytest.approx(13.0, rel=0.01)
    assert refined.diagnoses[-1].kind == "none"
    assert (refined.fit is not None) == (source == "fit")


@pytest.mark.parametrize(
    ("source", "motion", "estimate", "message"),
    [
        ("gyro", {}, {}, r"--motion gyro: no gyroscope is given; name its file with --gyro"),
        ("track", {"refine": True}, {}, r"--refine: track follows the motion by itself"),
        ("gyro", {"refine": True}, {"gyro": "gyro.csv"}, r"--refine: gyro follows"),
        ("field.csv", {"refine": True}, {}, r"--refine: field\.csv is no rotation"),
        ("m.schedule", {"refine": True}, {}, r"m\.schedule: a schedule file is run as it is"),
        ("m.schedule", {"path": "float"}, {}, r"m\.schedule: a schedule file is run as it is"),
        ("m.schedule", {"interpolation": "linear"}, {}, r"m\.schedule: a schedule file is run as it is"),
        ("track", {"interpolation": "spline"}, {}, r"--motion-interpolation spline: serves CSV files, not track"),
        ("field.csv", {"interpolation": "spline"}, {}, r"--motion-interpolation spline: interpolation must be linear"),
        ("other.schedule", {}, {}, r"made for a horizon of 20000 µs, the run has 12000 µs \(--horizon-us\)"),
        ("fit", {}, {"gyro": "gyro.csv"}, r"--gyro gyro\.csv: serves --motion track and --motion gyro, not fit"),
        ("m.schedule", {}, {"gyro": "gyro.csv"}, r"--gyro gyro\.csv: serves .* not m\.schedule"),
        (
            "80,60,1",
            {},
            {"calibration": "lens.toml"},
            r"--calibration lens\.toml: serves --motion gyro and .* not 80,60,1",
        ),
        ("turn.csv", {}, {"calibration": "lens.toml"}, r"--calibration lens\.toml: serves .* not turn\.csv"),
        ("camera.csv", {}, {}, r"--motion camera\.csv: turns about three axes .* --calibration"),
        ("camera.csv", {"refine": True}, {"calibration": "lens.toml"}, r"--refine: camera\.csv is no rotation"),
        (
            "camera.csv",
            {"interpolation": "spline"},
            {"calibration": "lens.toml"},
            r"--motion-interpolation spline: serves files of rot",
        ),
        ("track", {}, {"calibration": "lens.toml", "gyro": "gyro.csv"}, r"--calibration lens\.toml: serves"),
        ("track", {}, {"gyro": "gyro.csv", "gyro_axes": "x,x,z"}, r"--gyro-axes: .* 'x,x,z'"),
        ("track", {}, {"window_us": 7}, r"\[estimate\] window_us"),
        ("nowhere.csv", {}, {}, r"there is no such file; expected fit, track, gyro"),
    ],
)
def test_settings_that_contradict_each_other_are_refused_in_one_line(
    files: Path, source: str, motion: dict[str, Any], estimate: dict[str, Any], message: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        found(source, estimate=estimate, **motion)
    assert re.search(message, str(caught.value))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("source", "estimate", "message"),
    [
        ("broken.schedule", {}, r"broken\.schedule: row 2, fraction_bits"),
        ("flat.schedule", {}, r"flat\.schedule: cannot be run backwards"),
        ("gyro", {"gyro": "absent.csv"}, r"absent\.csv: no such file"),
        ("gyro", {"gyro": "gyro.csv", "calibration": "absent.toml"}, r"absent\.toml"),
        ("gyro", {"gyro": "turn.csv"}, r"turn\.csv: "),
    ],
)
def test_a_fault_in_a_file_names_the_file(files: Path, source: str, estimate: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        found(source, estimate=estimate)


def test_the_files_that_a_motion_is_read_from_are_named(files: Path) -> None:
    estimate = EstimateSettings(gyro="gyro.csv", calibration="lens.toml")
    assert motion_inputs(Settings(motion=MotionSettings(source="gyro"), estimate=estimate)) == [
        Path("gyro.csv"), Path("lens.toml"),
    ]  # fmt: skip
    assert motion_inputs(Settings(motion=MotionSettings(source="turn.csv"))) == [Path("turn.csv")]
    assert motion_inputs(Settings(motion=MotionSettings(source="x" * 5000))) == []
