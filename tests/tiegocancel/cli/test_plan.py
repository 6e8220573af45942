"""The verb ``plan`` as a user meets it: a configuration that ``run`` takes, or one line for whatever is wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tiegocancel.cli import main

Invoke = Callable[..., tuple[int, str, list[str]]]


@pytest.fixture(scope="module")
def disc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small disc that turns fast for 0.12 s, with its truth beside it."""
    folder = tmp_path_factory.mktemp("plan")
    (folder / "disc.toml").write_text("[scene.rig]\nomega_rad_s = 14.4\n", encoding="utf-8")
    path = folder / "disc.npz"
    sizes = ("--width", "320", "--height", "180", "--config", str(folder / "disc.toml"))
    assert main(["simulate", str(path), "--duration", "0.12", "--seed", "2", *sizes]) == 0
    return path


def test_the_plan_runs_as_it_was_planned(disc: Path, invoke: Invoke) -> None:
    motion = ("--motion", disc.with_name("disc.motion.csv"))
    code, out, _ = invoke("plan", disc, *motion, "--budget", 4, "--out", "p", "--json")
    assert code == 0
    numbers = json.loads(out)
    assert json.loads(Path("p/plan.json").read_text(encoding="utf-8")) == numbers
    assert Path("p/pareto.png").read_bytes().startswith(b"\x89PNG")
    manifest = json.loads(Path("p/manifest.json").read_text(encoding="utf-8"))
    assert manifest["outputs"] == ["pareto.png", "plan.json", "plan.toml"]
    rest = ("--config", "p/plan.toml", "--out", "r", "--no-figures", "--no-controls", "--residual", "none", "--json")
    code, out, _ = invoke("run", disc, *motion, *rest)
    assert code == 0
    ran = json.loads(Path("r/manifest.json").read_text(encoding="utf-8"))["settings"]["cancel"]
    assert ran == numbers["chosen"]["config"]


def test_the_table_names_the_choice_and_the_references(disc: Path, invoke: Invoke) -> None:
    arguments = ("--motion", disc.with_name("disc.motion.csv"), "--budget", 2, "--no-figures")
    code, out, _ = invoke("plan", disc, *arguments)
    lines = out.splitlines()
    assert code == 0
    assert [line.split()[0] for line in lines[1:-1]] == ["chosen", "smallest", "knee", "thesis", "default"]
    assert lines[-1] == f"plan: {Path('tiegocancel-plan', 'plan.toml')}"
    assert not Path("tiegocancel-plan/pareto.png").exists()


def test_the_ram_of_a_part_bounds_the_choice(disc: Path, invoke: Invoke) -> None:
    arguments = ("--motion", disc.with_name("disc.motion.csv"), "--budget", 2, "--no-figures", "--json")
    code, out, err = invoke("plan", disc, *arguments, "--target", "rp2040")
    numbers = json.loads(out)
    assert code == 0
    assert (numbers["limits"]["target"], numbers["limits"]["target_kib"]) == ("rp2040", 264.0)
    assert numbers["chosen"]["kib"] <= 264.0
    assert "note: rp2040 offers 264 KiB of RAM to ring and table" in err
    code, _, err = invoke("plan", disc, *arguments, "--target", "rp2041")
    assert (code, err) == (2, ["tiegocancel: unknown target 'rp2041'; did you mean 'rp2040'?"])


def test_limits_that_nothing_keeps_end_in_a_line_and_leave_the_numbers(disc: Path, invoke: Invoke) -> None:
    arguments = ("--motion", disc.with_name("disc.motion.csv"), "--budget", 1, "--max-kilobytes", 0.5, "--out", "p")
    code, _, err = invoke("plan", disc, *arguments)
    assert code == 1
    assert err[-1].startswith("tiegocancel: none of 1 operating points keeps within the limits")
    assert Path("p/plan.json").exists()
    assert not Path("p/plan.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("--budget", 0), "tiegocancel: plan: budget must be from 1 to 10000, not 0"),
        (("--max-loss", 2), "tiegocancel: plan: max_loss must be from 0 to 1, not 2.0"),
        (("--motion", "m.schedule"), "tiegocancel: --motion m.schedule: a schedule serves one horizon"),
        (("--motion", "160,90,0"), "tiegocancel: --motion 160,90,0: edges move at 0.0 px/s"),
    ],
)
def test_what_cannot_be_planned_is_one_line(
    disc: Path, invoke: Invoke, arguments: tuple[object, ...], line: str
) -> None:
    Path("m.schedule").write_text("tiegocancel_schedule 1\n", encoding="utf-8")
    code, out, err = invoke("plan", disc, *arguments)
    assert (code, out) == (2, "")
    assert err[-1].startswith(line)
