"""``convert`` writes the same events in another format, and says what happened on stderr."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import ConfigError, Events, InputError, read_events, write_events
from tiegocancel.cli import convert

Call = Callable[..., tuple[str, str]]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Call:
    """Return a function that runs the verb and gives its stdout and stderr."""

    def run(*words: object) -> tuple[str, str]:
        parser = argparse.ArgumentParser()
        convert.add_parser(parser.add_subparsers())
        args = parser.parse_args(["convert", *map(str, words)])
        assert args.run(args) == 0
        captured = capsys.readouterr()
        return captured.out, captured.err

    return run


@pytest.fixture
def events() -> Events:
    rng = np.random.default_rng(3)
    n = 500
    return Events(
        np.cumsum(rng.integers(0, 40, n)),
        np.append(rng.integers(0, 64, n - 1), 63),
        np.append(rng.integers(0, 48, n - 1), 47),
        rng.integers(0, 2, n),
        64,
        48,
        rng.integers(0, 3, n),
    )


def test_any_format_to_any_other_and_back(events: Events, tmp_path: Path, call: Call) -> None:
    write_events(tmp_path / "0.npz", events)
    steps = ["0.npz", "1.raw", "2.csv", "3.npy", "4.npz"]
    for source, target in pairwise(steps):
        out, err = call(tmp_path / source, tmp_path / target, "--chunk-events", "70")
        assert out == ""
        assert f"500 events written to {tmp_path / target}" in err
    back = read_events(tmp_path / "4.npz")
    for name in ("t", "x", "y", "p", "label"):
        assert np.array_equal(getattr(back, name), getattr(events, name))


def test_sort_reads_whole_what_a_stream_cannot_sort(tmp_path: Path, call: Call) -> None:
    n = 100_000
    np.savez(tmp_path / "a.npz", t=[*range(1, n), 0], x=np.arange(n) % 7, y=np.zeros(n, int), p=np.ones(n, int))
    with pytest.raises(InputError, match="--sort"):
        call(tmp_path / "a.npz", tmp_path / "b.npz", "--chunk-events", "100")
    assert len(read_events(tmp_path / "b.npz")) == n - 1
    _, err = call(tmp_path / "a.npz", tmp_path / "b.npz", "--sort")
    assert "1 events out of order, sorted by time" in err
    assert np.array_equal(read_events(tmp_path / "b.npz").t, np.arange(n))


def test_what_was_read_before_a_fault_is_on_disk(
    events: Events, tmp_path: Path, call: Call, capsys: pytest.CaptureFixture[str]
) -> None:
    write_events(tmp_path / "a.csv", events)
    with (tmp_path / "a.csv").open("a") as file:
        file.write("1,2,3\n")
    with pytest.raises(InputError, match="row 502"):
        call(tmp_path / "a.csv", tmp_path / "b.npz")
    assert len(read_events(tmp_path / "b.npz")) == 500
    capsys.readouterr()
    out, err = call(tmp_path / "a.csv", tmp_path / "c.out", "--keep-going", "--to-format", "evt2", "--json")
    facts = json.loads(out)
    assert (facts["format"], facts["events"]) == ("evt2", 500)
    assert "stopped at row 502" in err
    assert facts["notes"] == [line.split(": ", 1)[1] for line in err.splitlines()[:-1]]


def test_a_recording_is_not_written_over_itself(events: Events, tmp_path: Path, call: Call) -> None:
    write_events(tmp_path / "a.npz", events)
    before = (tmp_path / "a.npz").read_bytes()
    with pytest.raises(ConfigError, match="itself"):
        call(tmp_path / "a.npz", tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() == before


def test_a_target_of_unknown_suffix_is_a_usage_error(events: Events, tmp_path: Path, call: Call) -> None:
    write_events(tmp_path / "a.npz", events)
    with pytest.raises(ConfigError, match="suffix"):
        call(tmp_path / "a.npz", tmp_path / "a.hdf")


@pytest.mark.parametrize("target", ["b.csv", "b.npy", "b.npz", "b.raw"])
def test_a_format_without_room_for_the_size_is_told_with_the_flags(
    target: str, events: Events, tmp_path: Path, call: Call
) -> None:
    write_events(tmp_path / "a.npz", events)
    out, err = call(tmp_path / "a.npz", tmp_path / target, "--json")
    name = target.split(".")[1]
    note = f"{name} holds no sensor size: pass --width 64 --height 48 when reading it"
    assert (f"note: {note}" in err.splitlines()) == (name in ("csv", "npy"))
    assert (note in json.loads(out)["notes"]) == (name in ("csv", "npy"))


def test_notes_are_told_as_notes(events: Events, tmp_path: Path, call: Call) -> None:
    write_events(tmp_path / "a.csv", events)
    _, err = call(tmp_path / "a.csv", tmp_path / "b.npz")
    assert "note: sensor size derived from the largest coordinate: 64x48" in err.splitlines()


def test_a_fault_before_the_first_event_leaves_no_file(tmp_path: Path, call: Call) -> None:
    (tmp_path / "a.csv").write_text("x,y,p,t_us\n1,2,7,4\n")
    with pytest.raises(InputError, match="row 2"):
        call(tmp_path / "a.csv", tmp_path / "b.raw", "--width", "64", "--height", "48")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.csv"]
