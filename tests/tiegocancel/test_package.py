"""The package is what it says: its folders, its silence, its speed to answer, its README."""

from __future__ import annotations

import re
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

import tiegocancel


def test_package_list_equals_the_tree(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    mapped = {"tiegocancel": "tiegocancel", **{v: k for k, v in project["package-dir"].items()}}
    found = {
        ".".join([mapped[root], *folder.relative_to(repository / root).parts])
        for root in mapped
        for folder in [repository / root, *(p for p in (repository / root).rglob("*") if p.is_dir())]
        if (folder / "__init__.py").exists()
    }
    assert sorted(project["packages"]) == sorted(found)


def test_every_top_level_folder_is_one_that_was_agreed(repository: Path) -> None:
    listed = subprocess.run(["git", "ls-files"], capture_output=True, text=True, cwd=repository, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    top = {line.split("/")[0] for line in listed.stdout.splitlines() if not line.startswith(".")}
    assert top <= {
        "pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "tiegocancel", "kernels", "firmware_sim", "tests",
    }  # fmt: skip


@pytest.mark.parametrize(
    "statement",
    [
        "import tiegocancel",
        "import tiegocancel; [getattr(tiegocancel, name) for name in tiegocancel.__all__]",
        "from tiegocancel.kernels.runtime import start; start()",
        "import tiegocancel.firmware_sim, sys; assert 'taichi' not in sys.modules and 'serial' not in sys.modules",
    ],
)
def test_importing_and_starting_prints_nothing(statement: str) -> None:
    done = subprocess.run([sys.executable, "-c", statement], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_bare_import_loads_no_heavy_package() -> None:
    program = (
        "import tiegocancel.cli, sys; print(sorted({'taichi', 'numpy', 'scipy', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_help_answers_at_once_for_every_verb() -> None:
    best = min(_seconds("--help") for _ in range(3))
    assert best < 0.5
    for verb in ("demo", "run", "simulate", "info", "convert"):
        assert _seconds(verb, "--help") < 5


def _seconds(*arguments: str) -> float:
    started = time.perf_counter()
    program = "import sys; from tiegocancel.cli import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=True)
    assert "usage: tiegocancel" in done.stdout
    return time.perf_counter() - started


def test_every_public_name_exists_and_has_a_docstring() -> None:
    for name in tiegocancel.__all__:
        value = getattr(tiegocancel, name)
        assert name.startswith("__") or name.isupper() or value.__doc__


def test_rooms_import_only_what_they_may(repository: Path) -> None:
    rules = {
        "kernels": r"firmware_sim|tiegocancel(?!\.kernels)",
        "firmware_sim": r"taichi|serial|kernels",
        "tiegocancel": r"import taichi|from taichi",
    }
    for room, forbidden in rules.items():
        for path in (repository / room).rglob("*.py"):
            for line in path.read_text(encoding="utf-8").splitlines():
                if re.match(r"\s*(from|import)\s", line):
                    assert not re.search(forbidden, line), f"{path.name}: {line}"


def test_version_is_the_same_everywhere(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == tiegocancel.__version__
