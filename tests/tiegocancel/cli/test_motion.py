"""The verb ``motion`` as a user meets it: rows on disk, errors beside a truth, one line for whatever is wrong."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiegocancel import Events, RotationTrajectory, read_events, write_events
from tiegocancel.cli import main
from tiegocancel.estimation.estimates_csv import COLUMNS
from tiegocancel.motion.schedule_file import read_schedule

Invoke = Callable[..., tuple[int, str, list[str]]]


@pytest.fixture(scope="module")
def disc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small disc that turns for 0.12 s, with its truth beside it."""
    path = tmp_path_factory.mktemp("motion") / "disc.npz"
    assert main(["simulate", str(path), "--duration", "0.12", "--seed", "2", "--width", "320", "--height", "180"]) == 0
    return path


@pytest.fixture(scope="module")
def rolling(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A camera that rolls to and fro for 0.7 s; the stamps of its gyroscope are 12.3 ms late."""
    folder = tmp_path_factory.mktemp("rolling")
    (folder / "roll.toml").write_text(
        "[camera_scene]\nwidth = 160\nheight = 120\n[camera_scene.mover]\nenabled = false\n"
        "[camera_scene.motion]\npan_rad_s = 0.1\ntilt_rad_s = 0.1\nroll_rad_s = 6.0\nslowest_hz = 2.0\n"
        "[camera_scene.gyro]\ntime_offset_us = 12300\n",
        encoding="utf-8",
    )
    path = folder / "roll.npz"
    arguments = ["--scene", "camera", "--duration", "0.7", "--config", str(folder / "roll.toml")]
    assert main(["simulate", str(path), *arguments]) == 0
    return path


def table(path: str) -> list[dict[str, str]]:
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_rows_figure_schedule_and_manifest_are_written_and_agree(disc: Path, invoke: Invoke) -> None:
    truth = disc.with_name("disc.motion.csv")
    arguments = ("--truth", truth, "--schedule", "m.schedule", "--horizon-us", 20_000, "--schedule-step-us", 500)
    code, out, _ = invoke("motion", disc, *arguments, "--json")
    numbers = json.loads(out)
    rows = table("motion.csv")
    assert code == 0
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == numbers["estimates"] == 11
    assert numbers["errors"]["omega_share_median"] < 0.05
    assert numbers["errors"]["center_px_median"] < 3.0
    assert Path("motion.png").read_bytes().startswith(b"\x89PNG")
    schedule = read_schedule("m.schedule")
    assert schedule.horizon_us == 20_000
    assert set(np.diff(schedule.t_us[:40]).tolist()) == {500}
    assert schedule.t_us[0] == RotationTrajectory.from_csv("motion.csv").t_us[0]
    manifest = json.loads(Path("motion.manifest.json").read_text(encoding="utf-8"))
    assert manifest["results"] == numbers
    assert manifest["outputs"] == ["m.schedule", "motion.csv", "motion.png"]
    assert [Path(record["path"]).name for record in manifest["inputs"]] == ["disc.npz", "disc.motion.csv"]
    assert manifest["command"][:2] == ["tiegocancel", "motion"]


def test_the_text_says_rows_median_errors_and_where_they_are(disc: Path, invoke: Invoke) -> None:
    code, out, _ = invoke(
        "motion", disc, "--truth", disc.with_name("disc.motion.csv"), "--no-figures", "--out", "a.csv"
    )
    assert code == 0
    told = re.search(r"rows +11, (\d+) of them confident", out)
    assert told is not None
    assert int(told[1]) > 5
    assert re.search(r"median +centre \(16\d\.\d, 8\d\.\d\) px, ω \+3\.\d+ rad/s", out)
    assert "‖Δc‖ median" in out
    assert out.endswith("rows: a.csv\n")
    assert not Path("a.png").exists()


def test_the_rows_fed_to_run_decide_as_track_does(disc: Path, invoke: Invoke) -> None:
    assert invoke("motion", disc, "--no-figures")[0] == 0
    residuals, numbers = [], []
    for name, source in (("a", "track"), ("b", "motion.csv")):
        code, out, _ = invoke(
            "run", disc, "--motion", source, "--horizon-us", 20_000, "--no-figures", "--json", "--out", name
        )
        assert code == 0
        numbers.append(json.loads(out))
        residuals.append(read_events(Path(name) / "residual.npz"))
    assert residuals[0].t.tolist() == residuals[1].t.tolist()
    assert residuals[0].x.tolist() == residuals[1].x.tolist()
    assert numbers[0]["controls"] == numbers[1]["controls"]
    assert numbers[0]["cancellation_ratio"] > 2 * max(numbers[0]["controls"].values())
    assert Path("a/motion.csv").read_bytes() == Path("motion.csv").read_bytes()


def test_the_offset_of_a_simulated_gyroscope_is_found_within_the_sensors_dead_time(
    rolling: Path, invoke: Invoke
) -> None:
    gyro = rolling.with_name("roll.gyro.csv")
    code, out, lines = invoke("motion", rolling, "--gyro", gyro, "--find-offset", "--no-figures", "--json")
    told = [line for line in lines if "--gyro-offset-us" in line]
    assert code == 0
    assert len(told) == 1
    offset_us = int(told[0].split()[-1])
    assert offset_us == pytest.approx(-12_300, abs=2_000)
    assert any(re.search(r"gyro clock -\d+ ± \d+ µs to the event clock", note) for note in json.loads(out)["notes"])


def test_an_offset_that_cannot_be_found_is_said_to_be_unknown(disc: Path, invoke: Invoke) -> None:
    Path("gyro.csv").write_text(
        "timestamp,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s\n" + "".join(f"{i / 100:.2f},0,0,-3.6\n" for i in range(40)),
        encoding="utf-8",
    )
    code, _, lines = invoke("motion", disc, "--gyro", "gyro.csv", "--find-offset", "--no-figures")
    assert code == 0
    assert any("time offset unknown" in line for line in lines)


def test_a_gyroscope_alone_needs_no_structure_and_with_calibration_gives_three_axes(
    rolling: Path, invoke: Invoke
) -> None:
    gyro, lens = rolling.with_name("roll.gyro.csv"), rolling.with_name("roll.calibration.toml")
    arguments = ("--method", "gyro", "--gyro", gyro, "--calibration", lens, "--schedule", "m.schedule")
    code, _, lines = invoke("motion", rolling, *arguments)
    assert code == 0
    assert any("three-axis turn reduced to an affine schedule" in line for line in lines)
    assert len(lines) == len(set(lines))
    assert abs(read_schedule("m.schedule").coefficients[:, 3]).max() > 1000  # it turns
    assert {row["center_x"] for row in table("motion.csv")} == {"79.5"}
    # The rows serve a run as well, about all three axes.
    shared = ("--horizon-us", "8000", "--no-figures", "--calibration", lens)
    numbers = []
    for number, source in enumerate((("--motion", "gyro", "--gyro", gyro), ("--motion", "motion.csv"))):
        assert invoke("run", rolling, *source, *shared, "--out", f"run{number}", "--json")[0] == 0
        numbers.append(json.loads(Path(f"run{number}", "manifest.json").read_text(encoding="utf-8"))["results"])
    assert numbers[0]["cancellation_ratio"] == pytest.approx(numbers[1]["cancellation_ratio"], abs=0.01)


@pytest.mark.parametrize(("count", "rows"), [(1, 0), (8_000, 11)])
def test_a_recording_without_structure_gives_doubtful_rows_and_no_schedule(
    count: int, rows: int, invoke: Invoke
) -> None:
    rng = np.random.default_rng(0)
    t = np.sort(rng.integers(0, 115_000, count))
    t[-1] = 115_000
    write_events("noise.npz", Events(t, rng.integers(0, 64, count), rng.integers(0, 48, count), t % 2, 64, 48))
    code, out, lines = invoke("motion", "noise.npz")
    assert code == 0
    assert f"rows         {rows}, 0 of them confident" in out
    assert "note: no motion was found" in lines
    assert len(table("motion.csv")) == rows
    assert not Path("motion.png").exists()
    code, _, lines = invoke("motion", "noise.npz", "--schedule", "m.schedule")
    assert code == 1
    assert "note: no motion was found: no schedule is written" in lines
    assert not Path("m.schedule").exists()


def test_a_torn_recording_keeps_its_rows(disc: Path, invoke: Invoke) -> None:
    write_events("whole.raw", read_events(disc))
    Path("torn.raw").write_bytes(Path("whole.raw").read_bytes()[:-20_001])
    code, out, lines = invoke("motion", "torn.raw", "--json")
    assert code == 1
    assert re.search(r"tiegocancel: torn\.raw: byte \d+", lines[-1])
    assert 0 < len(table("motion.csv")) < 11
    assert json.loads(out)["fault"]
    assert invoke("motion", "torn.raw", "--keep-going", "--no-figures")[0] == 0


def test_an_interrupted_pass_keeps_its_rows(disc: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch) -> None:
    from tiegocancel.files.reader import EventReader

    def interrupted(self: EventReader) -> Iterator[Events]:
        yield read_events(disc).between(0, 60_000)
        raise KeyboardInterrupt

    monkeypatch.setattr(EventReader, "__iter__", interrupted)
    code, _, lines = invoke("motion", disc, "--no-figures")
    assert code == 130
    assert lines[-1] == "tiegocancel: interrupted"
    assert len(table("motion.csv")) == 5


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["absent.npz"], 1, r"absent\.npz: no such file"),
        (["empty.npz"], 1, r"empty\.npz: holds no events"),
        (["{disc}", "--truth", "absent.csv"], 1, r"absent\.csv"),
        (["{disc}", "--out", "no/where.csv"], 1, r"no/where\.csv: No such file"),
        (["{disc}", "--alpha", "2"], 2, r"\[estimate\]: alpha must lie in \(0, 1\], not 2"),
        (["{disc}", "--window-us", "7"], 2, r"\[estimate\] window_us"),
        (["{disc}", "--method", "gyro"], 2, r"--method gyro: no gyroscope is given; name its file with --gyro"),
        (["{disc}", "--find-offset"], 2, r"--find-offset: no gyroscope is given"),
        (["{disc}", "--gyro", "absent.csv"], 1, r"absent\.csv: no such file"),
        (["{disc}", "--calibration", "lens.toml"], 2, r"--calibration lens\.toml: serves --method gyro, not contrast"),
        (["{disc}", "--config", "method.toml"], 2, r"method\.toml \[estimate\] method must be one of 'contrast'"),
        (["{disc}", "--config", "key.toml"], 2, r"unknown key 'alpah'; did you mean 'alpha'"),
        (["copy.npz", "--out", "copy.npz"], 2, r"--out: copy\.npz would be written over copy\.npz"),
        (["copy.npz", "--schedule", "./copy.npz"], 2, r"--schedule: copy\.npz would be written over copy\.npz"),
        (["copy.npz", "--out", "t.csv", "--truth", "t.csv"], 2, r"--out: t\.csv would be written over t\.csv"),
        (["copy.npz", "--out", "m.png"], 2, r"its figure: m\.png would be written over --out"),
        (["copy.npz", "--out", "m.csv", "--schedule", "m.csv"], 2, r"--schedule: m\.csv would be written over --out"),
    ],
)
def test_what_is_wrong_is_one_clear_line(
    arguments: list[str], code: int, message: str, disc: Path, invoke: Invoke
) -> None:
    write_events("empty.npz", Events.empty(8, 8))
    Path("copy.npz").write_bytes(disc.read_bytes())
    Path("t.csv").write_bytes(disc.with_name("disc.motion.csv").read_bytes())
    Path("method.toml").write_text('[estimate]\nmethod = "guess"\n', encoding="utf-8")
    Path("key.toml").write_text("[estimate]\nalpah = 0.2\n", encoding="utf-8")
    figures = [] if "m.png" in arguments else ["--no-figures"]
    said = invoke("motion", *(word.format(disc=disc) for word in arguments), *figures)
    assert said[0] == code
    assert said[1] == ""
    lines = [line for line in said[2] if not line.startswith("note:")]
    assert len(lines) == 1
    assert re.search(message, lines[0])
    assert Path("copy.npz").read_bytes() == disc.read_bytes()
    assert Path("t.csv").read_bytes() == disc.with_name("disc.motion.csv").read_bytes()


@pytest.mark.parametrize("method", ["contrast", "circle"])
def test_any_chunk_of_reading_gives_the_same_rows(disc: Path, invoke: Invoke, method: str) -> None:
    rows: list[Any] = []
    for size in ("1048576", "700"):
        assert invoke("motion", disc, "--no-figures", "--method", method, "--chunk-events", size)[0] == 0
        rows.append(table("motion.csv"))
    assert rows[0] == rows[1]
    assert rows[0]
