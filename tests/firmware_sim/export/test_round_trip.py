"""What is written reads back, number for number, and what was changed since is refused."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.export import Vectors, core_cycles, golden_vectors, read_vectors, write_vectors

from tiegocancel.errors import InputError
from tiegocancel.matching.config import CancelConfig

PLAIN = CancelConfig(horizon_us=2000, ring_capacity=500)


@pytest.fixture
def folder(disc: Callable[..., Vectors], tmp_path: Path) -> Path:
    write_vectors(tmp_path, with_cycles(disc(PLAIN)), command=["tiegocancel", "export"])
    return tmp_path


def with_cycles(vectors: Vectors) -> Vectors:
    """Return the vectors with the cycles of a small slow core, which drops events."""
    from dataclasses import replace

    return replace(vectors, cycles=core_cycles(vectors, CoreConfig(input_depth=2), clock_hz=2e6))


@settings(max_examples=150)
@given(seed=st.integers(0, 2**32 - 1))
def test_everything_reads_back(draw: Callable[[int], Any], tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    config, events, schedules = draw(seed)
    vectors = golden_vectors(events, config, schedules)
    target = tmp_path_factory.mktemp("vectors")
    write_vectors(target, vectors, command=["tiegocancel", "export", "«é»"])
    assert vectors.differences(read_vectors(target)) == []


def test_cycles_read_back_with_their_core(disc: Callable[..., Vectors], folder: Path) -> None:
    told = read_vectors(folder)
    assert with_cycles(disc(PLAIN)).differences(told) == []
    assert told.cycles is not None
    assert told.cycles.dropped.any()
    assert told.cycles.core == CoreConfig(input_depth=2)


def test_every_file_is_listed_with_its_checksum(folder: Path) -> None:
    listed = json.loads((folder / "vectors.json").read_text(encoding="ascii"))
    assert listed["command"] == ["tiegocancel", "export"]
    assert {*listed["files"], "vectors.json"} == {path.name for path in folder.iterdir()}
    for name, record in listed["files"].items():
        data = (folder / name).read_bytes()
        assert (record["bytes"], record["sha256"]) == (len(data), hashlib.sha256(data).hexdigest())
        assert data.isascii()
        assert b"\r" not in data


@pytest.mark.parametrize(
    "name",
    [
        "events.memh",
        "decisions.memh",
        "schedule.memh",
        "cycles.memh",
        "config.json",
        "tiegocancel_config.h",
        "README.txt",
    ],
)
def test_a_changed_file_is_refused_by_its_name(folder: Path, name: str) -> None:
    data = (folder / name).read_bytes()
    (folder / name).write_bytes(data[:-2] + b"7" + data[-1:])
    with pytest.raises(InputError, match=rf"{name}: is not the file that vectors\.json lists"):
        read_vectors(folder)
    (folder / name).unlink()
    with pytest.raises(InputError, match=rf"{name}: cannot be read: No such file"):
        read_vectors(folder)


def test_numbers_that_disagree_are_refused(folder: Path) -> None:
    path = folder / "vectors.json"
    table = json.loads(path.read_bytes())
    table["decisions"]["suppressed"][-1] ^= 1
    path.write_text(json.dumps(table))
    with pytest.raises(InputError, match="'decisions': differs from the memory images beside it"):
        read_vectors(folder)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("{", "is not JSON"),
        ("[]", "field 'format': expected"),
        ('{"format": "tiegocancel vectors", "version": 1}', "'f"),
    ],
)
def test_a_file_that_is_no_list_is_refused(folder: Path, text: str, line: str) -> None:
    (folder / "vectors.json").write_text(text)
    with pytest.raises(InputError, match=line):
        read_vectors(folder)


def test_a_configuration_that_does_not_fit_its_images_is_refused(folder: Path) -> None:
    config = json.loads((folder / "config.json").read_bytes())
    config["words"]["events.memh"]["fields"][0]["lsb"] += 1
    (folder / "config.json").write_text(json.dumps(config))
    listed = json.loads((folder / "vectors.json").read_bytes())
    listed["files"]["config.json"]["sha256"] = hashlib.sha256((folder / "config.json").read_bytes()).hexdigest()
    (folder / "vectors.json").write_text(json.dumps(listed))
    with pytest.raises(InputError, match=r"config\.json: does not fit the memory images beside it: the fields of a w"):
        read_vectors(folder)
