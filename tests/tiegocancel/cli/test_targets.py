"""``tiegocancel targets``: the list, one part with its documents, a user's own file, JSON."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tiegocancel.firmware_sim.target import load_target, memory_names, target_names

from tiegocancel.cli import main


def test_the_list_names_every_part_and_marks_those_with_undocumented_numbers(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["targets"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for name in (*target_names(), *memory_names()):
        (line,) = (line for line in lines if line.split() and line.split()[0] == name)
        if name in target_names():
            assert (line.split()[1] == "*") == bool(load_target(name).unverified)
    assert any("43848 LUT4" in line and "108 DP16KD" in line and "72 18x18" in line for line in lines)
    assert any(line.startswith("stm32f405") and "192 KiB" in line and "128 KiB" in line for line in lines)


def test_one_part_is_told_with_the_document_of_every_number(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["targets", "rp2040"]) == 0
    text = capsys.readouterr().out
    assert "core.mhz = 133" in text
    assert "RP2040 Datasheet, section 2.6.2 SRAM" in text
    assert "cycles.exception_entry = 15" in text


def test_json_holds_the_file_and_a_source_for_every_number(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["targets", "--json"]) == 0
    targets = json.loads(capsys.readouterr().out)["targets"]
    assert [target["name"] for target in targets] == [*target_names(), *memory_names()]
    for target in targets:
        assert target["numbers"]
        assert all(number["source"] for number in target["numbers"])
        assert set(target["unverified"]) <= {number["path"] for number in target["numbers"]}


def test_a_memory_and_a_file_of_the_users_own_are_told_too(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    own = tmp_path / "mine.toml"
    folder = Path(load_target.__code__.co_filename).parent / "targets"
    own.write_text((folder / "ecp5-45f.toml").read_text(encoding="utf-8").replace("mhz = 67.2", "mhz = 50"))
    assert main(["targets", "HyperRAM", str(own)]) == 0
    text = capsys.readouterr().out
    assert "hyperram: S27KS0641" in text
    assert "clocks[6].mhz = 50" in text


def test_an_unknown_part_is_a_usage_error_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["targets", "rp2041"]) == 2
    err = capsys.readouterr().err
    assert err == "tiegocancel: unknown target 'rp2041'; did you mean 'rp2040'?\n"
