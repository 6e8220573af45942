"""Results survive a kill at any byte, and are never doubled."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tiegocancel.errors import ConfigError, InputError
from tiegocancel.study.sweep import ResultStore, job_key

RESULTS = [(f"key{number}", {"number": number}, {"value": number * 0.1, "name": "ω"}) for number in range(5)]


def test_what_was_added_is_there_again(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    with ResultStore(path) as store:
        store.add(RESULTS)
    with ResultStore(path) as store:
        assert store.rows == {key: row for key, _, row in RESULTS}


def test_a_key_that_is_there_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    with ResultStore(path) as store:
        store.add(RESULTS)
        size = path.stat().st_size
        store.add([("key0", {}, {"value": "another"})])
        assert path.stat().st_size == size
        assert store.rows["key0"] == RESULTS[0][2]


def test_a_file_torn_at_any_byte_loses_at_most_its_last_line(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    with ResultStore(path) as store:
        store.add(RESULTS)
    whole = path.read_bytes()
    for length in range(len(whole) + 1):
        path.write_bytes(whole[:length])
        with ResultStore(path) as store:
            assert len(store.rows) == whole[:length].count(b"\n")
            store.add(RESULTS)
        assert path.read_bytes() == whole


@pytest.mark.parametrize("line", [b"nothing\n", b"[1, 2]\n", b'{"key": "a"}\n', b'{"key": "a", "row": 3}\n'])
def test_a_file_of_another_kind_is_refused_with_its_line(tmp_path: Path, line: bytes) -> None:
    path = tmp_path / "results.jsonl"
    path.write_bytes(b'{"key": "a", "job": {}, "row": {}}\n' + line)
    with pytest.raises(InputError, match="line 2"):
        ResultStore(path)


@pytest.mark.skipif(sys.platform == "win32", reason="files are locked by fcntl")
def test_two_sweeps_do_not_write_one_file(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    with ResultStore(path), pytest.raises(ConfigError, match="another sweep"):
        ResultStore(path)
    ResultStore(path).close()


def test_a_place_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"results\.jsonl"):
        ResultStore(tmp_path / "absent" / "results.jsonl")


def test_a_key_tells_jobs_and_data_apart_and_not_the_order_of_names() -> None:
    assert job_key({"a": 1, "b": 2.5}, "x") == job_key({"b": 2.5, "a": 1}, "x")
    keys = {job_key(job, basis) for job in ({"a": 1}, {"a": 2}, {"b": 1}) for basis in ("x", "y")}
    assert len(keys) == 6
