"""The command line as a user meets it: files on disk, numbers on stdout, talk on stderr, one line for an error."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import Events, read_events, write_events
from tiegocancel.cli import main
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.presets import PRESETS

CENTER, OMEGA = (60.0, 50.0), 20.0
MOTION = f"{CENTER[0]},{CENTER[1]},{OMEGA}"


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Thirty turning markers over 60 ms, as NPZ."""
    rng = np.random.default_rng(5)
    t = np.arange(0, 60_000, 100)
    radius, angle = 8 + 35 * rng.random(30), 2 * np.pi * rng.random(30)
    turned = angle + OMEGA * t[:, None] * 1e-6
    x = np.floor(CENTER[0] + radius * np.cos(turned) + 0.5).astype(int)
    y = np.floor(CENTER[1] + radius * np.sin(turned) + 0.5).astype(int)
    fresh = np.ones_like(x, bool)
    fresh[1:] = (np.diff(x, axis=0) != 0) | (np.diff(y, axis=0) != 0)
    n = int(fresh.sum())
    path = tmp_path_factory.mktemp("run") / "ring.npz"
    write_events(path, Events(np.repeat(t, 30)[fresh.ravel()], x[fresh], y[fresh], np.ones(n, int), 128, 96))
    return path


def run_json(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, object]:
    assert main([str(a) for a in arguments]) == 0
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 1
    numbers: dict[str, object] = json.loads(captured.out)
    return numbers


