"""Check what ``tiegocancel simulate`` writes and says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import RotationTrajectory, read_events
from tiegocancel.cli import main

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
