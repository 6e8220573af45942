"""Every real recording goes through ``run``: numbers, controls and pictures, or a plain word that they show nothing."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tiegocancel.cli import main

Recording = Callable[[str], Path]
DISC = ("anu_disc_10ms.npy", "--width", "1280", "--height", "720", "--ring-capacity", "131072")
DISC_MOTION = ("--motion", "664.6,336.9,3.63", "--disc-radius-px", "264")


def run(recording: Recording, out: Path, capsys: pytest.CaptureFixture[str], name: str, *flags: str) -> dict[str, Any]:
    assert main(["run", str(recording(name)), *flags, "--out", str(out), "--json"]) == 0
    numbers: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert set(numbers["controls"]) == {"zero_motion", "reversed_motion", "time_shuffled"}
    assert (out / "report.html").stat().st_size > 5_000
    return numbers


def test_the_disc_beats_its_controls_at_a_selective_horizon(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    numbers = run(recording, tmp_path, capsys, *DISC, *DISC_MOTION)
    disc = numbers["regions"]["disc"]
    assert numbers["events"] == 98_626
    assert disc["cancellation_ratio"] == pytest.approx(0.62, abs=0.01)
    assert disc["controls"]["zero_motion"] == pytest.approx(0.30, abs=0.015)
    assert disc["controls"]["reversed_motion"] == pytest.approx(0.19, abs=0.01)
    assert numbers["verdict"]["grade"] == "selective"


def test_the_disc_at_half_a_millisecond_shows_nothing(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    numbers = run(recording, tmp_path, capsys, *DISC, *DISC_MOTION, "--horizon-us", "500", "--no-figures")
    disc = numbers["regions"]["disc"]
    assert disc["controls"]["zero_motion"] == pytest.approx(disc["cancellation_ratio"], abs=0.01)
    assert numbers["verdict"]["grade"] == "nothing"
    assert "shows nothing" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_the_disc_fitted_and_tracked_agree(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tracker = str(recording("anu_disc_tracker.csv"))
    for source in ("fit", tracker):
        numbers = run(recording, tmp_path, capsys, *DISC, "--motion", source, "--no-figures")
        assert numbers["motion"]["omega_rad_s"] == pytest.approx(3.64, rel=0.03)
        assert numbers["motion"]["center_px"] == pytest.approx([665, 337.5], abs=4)
        assert numbers["verdict"]["grade"] == "selective"


def test_the_spinning_dot_is_fitted_and_cancelled(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ("--tolerance-us", "300", "--ring-capacity", "131072")
    numbers = run(recording, tmp_path, capsys, "spinning_dot_evt2.raw", *flags)
    assert numbers["motion"]["omega_rad_s"] == pytest.approx(121.8, abs=1.5)
    assert numbers["motion"]["center_px"] == pytest.approx([314.4, 202.5], abs=3)
    assert numbers["motion"]["confident"] is True
    assert numbers["controls"]["zero_motion"] < 0.02
    assert numbers["cancellation_ratio"] > numbers["controls"]["zero_motion"] + 0.25


@pytest.mark.parametrize(
    ("name", "events"),
    [
        ("driving_evt3.raw", 219_596),
        ("davis346_imu.aedat4", 78_830),
        ("dvs128_moving_box.aedat", 489_834),
        ("ecd_shapes_rotation.txt", 9_058),
    ],
)
def test_recordings_without_a_rotation_run_and_say_that_they_show_nothing(
    name: str, events: int, recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if name.endswith("aedat4"):
        pytest.importorskip("eventcv", reason="AEDAT4 needs the files extra")
    numbers = run(recording, tmp_path, capsys, name)
    assert numbers["events"] == events
    assert numbers["motion"]["confident"] is False
    assert numbers["verdict"]["grade"] in {"nothing", "unknown"}
