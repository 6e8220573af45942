"""``tiegocancel budget`` prints and writes verdicts, and says by its exit code when a budget is exceeded."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tiegocancel.cli import main


@pytest.fixture(scope="module")
def disc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("budget")
    (folder / "scene.toml").write_text("[scene]\nwidth = 160\nheight = 120\n", encoding="utf-8")
    path = folder / "disc.npz"
    assert main(["simulate", str(path), "--duration", "0.12", "--config", str(folder / "scene.toml")]) == 0
    return path


def budget(disc: Path, out: Path, *more: str) -> int:
    motion = ("--motion", str(disc.with_name("disc.motion.csv")))
    return main(["budget", str(disc), *motion, "--out", str(out), *more])


def test_a_part_that_passes(disc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = ("--horizon-us", "20000", "--ring-capacity", "4096", "--target", "ecp5-45f", "--json")
    assert budget(disc, tmp_path / "out", *flags) == 0
    numbers = json.loads(capsys.readouterr().out)
    [one] = numbers["targets"]
    assert one["fits"] is one["keeps_up"] is one["decisions_equal_golden"] is True
    assert one["drops"] == 0
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {"budget.json", "budget.txt", "budget.png", "budget-ecp5-45f.png", "manifest.json"}
    assert json.loads((tmp_path / "out" / "budget.json").read_text())["targets"] == numbers["targets"]


def test_a_part_that_fails_exits_with_3(disc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = ("--horizon-us", "20000", "--target", "ice40hx8k", "--target", "ecp5-85f", "--no-figures", "--no-changes")
    assert budget(disc, tmp_path / "out", *flags) == 3
    said = capsys.readouterr().out
    assert "ice40hx8k: does not fit" in said
    assert "ecp5-85f: fits and keeps up" in said


def test_without_a_configuration_each_part_gets_one_that_is_planned_for_it(
    disc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = budget(disc, tmp_path / "out", "--target", "ice40up5k", "--no-figures", "--no-changes")
    said = capsys.readouterr()
    assert code in (0, 3)
    assert "note: ice40up5k: planned c" in said.err


def test_an_unknown_part_names_the_nearest(disc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert budget(disc, tmp_path / "out", "--target", "ecp5-45") == 2
    assert "did you mean" in capsys.readouterr().err
    assert budget(disc, tmp_path / "out") == 2
    assert "--target: name a part or a file" in capsys.readouterr().err


def test_a_firmware_of_ones_own_is_judged_as_it_is(
    disc: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cycles = []
    for code in ("ram", "flash"):
        config = tmp_path / f"{code}.toml"
        config.write_text(f'[mcu]\ninput = "interrupt"\ncode = "{code}"\n', encoding="utf-8")
        flags = ("--horizon-us", "20000", "--ring-capacity", "1024", "--target", "stm32f405", "--architecture", "fixed")
        budget(disc, tmp_path / code, *flags, "--config", str(config), "--no-figures", "--no-changes", "--json")
        [one] = json.loads(capsys.readouterr().out)["targets"]
        assert f"an interrupt an event, code in {code}" in one["design"]
        cycles.append(one["cycles_per_event"]["mean"])
    assert cycles[0] <= cycles[1]