def test_run_writes_residual_report_figures_and_manifest(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a" / "b"
    numbers = run_json(capsys, "run", source, "--motion", MOTION, "--out", out, "--json")
    keys = {
        "events", "suppressed", "cancellation_ratio", "cancellation_ratio_pairs", "controls", "motion", "counters",
        "selectivity", "seconds", "events_per_second", "regions", "verdict", "state",
    }  # fmt: skip
    assert keys <= set(numbers)
    assert set(numbers["controls"]) == {"zero_motion", "reversed_motion", "time_shuffled"}  # type: ignore[call-overload]
    assert numbers["motion"]["center_px"] == list(CENTER)  # type: ignore[index]
    residual = read_events(out / "residual.npz")
    assert len(residual) == numbers["events"] - numbers["suppressed"]  # type: ignore[operator]
    assert (residual.width, residual.height) == (128, 96)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "data:image/png;base64," in page
    assert not re.search(r"(src|href)=.?https?:", page)
    assert "$" not in re.sub(r"base64,[^\"]*", "", page)
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["results"] == numbers
    assert manifest["command"][:2] == ["tiegocancel", "run"]
    assert manifest["inputs"][0]["bytes"] == source.stat().st_size
    assert {"report.html", "residual.npz", "before_after.png", "controls.png"} <= set(manifest["outputs"])


def test_flags_override_the_file_which_overrides_the_defaults(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "run.toml"
    config.write_text(
        f'[read]\nformat = "npz"\n[cancel]\nhorizon_us = 9000\ntolerance_px = 1.0\n[motion]\nsource = "{MOTION}"\n'
        "[output]\nfigures = false\n[report]\ncontrols = false\n",
        encoding="utf-8",
    )
    out = tmp_path / "out"
    run_json(capsys, "run", source, "--config", config, "--horizon-us", 7000, "--out", out, "--json")
    settings = json.loads((out / "manifest.json").read_text(encoding="utf-8"))["settings"]
    default = CancelConfig()
    changed = {key for key, value in settings["cancel"].items() if value != _listed(getattr(default, key))}
    assert changed == {"horizon_us", "tolerance_px"}
    assert (settings["cancel"]["horizon_us"], settings["cancel"]["tolerance_px"]) == (7000, 1.0)
    assert settings["read"]["format"] == "npz"
    assert not list(out.glob("*.png"))
    config.write_text('[read]\nformat = "evt3"\n', encoding="utf-8")
    assert main(["run", str(source), "--config", str(config), "--motion", MOTION, "--out", str(out)]) == 1
    assert "ring.npz" in capsys.readouterr().err


def _listed(value: object) -> object:
    """Return a value as JSON gives it back."""
    return list(value) if isinstance(value, tuple) else value


def test_a_preset_lies_under_file_and_flags(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "run.toml"
    config.write_text('[cancel]\npreset = "lean"\nneed = 2\n', encoding="utf-8")
    out = tmp_path / "out"
    given = ("--motion", MOTION, "--config", config, "--carry", 7, "--no-figures", "--out", out, "--json")
    run_json(capsys, "run", source, *given)
    cancel = json.loads((out / "manifest.json").read_text(encoding="utf-8"))["settings"]["cancel"]
    assert cancel == {key: _listed(value) for key, value in asdict(CancelConfig()).items()} | {
        **PRESETS["lean"], "need": 2, "carry": 7,
    }  # fmt: skip
    assert main(["run", str(source), "--motion", MOTION, "--preset", "selectiv", "--out", str(out)]) == 2
    assert "did you mean 'selective'?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["run", "absent.npz"], 1, r"absent\.npz: no such file"),
        (["run", "{source}", "--motion", "1,2"], 2, r"--motion '1,2'"),
        (["run", "{source}", "--motion", "absent.csv"], 2, r"absent\.csv"),
        (
            ["run", "{source}", "--motion", MOTION, "--horizon-us", "-4"],
            2,
            r"horizon_us must be an integer from 0 .* not -4",
        ),
        (["run", "{source}", "--motion", MOTION, "--ring-capacity", "0"], 2, r"ring_capacity .* not 0"),
        (["run", "{source}", "--motion", MOTION, "--residual", "xyz"], 2, r"xyz"),
        (["run", "{source}", "--motion", MOTION, "--config", "absent.toml"], 2, r"absent\.toml"),
        (["run", "{source}", "--motion", MOTION, "--out", "{source}"], 2, r"--out"),
    ],
)
def test_bad_input_is_one_clear_line(
    arguments: list[str],
    code: int,
    message: str,
    source: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([argument.format(source=source) for argument in arguments]) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = [line for line in captured.err.splitlines() if not line.startswith("note:")]
    assert len(lines) == 1
    assert re.search(message, lines[0])


def test_a_torn_recording_leaves_what_came_before_on_disk(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = tmp_path / "whole.raw"
    write_events(whole, read_events(source))
    torn = tmp_path / "torn.raw"
    torn.write_bytes(whole.read_bytes()[:-1001])
    out = tmp_path / "out"
    arguments = ["run", str(torn), "--motion", MOTION, "--out", str(out), "--no-figures"]
    assert main(arguments) == 1
    captured = capsys.readouterr()
    assert re.search(r"torn\.raw: byte \d+", captured.err)
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["results"]["fault"]
    kept = len(read_events(out / "residual.npz"))
    assert kept == manifest["results"]["residual"] > 0
    assert main([*arguments, "--keep-going"]) == 0


def test_a_sensor_declared_too_small_names_the_row_and_the_value(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["run", str(source), "--motion", MOTION, "--width", "64", "--no-figures", "--out", str(tmp_path)]
    assert main(arguments) == 1
    assert re.search(r"ring\.npz: row \d+: x is \d+, expected 0 to 63", capsys.readouterr().err)


def test_an_interrupted_run_reports_what_it_did(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from tiegocancel.files.reader import EventReader

    def interrupted(self: EventReader) -> Iterator[Events]:
        yield read_events(source)[:500]
        raise KeyboardInterrupt

    monkeypatch.setattr(EventReader, "__iter__", interrupted)
    assert main(["run", str(source), "--motion", MOTION, "--out", str(tmp_path), "--no-figures"]) == 130
    monkeypatch.undo()
    assert capsys.readouterr().err.splitlines()[-1] == "tiegocancel: interrupted"
    results = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))["results"]
    assert (results["fault"], results["events"]) == ("interrupted", 500)
    assert len(read_events(tmp_path / "residual.npz")) == results["residual"]


def test_an_empty_recording_is_said_to_be_empty(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "empty.npz"
    write_events(path, Events.empty(8, 8))
    assert main(["run", str(path), "--motion", "4,4,1", "--out", str(tmp_path / "out")]) == 1
    assert "holds no events" in capsys.readouterr().err


@pytest.mark.parametrize("residual", ["npz", "npy", "csv", "evt2"])
def test_residual_is_written_in_the_format_asked_for(
    residual: str, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    numbers = run_json(
        capsys, "run", source, "--motion", MOTION, "--residual", residual, "--no-figures", "--out", out, "--json"
    )
    path = out / {"evt2": "residual.raw"}.get(residual, f"residual.{residual}")
    assert len(read_events(path, width=128, height=96)) == numbers["residual"]


def test_demo_is_selective_and_fills_its_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "demo"
    numbers = run_json(capsys, "demo", "--duration", "0.12", "--no-figures", "--out", out, "--json")
    assert numbers["verdict"]["grade"] == "selective"  # type: ignore[index]
    assert numbers["selectivity"]["j"] > 0.6  # type: ignore[index]
    assert numbers["motion"]["rim_displacement_px"] > 30  # type: ignore[index]
    assert read_events(out / "residual.npz").label is not None


def test_demo_takes_a_scene_from_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "small.toml"
    config.write_text("[scene]\nwidth = 160\nheight = 90\n[cancel]\nhorizon_us = 30000\n", encoding="utf-8")
    numbers = run_json(
        capsys, "demo", "--duration", "0.08", "--config", config, "--out", tmp_path / "o", "--no-figures", "--json"
    )
    assert numbers["sensor"] == {"width": 160, "height": 90}


def test_run_refuses_to_overwrite_its_input(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run_json(capsys, "run", source, "--motion", MOTION, "--no-figures", "--out", tmp_path, "--json")
    residual = tmp_path / "residual.npz"
    before = residual.read_bytes()
    assert main(["run", str(residual), "--motion", MOTION, "--no-figures", "--out", str(tmp_path)]) == 2
    assert "residual.npz there is the input itself" in capsys.readouterr().err
    assert residual.read_bytes() == before


def test_a_folder_used_again_holds_only_the_new_run_and_what_is_not_ours(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.txt").write_text("keep", encoding="utf-8")
    run_json(capsys, "run", source, "--motion", MOTION, "--residual", "csv", "--out", tmp_path, "--json")
    assert (tmp_path / "residual.csv").exists()
    run_json(capsys, "run", source, "--motion", MOTION, "--no-figures", "--out", tmp_path, "--json")
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "manifest.json", "mine.txt", "report.html", "residual.npz",
    ]  # fmt: skip
    manifest = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["outputs"] == ["report.html", "residual.npz"]


def test_a_centre_left_of_the_sensor_may_be_given(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    numbers = run_json(capsys, "run", source, "--motion", "-300,60,0.3", "--no-figures", "--out", tmp_path, "--json")
    assert numbers["motion"]["center_px"] == [-300, 60]  # type: ignore[index]
    assert numbers["disc_seen"] is False


def test_motion_known_for_another_time_is_told(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    track = tmp_path / "far.csv"
    track.write_text("timestamp,center_x,center_y,omega_rad_s\n100,60,50,20\n101,60,50,20\n", encoding="utf-8")
    numbers = run_json(capsys, "run", source, "--motion", track, "--no-figures", "--out", tmp_path / "o", "--json")
    notes = " ".join(numbers["notes"])  # type: ignore[arg-type]
    assert "known from 100.000000 to 101.000000 s" in notes
    assert "for 100% of that time" in notes


def test_a_schedule_beyond_memory_is_refused_by_name(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    track = tmp_path / "epoch.csv"
    track.write_text("timestamp,center_x,center_y,omega_rad_s\n0,60,50,20\n1700000000,60,50,20\n", encoding="utf-8")
    assert main(["run", str(source), "--motion", str(track), "--out", str(tmp_path / "o")]) == 2
    assert "--schedule-step-us" in capsys.readouterr().err
    assert main(["run", str(source), "--motion", str(track), "--motion-path", "float", "--out", str(tmp_path)]) == 0


def test_a_file_name_that_is_no_text_is_reported_on(source: Path, tmp_path: Path) -> None:
    odd = tmp_path / os.fsdecode(b"odd\xff.npz")
    odd.write_bytes(source.read_bytes())
    assert main(["run", str(odd), "--motion", MOTION, "--no-figures", "--out", str(tmp_path / "o")]) == 0
    assert json.loads((tmp_path / "o" / "manifest.json").read_text(encoding="utf-8"))["results"]["events"] > 0


@pytest.fixture(scope="module")
def shaken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A camera that pans and rolls fast for 0.3 s, with gyroscope and calibration beside the recording."""
    folder = tmp_path_factory.mktemp("shaken")
    (folder / "fast.toml").write_text(
        "[camera_scene]\nwidth = 240\nheight = 180\n[camera_scene.motion]\npan_rad_s = 1.5\ntilt_rad_s = 1.2\n"
        "roll_rad_s = 2.0\npan_drift_rad_s = 1.0\n",
        encoding="utf-8",
    )
    path = folder / "cam.npz"
    arguments = ["--scene", "camera", "--duration", "0.3", "--config", str(folder / "fast.toml")]
    assert main(["simulate", str(path), *arguments]) == 0
    return path


def test_a_gyroscope_with_calibration_beats_every_control_and_the_turn_about_one_axis(
    shaken: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gyro, lens = shaken.with_name("cam.gyro.csv"), shaken.with_name("cam.calibration.toml")
    common = ("run", shaken, "--motion", "gyro", "--gyro", gyro, "--horizon-us", 20_000, "--no-figures", "--json")
    whole = run_json(capsys, *common, "--calibration", lens, "--out", tmp_path / "three")
    controls = whole["controls"]
    assert whole["cancellation_ratio"] > 0.4 > 2 * max(controls.values())  # type: ignore[attr-defined, operator]
    assert whole["selectivity"]["j"] > 0.3  # type: ignore[index]
    assert "camera turns" in whole["motion"]["described"]  # type: ignore[index]
    assert any("px off" in note for note in whole["notes"])  # type: ignore[attr-defined]
    manifest = json.loads((tmp_path / "three" / "manifest.json").read_text(encoding="utf-8"))
    assert [Path(record["path"]).name for record in manifest["inputs"]] == [
        "cam.npz", "cam.gyro.csv", "cam.calibration.toml",
    ]  # fmt: skip
    rolled = run_json(capsys, *common, "--out", tmp_path / "one")
    assert rolled["cancellation_ratio"] < 0.5 * whole["cancellation_ratio"]  # type: ignore[operator]
    assert any("the camera's axes are x,y,z" in note for note in rolled["notes"])  # type: ignore[attr-defined]
    assert (tmp_path / "one" / "motion.csv").exists()


def test_events_and_gyroscope_are_fused(shaken: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gyro = shaken.with_name("cam.gyro.csv")
    numbers = run_json(
        capsys, "run", shaken, "--motion", "track", "--gyro", gyro, "--no-figures", "--json", "--out", tmp_path
    )
    assert numbers["motion"]["source"] == "track, cam.gyro.csv"  # type: ignore[index]
    assert numbers["motion"]["estimates"] > 250  # type: ignore[index]
    assert any("the camera's axes" in note for note in numbers["notes"])  # type: ignore[attr-defined]


def test_a_schedule_file_runs_as_the_file_that_made_it_and_for_its_horizon_alone(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from tiegocancel import RotationTrajectory
    from tiegocancel.motion.schedule_file import write_schedule

    track, made = tmp_path / "m.csv", tmp_path / "m.schedule"
    times = np.array([0, 25_000, 60_000])
    motion = RotationTrajectory(t_us=times, center_px=np.array([CENTER] * 3), omega_rad_s=np.array([19, 20.5, 20.0]))
    motion.to_csv(track)
    write_schedule(motion.schedule(12_000), made)
    common = ("--horizon-us", 12_000, "--no-figures", "--json")
    by_csv = run_json(capsys, "run", source, "--motion", track, *common, "--out", tmp_path / "a")
    by_schedule = run_json(capsys, "run", source, "--motion", made, *common, "--out", tmp_path / "b")
    assert by_csv["counters"] == by_schedule["counters"]
    assert read_events(tmp_path / "a/residual.npz").t.tolist() == read_events(tmp_path / "b/residual.npz").t.tolist()
    assert by_schedule["cancellation_ratio"] > 0.5
    arguments = ["run", str(source), "--motion", str(made), "--horizon-us", "9000", "--out", str(tmp_path / "c")]
    assert main(arguments) == 2
    assert "made for a horizon of 12000 µs, the run has 9000 µs (--horizon-us)" in capsys.readouterr().err


def test_refining_says_what_was_wrong(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = ("--horizon-us", 10_000, "--no-figures", "--no-controls", "--json", "--out", tmp_path / "o")
    numbers = run_json(capsys, "run", source, "--motion", "61.5,48.5,19", "--refine", *common)
    notes = " ".join(numbers["notes"])  # type: ignore[arg-type]
    assert "refining:" in notes
    assert main(["run", str(source), "--motion", "track", "--refine", "--out", str(tmp_path / "x")]) == 2
    assert "--refine: track follows the motion by itself" in capsys.readouterr().err


def test_the_demo_tracks_its_own_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "small.toml"
    config.write_text("[scene]\nwidth = 320\nheight = 180\n", encoding="utf-8")
    arguments = (
        "demo",
        "--motion",
        "track",
        "--duration",
        "0.15",
        "--config",
        config,
        "--out",
        tmp_path / "o",
        "--json",
    )
    numbers = run_json(capsys, *arguments)
    assert numbers["motion"]["omega_rad_s"] == pytest.approx(3.6, rel=0.1)  # type: ignore[index]
    assert numbers["verdict"]["grade"] == "selective"  # type: ignore[index]
    outputs = json.loads((tmp_path / "o" / "manifest.json").read_text(encoding="utf-8"))["outputs"]
    assert {"motion.csv", "motion.png", "residual_profile.png"} <= set(outputs)
    assert "The motion found on the way" in (tmp_path / "o" / "report.html").read_text(encoding="utf-8")


def test_rows_survive_a_torn_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", str(tmp_path / "d.raw"), "--duration", "0.1", "--width", "320", "--height", "180"]) == 0
    torn = tmp_path / "torn.raw"
    torn.write_bytes((tmp_path / "d.raw").read_bytes()[:-10_001])
    out = tmp_path / "out"
    assert main(["run", str(torn), "--motion", "track", "--no-figures", "--out", str(out)]) == 1
    assert re.search(r"torn\.raw: byte \d+", capsys.readouterr().err)
    results = json.loads((out / "manifest.json").read_text(encoding="utf-8"))["results"]
    assert results["fault"]
    assert len((out / "motion.csv").read_text(encoding="utf-8").splitlines()) == 1 + results["motion"]["estimates"] > 2


def test_a_recording_in_which_nothing_moves_is_passed_on_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_events(tmp_path / "one.npz", Events([5], [1], [2], [1], 8, 8))  # type: ignore[arg-type]
    numbers = run_json(capsys, "run", tmp_path / "one.npz", "--motion", "track", "--out", tmp_path / "o", "--json")
    assert (numbers["events"], numbers["suppressed"]) == (1, 0)
    assert any("no motion was found" in note for note in numbers["notes"])  # type: ignore[attr-defined]
