"""``study-thesis`` reruns everything on a small disc, from one file, and takes up what was measured before."""

from __future__ import annotations

import csv
import json
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from tiegocancel.cli import main
from tiegocancel.study.sweep import Pace

SETTINGS = """
[simulate]
duration_s = 0.1
seed = 3
[scene]
width = 240
height = 180
[scene.rig]
omega_rad_s = 15.0
[thesis.windows]
count = 2
[thesis.grid]
horizons_us = [0, 1000, 2000, 6000, 8000]
tolerances_px = [1.0, 2.0]
tolerances_us = [1000]
heatmaps_us = [2000, 6000]
[thesis.bias]
omega_rad_s = [0.0, 0.05, 12.0]
center_px = [0.0, 5.0]
horizons_us = [2000]
[thesis.gates]
tolerances_us = [300, 1000]
[thesis.agreement]
tolerances_px = [2.0]
tolerances_us = [1000]
kept_shares = [1.0, 0.5]
[thesis.compensation]
windows = 1
[thesis.video]
frames = 3
[thesis.engine]
kind = "inline"
batch = 8
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("config") / "thesis.toml"
    path.write_text(SETTINGS, encoding="utf-8")
    return path


def test_the_built_in_disc_gives_a_page_tables_figures_and_a_verdict_for_each_claim(
    config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["study-thesis", "--config", str(config), "--out", str(out), "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["points"]["resumed"] == 0
    findings = {finding["what"]: finding for finding in numbers["findings"]}
    zero = findings["CR at Δt = 0, ten times the best of 525"]
    assert zero["ours"]["printed"] == "100.0 %"
    assert float(zero["ours"]["gated"].split()[0]) < 95
    assert "meet their own predictions" in zero["verdict"]
    assert "Δω" in next(what for what in findings if "0.05" in what)
    assert all(finding["verdict"].endswith(".") for finding in findings.values())
    page = (out / "report.html").read_text(encoding="utf-8").replace("&nbsp;", " ")
    figures = [*(f"Fig. 7.{number}" for number in range(1, 9)), "Table 7.1", "Table 7.2", "§8.3", "§8.4", "§8.6"]
    for words in (*figures, "rad/ms", "rev/s", "84.0 %", "contrast maximisation", "High-pass"):
        assert words in page, words
    with (out / "results.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) + len(numbers["agreement"]) == numbers["points"]["run"]
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["settings"]["thesis"]["windows"]["count"] == 2
    assert {"report.html", "results.csv", "summary.csv", "fig_7_1_horizons.png"} <= set(manifest["outputs"])
    assert all((out / name).stat().st_size > 0 for name in manifest["outputs"])

    assert (
        main(["study-thesis", "--config", str(config), "--out", str(out), "--json", "--no-figures", "--no-video"]) == 0
    )
    again = json.loads(capsys.readouterr().out)
    assert (again["points"]["run"], again["points"]["resumed"]) == (0, numbers["points"]["run"])
    assert again["findings"][:5] == numbers["findings"][:5]
    assert not (out / "fig_7_1_horizons.png").exists()


def test_ctrl_c_keeps_what_was_measured_and_the_same_command_goes_on(
    config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from tiegocancel.study.sweep import run as sweep

    original: Callable[..., Pace] = sweep.Stopwatch.advance
    seen: list[Pace] = []

    def advance(watch: sweep.Stopwatch, jobs: int) -> Pace:
        seen.append(original(watch, jobs))
        if len(seen) == 3:
            os.kill(os.getpid(), signal.SIGINT)
        return seen[-1]

    monkeypatch.setattr(sweep.Stopwatch, "advance", advance)
    command = ["study-thesis", "--config", str(config), "--out", str(tmp_path / "out"), "--no-figures", "--no-video"]
    assert main(command) == 130
    assert "goes on from" in capsys.readouterr().err
    monkeypatch.setattr(sweep.Stopwatch, "advance", original)
    assert main([*command, "--json"]) == 0
    points = json.loads(capsys.readouterr().out)["points"]
    assert points["resumed"] == seen[2].done
    assert points["run"] > 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--motion", "track"], "the thesis knows one rotation"),
        (["--cluster", "tcp://nobody", "--engine", "inline"], "--cluster says where jobs run"),
        (["--workers", "5000"], "workers must be from 0 to 1024"),
    ],
)
def test_what_cannot_work_is_one_line(
    arguments: list[str], words: str, config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study-thesis", "--config", str(config), "--out", str(tmp_path / "out"), *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") <= 2


def test_an_unknown_key_names_the_nearest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text("[thesis.grid]\nhorizon_us = [1]\n", encoding="utf-8")
    assert main(["study-thesis", "--config", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "horizons_us" in capsys.readouterr().err


@pytest.mark.slow
def test_the_disc_of_the_thesis_is_one_window_and_says_so(
    recording: Callable[[str], Path], config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = recording("anu_disc_10ms.npy")
    lean = tmp_path / "lean.toml"
    lean.write_text(config.read_text(encoding="utf-8").replace("windows = 1", "enabled = false"), encoding="utf-8")
    command = ["study-thesis", str(source), "--config", str(lean), "--motion", "664.6,336.9,3.63", "--width", "1280"]
    command += ["--height", "720", "--out", str(tmp_path / "out"), "--json", "--no-figures", "--no-video"]
    assert main(command) == 0
    captured = capsys.readouterr()
    assert "too little comes before W1" in captured.err
    findings = {finding["what"]: finding for finding in json.loads(captured.out)["findings"]}
    two = findings["CR on the disc, 2 ms"]["ours"]
    true, zero = (float(two[name].split()[0]) for name in ("gated", "zero"))
    assert true == pytest.approx(57.7, abs=1.5)
    assert abs(true - zero) < 5
