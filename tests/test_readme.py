"""Every command and every Python example of the README runs as it stands."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def readme(repository: Path) -> str:
    return (repository / "README.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("readme")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def commands(text: str) -> list[list[str]]:
    """Return the tiegocancel commands of the README in order; installing is what CI does around this test."""
    lines = [line for block in blocks(text, "bash") for line in block.splitlines()]
    parts = [part.strip() for line in lines for part in re.split("&&|;", line)]
    return [shlex.split(part, comments=True) for part in parts if part.startswith("tiegocancel")]


def wait_for(path: Path) -> None:
    """Wait for what a command in the background makes first."""
    deadline = time.monotonic() + 60.0
    while not path.exists():
        assert time.monotonic() < deadline, f"{path} never came"
        time.sleep(0.05)


def test_the_two_commands_stand_in_the_readme(readme: str) -> None:
    found = "\n".join(blocks(readme, "bash"))
    assert "pip install . && tiegocancel demo" in found
    assert "pip install '.[test]' && pytest" in found


def test_every_command_of_the_readme_runs(readme: str, folder: Path) -> None:
    ran = commands(readme)
    verbs = {
        "budget",
        "convert",
        "demo",
        "emulate",
        "export",
        "info",
        "link",
        "motion",
        "plan",
        "ports",
        "record",
        "replay",
        "run",
        "simulate",
        "study-thesis",
        "targets",
    }
    assert {words[1] for words in ran} == verbs
    with contextlib.ExitStack() as background:
        for words in ran:
            if "&" in words:
                command = [sys.executable, "-m", *words[: words.index("&")]]
                device = subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL)
                background.callback(device.wait)
                background.callback(device.terminate)
                wait_for(folder / words[words.index("--symlink") + 1])
                continue
            done = subprocess.run(
                [sys.executable, "-m", *words], capture_output=True, text=True, cwd=folder, env=os.environ, check=False
            )
            assert done.returncode == 0, f"{words}: {done.stderr}"
    live = json.loads((folder / "live-out" / "manifest.json").read_text(encoding="utf-8"))["results"]
    assert live["link"]["decoder"]["bad_bytes"] == 0
    assert live["verdict"]["grade"] == "selective"
    assert (folder / "tiegocancel-out" / "report.html").exists()
    manifest = json.loads((folder / "tiegocancel-out" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["results"]["verdict"]["grade"] == "selective"
    assert manifest["results"]["selectivity"]["j"] > 0.6
    fitted = json.loads((folder / "fit-out" / "manifest.json").read_text(encoding="utf-8"))["results"]["motion"]
    assert fitted["omega_rad_s"] == pytest.approx(3.6, rel=0.02)


def test_every_python_example_of_the_readme_runs(readme: str, folder: Path) -> None:
    if not (folder / "scene.npz").exists():
        pytest.skip("the commands that make scene.npz did not run")
    for example in blocks(readme, "python"):
        done = subprocess.run(
            [sys.executable, "-c", example], capture_output=True, text=True, cwd=folder, env=os.environ, check=False
        )
        assert (done.returncode, done.stderr) == (0, "")


def test_the_configuration_of_the_readme_is_valid(readme: str, tmp_path: Path) -> None:
    from tiegocancel.config import fill, load_toml
    from tiegocancel.study import Settings

    for index, example in enumerate(blocks(readme, "toml")):
        path = tmp_path / f"{index}.toml"
        path.write_text(example, encoding="utf-8")
        assert isinstance(fill(Settings, load_toml(path), path.name), Settings)


def test_the_architecture_section_and_the_tree_agree(readme: str, repository: Path) -> None:
    section = readme.split("## Architecture")[1].split("##")[0]
    top = set(re.findall(r"^(\w+)/ ", section, flags=re.MULTILINE))
    named = set(re.findall(r"^  (\w+(?:\.py|/)) ", section, flags=re.MULTILINE))
    inside = {
        path.name + ("/" if path.is_dir() else "")
        for path in (repository / "tiegocancel").iterdir()
        if not path.name.startswith(("_", "."))
    } - {"py.typed"}
    assert named == inside
    assert top == {"tiegocancel", "kernels", "firmware_sim", "tests"}
