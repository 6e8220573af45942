"""``info`` says what a recording holds: for people, and as one object for machines."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import ConfigError, Events, InputError, write_events
from tiegocancel.cli import info


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Return a function that runs the verb and gives its stdout."""

    def run(*words: str) -> str:
        parser = argparse.ArgumentParser()
        info.add_parser(parser.add_subparsers())
        args = parser.parse_args(["info", *words])
        assert args.run(args) == 0
        captured = capsys.readouterr()
        assert captured.err == ""
        return captured.out

    return run


@pytest.fixture
def path(tmp_path: Path) -> Path:
    events = Events([1000, 1500, 1600, 2_001_000], [1, 2, 3, 4], [5, 6, 7, 8], [1, 1, 1, 0], 64, 48)
    write_events(tmp_path / "a.npz", events)
    return tmp_path / "a.npz"


def test_json_is_one_object_with_everything(path: Path, call: Callable[..., str]) -> None:
    facts = json.loads(call(str(path), "--json"))
    notes = facts.pop("notes")
    assert facts == {
        "file": str(path),
        "format": "npz",
        "width": 64,
        "height": 48,
        "events": 4,
        "first_us": 1000,
        "last_us": 2_001_000,
        "span_us": 2_000_000,
        "mean_rate_hz": 2.0,
        "peak_rate_hz": 3000.0,
        "on_share": 0.75,
        "time_unit": "us",
        "labelled": False,
        "faults": 0,
    }
    assert notes == ["time unit: us, as whole numbers in an NPZ are"]


def test_the_table_names_format_size_unit_and_notes(path: Path, call: Callable[..., str]) -> None:
    text = call(str(path))
    for words in ("npz", "64x48 px", "2.000000 s", "3 kev/s (in 1 ms)", "0.750", "time unit   us", "note"):
        assert words in text


def test_a_recording_without_events_has_no_rates(tmp_path: Path, call: Callable[..., str]) -> None:
    write_events(tmp_path / "a.raw", Events.empty(64, 48))
    facts = json.loads(call(str(tmp_path / "a.raw"), "--json"))
    assert (facts["events"], facts["first_us"], facts["mean_rate_hz"], facts["on_share"]) == (0, None, None, None)
    assert "mean rate" not in call(str(tmp_path / "a.raw"))


def test_flags_reach_the_reader(tmp_path: Path, call: Callable[..., str]) -> None:
    (tmp_path / "a.txt").write_text("1 3 4 1\n2 5 6 0\n3 5 6 9\n")
    words = [
        str(tmp_path / "a.txt"),
        "--json",
        "--columns",
        "txyp",
        "--time-unit",
        "ms",
        "--width",
        "9",
        "--height",
        "8",
    ]
    with pytest.raises(InputError, match="row 3"):
        call(*words)
    facts = json.loads(call(*words, "--keep-going", "--chunk-events", "1", "--format", "text"))
    assert (facts["events"], facts["first_us"], facts["faults"]) == (2, 1000, 1)
    assert (facts["width"], facts["height"], facts["time_unit"]) == (9, 8, "ms")
    assert any("--keep-going" in note for note in facts["notes"])
    with pytest.raises(ConfigError, match="chunk size"):
        call(*words, "--chunk-events", "0")


def test_every_real_recording_is_told(recording: Callable[[str], Path], call: Callable[..., str]) -> None:
    facts = json.loads(call(str(recording("driving_evt3.raw")), "--json"))
    assert (facts["format"], facts["events"]) == ("evt3", 219_596)
    assert np.isclose(facts["mean_rate_hz"], 24.95e6, rtol=1e-3)
