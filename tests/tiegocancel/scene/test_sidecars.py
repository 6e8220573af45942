"""Check the files beside a recording: exact, complete and named after it."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import RotationTrajectory
from tiegocancel.scene import (
    CameraSceneConfig,
    RigConfig,
    SceneConfig,
    camera_truth,
    gyro_samples,
    write_sidecars,
)
from tiegocancel.scene.sidecars import write_rates


def table(path: Path) -> tuple[list[str], list[list[str]]]:
    header, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
    return header, rows


def test_the_camera_has_its_motion_its_gyroscope_and_its_calibration(tmp_path: Path) -> None:
    config = CameraSceneConfig(width=320, height=240, principal_px=(150.0, 121.5))
    paths = write_sidecars(config, tmp_path / "walk.raw", duration_s=0.05, seed=8)
    assert {name: path.name for name, path in paths.items()} == {
        "motion": "walk.motion.csv",
        "gyro": "walk.gyro.csv",
        "calibration": "walk.calibration.toml",
    }
    for name, column, (t_us, rates) in (
        ("motion", "omega", camera_truth(config, duration_s=0.05)),
        ("gyro", "gyro", gyro_samples(config, duration_s=0.05, seed=8)),
    ):
        header, rows = table(paths[name])
        assert header == ["timestamp", *(f"{column}_{axis}_rad_s" for axis in "xyz")]
        assert [round(float(row[0]) * 1e6) for row in rows] == t_us.tolist()
        np.testing.assert_array_equal([[float(cell) for cell in row[1:]] for row in rows], rates)
    assert tomllib.loads(paths["calibration"].read_text(encoding="utf-8")) == {
        "fx": 300.0, "fy": 300.0, "cx": 150.0, "cy": 121.5, "width": 320, "height": 240,
    }  # fmt: skip


def test_the_disc_has_the_trajectory_that_reads_back(tmp_path: Path) -> None:
    config = SceneConfig(rig=RigConfig(wobble_px=(5.0, 5.0), stop_go_hz=10.0))
    paths = write_sidecars(config, tmp_path / "disc.npz", duration_s=0.02)
    assert list(paths) == ["motion"]
    back = RotationTrajectory.from_csv(paths["motion"])
    np.testing.assert_array_equal(back.t_us, np.arange(0, 20_001, 1000))
    center_px, omega_rad_s = config.rig.motion_at(back.t_us * 1e-6)
    np.testing.assert_array_equal(back.center_px, center_px)
    np.testing.assert_array_equal(back.omega_rad_s, omega_rad_s)


@pytest.mark.parametrize(
    ("t_us", "text"), [(-1, "-0.000001"), (1_000_000, "1.000000"), (2**60, "1152921504606.846976")]
)
def test_times_are_exact(tmp_path: Path, t_us: int, text: str) -> None:
    write_rates(tmp_path / "rates.csv", "gyro", np.array([t_us], np.int64), np.zeros((1, 3)))
    assert table(tmp_path / "rates.csv")[1] == [[text, "0.0", "0.0", "0.0"]]
