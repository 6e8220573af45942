"""Check what ``tiegocancel simulate`` writes and says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import RotationTrajectory, read_events
from tiegocancel.cli import main
from tiegocancel.scene import SCENES

SIZE = ("--width", "320", "--height", "180")


@pytest.mark.parametrize("suffix", ["npz", "csv", "raw"])
def test_the_recording_reads_back_with_its_labels_and_its_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str
) -> None:
    out = tmp_path / f"disc.{suffix}"
    assert main(["simulate", str(out), "--duration", "0.03", "--seed", "4", *SIZE, "--omega", "-2.5", "--json"]) == 0
    said = capsys.readouterr()
    numbers = json.loads(said.out)
    assert len([line for line in said.err.splitlines() if not line.startswith("note: ")]) == 1
    events = read_events(out, **({"time_unit": "us"} if suffix == "csv" else {}))
    assert (events.width, events.height, len(events)) == (320, 180, numbers["events"])
    counts = np.bincount(np.asarray(events.label), minlength=3)
    assert numbers["labels"] == dict(zip(("ego", "mover", "noise"), counts.tolist(), strict=True))
    truth = RotationTrajectory.from_csv(tmp_path / "disc.motion.csv")
    assert truth.omega_rad_s.tolist() == [-2.5, -2.5]
    assert truth.t_us.tolist() == [0, 30_000]
    assert numbers["paths"] == {"events": str(out), "motion": str(tmp_path / "disc.motion.csv")}


def test_flags_override_the_file_and_leave_the_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "scene.toml"
    file.write_text("[simulate]\nduration_s = 0.02\n[scene]\nwidth = 64\nheight = 48\n[scene.rig]\nomega_rad_s = 9.0\n")
    out = tmp_path / "small.npz"
    assert main(["simulate", str(out), "--config", str(file), "--width", "80", "--no-mover", "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert (numbers["width"], numbers["height"], numbers["duration_s"]) == (80, 48, 0.02)
    assert numbers["motion"]["omega_rad_s"] == 9.0
    assert numbers["labels"]["mover"] == 0


def test_the_rolling_camera_has_a_gyroscope_and_a_calibration(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "walk.npz"
    flags = ["--scene", "camera", "--duration", "0.02", "--seed", "4", "--width", "160", "--height", "120", "--json"]
    assert main(["simulate", str(out), *flags]) == 0
    said = capsys.readouterr()
    numbers = json.loads(said.out)
    assert len([line for line in said.err.splitlines() if not line.startswith("note: ")]) == 1
    assert (numbers["scene"], numbers["width"], numbers["height"]) == ("camera", 160, 120)
    assert numbers["motion"]["focal_px"] == 150.0
    names = {"events": "npz", "motion": "motion.csv", "gyro": "gyro.csv", "calibration": "calibration.toml"}
    assert numbers["paths"] == {name: str(tmp_path / f"walk.{suffix}") for name, suffix in names.items()}
    assert all(Path(path).exists() for path in numbers["paths"].values())
    events = read_events(out)
    assert (len(events), events.width, events.height) == (numbers["events"], 160, 120)


def test_the_file_may_choose_the_camera_and_flags_reach_its_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(
        '[simulate]\nkind = "camera"\nduration_s = 0.01\n[camera_scene]\nwidth = 64\nheight = 48\n'
        "[camera_scene.motion]\nroll_rad_s = 2.0\nrest_s = 0.005\n"
    )
    command = ["simulate", str(tmp_path / "small.npz"), "--config", str(file), "--json"]
    assert main([*command, "--height", "50", "--no-mover"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert (numbers["width"], numbers["height"], numbers["labels"]["mover"]) == (64, 50, 0)
    assert (numbers["motion"]["roll_rad_s"], numbers["motion"]["rest_s"]) == (2.0, 0.005)
    assert main([*command, "--scene", "disc", "--height", "50"]) == 0
    assert json.loads(capsys.readouterr().out)["width"] == 1280


def test_a_scene_of_the_library_lies_under_the_file_and_the_flags(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(
        '[simulate]\nkind = "noisy"\nduration_s = 0.02\n[scene]\nwidth = 320\nheight = 180\n'
        "[scene.sensor]\nhot_pixels = 0\n"
    )
    command = ["simulate", str(tmp_path / "out.npz"), "--config", str(file), "--json"]
    assert main(command) == 0
    numbers = json.loads(capsys.readouterr().out)
    # 1 Hz of noise a pixel is the scene's own, and no hot pixels are the file's.
    assert numbers["scene"] == "noisy"
    assert numbers["labels"]["noise"] == pytest.approx(0.02 * 320 * 180, rel=0.15)
    assert main([*command, "--scene", "two-movers", "--relative", "0", "--omega", "2.5"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert (numbers["scene"], numbers["motion"]["omega_rad_s"], numbers["width"]) == ("two-movers", 2.5, 320)
    truth = RotationTrajectory.from_csv(tmp_path / "out.motion.csv")
    assert truth.omega_rad_s.tolist() == [2.5, 2.5]


def test_the_scenes_are_listed_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["simulate", "--list-scenes"])
    assert caught.value.code == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(SCENES)
    assert max(map(len, lines)) <= 120


def test_no_time_writes_an_empty_recording(tmp_path: Path) -> None:
    out = tmp_path / "none.npz"
    assert main(["simulate", str(out), "--duration", "0", *SIZE]) == 0
    assert len(read_events(out)) == 0


@pytest.mark.parametrize(
    ("table", "flags", "message"),
    [
        ("[scene]\nwidht = 3\n", [], "did you mean 'width'"),
        ("scene = 3\n", ["--width", "5"], "scene must be a table"),
        ("[scene.rig]\nradius_px = 0\n", [], "radius_px must be a finite number above 0"),
        ("", ["--duration", "-1"], "duration_s must be from 0"),
        ("", ["--scene", "camera", "--omega", "2"], "--omega belongs to the disc"),
        ('[simulate]\nkind = "hand"\n', [], "'camera', 'pan', 'two-movers', not 'hand'"),
        ("", ["--scene", "dics"], "--scene must be one of 'disc'"),
        ("", ["--scene", "dics"], "did you mean 'disc'"),
        ("", ["--scene", "pan", "--omega", "2"], "--omega belongs to the disc"),
        ("", ["--relative", "2"], "--relative belongs to the scene two-movers, not to disc"),
        ("simulate = 3\n", ["--scene", "camera"], "simulate must be a table"),
        ("[camera_scene.motion]\ntones = 0\n", ["--scene", "camera"], "tones must be an integer from 1 to 16"),
    ],
)
def test_wrong_settings_are_one_line_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], table: str, flags: list[str], message: str
) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(table)
    assert main(["simulate", str(tmp_path / "out.npz"), "--config", str(file), *flags]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert len([line for line in said.err.splitlines() if not line.startswith("note: ")]) == 1
    assert not (tmp_path / "out.npz").exists()
