"""Every shipped target loads and names its sources; a user's broken file is told in one line."""

from __future__ import annotations

from pathlib import Path

import pytest
from tiegocancel.firmware_sim.target import load_memory, load_target, memory_names, target_names
from tiegocancel.firmware_sim.target_fpga import FpgaTarget
from tiegocancel.firmware_sim.target_mcu import McuTarget
from tiegocancel.firmware_sim.target_source import UNVERIFIED, numbers_of

from tiegocancel.errors import ConfigError

FOLDER = Path(load_target.__code__.co_filename).parent / "targets"


def test_the_two_kinds_load_by_name_in_any_case() -> None:
    assert isinstance(load_target("ECP5-45F"), FpgaTarget)
    assert isinstance(load_target("rp2040"), McuTarget)


@pytest.mark.parametrize("name", target_names())
def test_every_target_loads_under_its_own_name_and_every_number_has_a_source(name: str) -> None:
    target = load_target(name)
    assert target.name == name
    numbers = list(numbers_of(target))
    assert len(numbers) > 10
    for path, _, source in numbers:
        assert source.startswith(UNVERIFIED) == (path in target.unverified)
        assert len(source.split()) > 1, f"{path}: {source!r} is no document with a place in it"


@pytest.mark.parametrize("name", memory_names())
def test_every_memory_loads_and_every_number_has_a_source(name: str) -> None:
    memory = load_memory(name)
    assert memory.name == name
    assert all(len(source.split()) > 1 for _, _, source in numbers_of(memory))


def test_a_field_may_have_a_source_of_its_own() -> None:
    memory = load_target("ecp5-45f").memories[0]
    assert memory.source_of("count") != memory.source_of("simple_dual") == memory.source


def test_unknown_names_get_the_nearest_one_or_the_list() -> None:
    with pytest.raises(ConfigError, match=r"unknown target 'ecp5-46f'; did you mean 'ecp5-45f'\?"):
        load_target("ecp5-46f")
    with pytest.raises(ConfigError, match=r"unknown target 'zzz'; known: .*rp2040.*path of a .toml file"):
        load_target("zzz")
    with pytest.raises(ConfigError, match="No such file"):
        load_target("nowhere.toml")


BROKEN = [
    ('kind = "fpga"', 'kind = "asic"', r"kind must be one of 'fpga', 'mcu', 'memory', not 'asic'"),
    ('kind = "fpga"', 'kind = "memory"', r"kind must be one of 'fpga', 'mcu' here, not 'memory'"),
    ("luts = 43848", 'luts = "many"', r"\[logic\] luts must be int, not 'many'"),
    ("luts = 43848", "lutz = 43848", r"\[logic\]: unknown key 'lutz'; did you mean 'luts'\?"),
    ("luts = 43848\n", "", r"\[logic\]: 'luts' is missing"),
    ("luts = 43848", "luts = 0", r"\[logic\]: luts must be positive, not 0"),
    ("luts = 0.70", "luts = 1.5", r"\[usable\]: luts must be above 0 and at most 1, not 1.5"),
    ("count = 108", "count = -1", r"\[\[memories\]\] DP16KD: count must be positive, not -1"),
    ("count = 108", "cuont = 108", r"\[\[memories\]\] DP16KD: unknown key 'cuont'; did you mean 'count'\?"),
    ("[512, 36]", "[512, 72]", r"\[\[memories\]\] DP16KD: mode \[512, 72\] must .* hold at most bits = 18432"),
    ('basis = "pnr-extracted"', 'basis = "guess"', r"\[\[clocks\]\] 6 basis must be one of 'pnr-extracted', .*'guess'"),
    ("sources.bits =", "sources.bitz =", r"DP16KD sources: unknown field 'bitz'; did you mean 'bits'\?"),
    ("[logic]", "[logix]", r"unknown key 'logix'; did you mean 'logic'\?"),
    ("luts = 43848", "luts = = 3", r"not valid TOML"),
]


@pytest.mark.parametrize(("old", "new", "message"), BROKEN, ids=[new or "missing" for _, new, _ in BROKEN])
def test_a_broken_file_is_told_in_one_line_with_file_table_field_and_value(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    text = (FOLDER / "ecp5-45f.toml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=message) as caught:
        load_target(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_table_without_a_source_is_refused(tmp_path: Path) -> None:
    lines = (FOLDER / "rp2040.toml").read_text(encoding="utf-8").splitlines()
    first = next(index for index, line in enumerate(lines) if line.startswith("source ="))
    path = tmp_path / "mine.toml"
    path.write_text("\n".join(lines[:first] + lines[first + 1 :]), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"\[core\]: 'source' is missing"):
        load_target(path)


def test_a_number_without_a_document_shows(tmp_path: Path) -> None:
    text = (FOLDER / "rp2040.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(text.replace('source = "RP2040 Datasheet, chapter 1', 'source = "unverified: seen in a forum', 1))
    assert set(load_target(str(path)).unverified) >= {"core.count", "core.mhz"}


def test_banks_that_overlap_are_refused(tmp_path: Path) -> None:
    text = (FOLDER / "rp2040.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(text.replace("base = 0x20040000", "base = 0x2003F000", 1))
    with pytest.raises(ConfigError, match="ram banks 'SRAM0-3' and 'SRAM4' overlap at 0x2003f000"):
        load_target(path)


MEASURED = {  # nextpnr's own totals: LUT, FF, block RAM, multipliers
    "ice40up5k": (5280, 5280, 30, 8),
    "ice40hx8k": (7680, 7680, 32, 0),
    "ecp5-25f": (24288, 24288, 56, 28),
    "ecp5-45f": (43848, 43848, 108, 72),
    "ecp5-85f": (83640, 83640, 208, 156),
    "crosslink-nx-40": (32256, 32256, 84, 56),
    "gw1nr-9": (8640, 6480, 26, 20),
    "gw2a-18": (20736, 15552, 46, 48),
}


@pytest.mark.parametrize("name", MEASURED)
def test_no_target_contradicts_the_totals_that_place_and_route_reports(name: str) -> None:
    target = load_target(name)
    assert isinstance(target, FpgaTarget)
    blocks = sum(memory.count for memory in target.memories if not memory.large)
    assert (target.logic.luts, target.logic.ffs, blocks, target.multiplier_count) == MEASURED[name]


def test_the_parts_that_are_asked_for_are_there() -> None:
    fpgas = {
        *MEASURED, "artix-7-35t", "artix-7-100t", "zynq-7020", "zu3eg",
    }  # fmt: skip
    mcus = {"rp2040", "rp2350", "stm32f405", "stm32f746", "stm32h743", "imxrt1062", "esp32-s3", "nrf52840"}
    assert {name for name in target_names() if load_target(name).kind == "fpga"} == fpgas
    assert {name for name in target_names() if load_target(name).kind == "mcu"} == mcus
    assert {load_memory(name).technology for name in memory_names()} == {"hyperram", "sdram", "ddr3"}


@pytest.mark.parametrize("name", memory_names())
def test_a_longer_access_takes_longer_and_an_open_row_never_does(name: str) -> None:
    memory = load_memory(name)
    times = [memory.access_ns(size) for size in (1, 2, 16, 64, 256)]
    assert times == sorted(times)
    assert all(
        memory.access_ns(size, row_open=True) <= time for size, time in zip((1, 2, 16, 64, 256), times, strict=True)
    )
    assert 65536 / memory.access_ns(65536) * 1e9 == pytest.approx(memory.peak_bytes_per_second, rel=0.01)
