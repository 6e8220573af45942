"""Memories on blocks: as yosys infers them, as place and route counted them, and never fewer bits than needed."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import prod

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.memory_map import LogicalMemory, MemoryPlacement, map_memories, placements
from tiegocancel.firmware_sim.target import load_target, target_names
from tiegocancel.firmware_sim.target_fpga import FpgaTarget

FPGAS = tuple(name for name in target_names() if isinstance(load_target(name), FpgaTarget))


@cache
def fpga(name: str) -> FpgaTarget:
    target = load_target(name)
    assert isinstance(target, FpgaTarget)
    return target


def table(words: int, cell_bits: int, *, shared: bool = False) -> LogicalMemory:
    if shared:
        return LogicalMemory(
            name="table", words=words, width_bits=cell_bits, read_ports=0, write_ports=0, shared_ports=1
        )
    return LogicalMemory(name="table", words=words, width_bits=cell_bits)


def ring(words: int, entry_bits: int) -> LogicalMemory:
    return LogicalMemory(name="ring", words=words, width_bits=entry_bits)


# (part, width, words, kind, blocks, LUT RAM cells): yosys 0.70, one synchronous read and one write port, map_ffram.
YOSYS = [
    ("ecp5-85f", 14, 102_400, "DP16KD", 91),
    ("ecp5-85f", 16, 102_400, "DP16KD", 100),
    ("ecp5-85f", 16, 76_800, "DP16KD", 76),
    ("ecp5-85f", 18, 76_800, "DP16KD", 76),
    ("ecp5-85f", 20, 76_800, "DP16KD", 95),
    ("ecp5-85f", 15, 19_200, "DP16KD", 19),
    ("ecp5-85f", 16, 19_200, "DP16KD", 19),
    ("ecp5-85f", 24, 30_720, "DP16KD", 45),
    ("ecp5-85f", 11, 5000, "DP16KD", 5),
    ("ecp5-85f", 27, 8000, "DP16KD", 12),
    ("ecp5-85f", 34, 1024, "DP16KD", 2),
    ("ecp5-85f", 38, 1024, "DP16KD", 3),
    ("ecp5-85f", 33, 2048, "DP16KD", 4),
    ("ecp5-85f", 30, 512, "DP16KD", 1),
    ("ecp5-85f", 16, 1000, "DP16KD", 1),
    ("ecp5-85f", 16, 64, "LUT", 0),
    ("ecp5-85f", 16, 32, "LUT", 0),
    ("ice40hx8k", 16, 4096, "SB_RAM40_4K", 16),
    ("ice40hx8k", 20, 3000, "SB_RAM40_4K", 15),
    ("ice40hx8k", 24, 1000, "SB_RAM40_4K", 6),
    ("ice40hx8k", 30, 512, "SB_RAM40_4K", 4),
    ("ice40hx8k", 16, 64, "SB_RAM40_4K", 1),
    ("gw2a-18", 16, 19_200, "BSRAM", 19),
    ("gw2a-18", 16, 4096, "BSRAM", 4),
    ("zynq-7020", 16, 76_800, "RAMB18E1", 2 * 38),
    ("zynq-7020", 20, 76_800, "RAMB18E1", 95),
    ("zynq-7020", 16, 102_400, "RAMB18E1", 2 * 50),
    ("zynq-7020", 16, 307_200, "RAMB18E1", 2 * 150),
    ("zynq-7020", 27, 8000, "RAMB18E1", 2 * 6),
    ("zynq-7020", 34, 4096, "RAMB18E1", 2 * 4),
    ("zynq-7020", 34, 1024, "RAMB18E1", 2 * 1),
    ("zynq-7020", 16, 64, "LUT", 0),
]


@pytest.mark.parametrize(("part", "width", "words", "kind", "blocks"), YOSYS)
def test_kind_and_blocks_are_those_that_yosys_infers(part: str, width: int, words: int, kind: str, blocks: int) -> None:
    best = placements(table(words, width), fpga(part))[0]
    assert (best.kind, best.blocks) == (kind, blocks)


# The prototype core as place and route counted it: sensor, table cell, and a ring that its capacity then implies.
ROUTED = [
    ("ecp5-25f", table(160 * 120, 16), ring(512, 30), {"DP16KD": 20}),
    ("ecp5-45f", table(320 * 240, 16), ring(1024, 34), {"DP16KD": 78}),
    ("ecp5-45f", table(320 * 240, 18), ring(1024, 34), {"DP16KD": 78}),
    ("ecp5-45f", table(320 * 240, 20), ring(1024, 36), {"DP16KD": 97}),
    ("ecp5-45f", table(320 * 320, 16), ring(2048, 32), {"DP16KD": 104}),
    ("ice40up5k", table(160 * 120, 16, shared=True), ring(512, 30), {"SB_RAM40_4K": 4, "SB_SPRAM256KA": 2}),
    ("ice40hx8k", table(64 * 64, 16), ring(256, 27), {"SB_RAM40_4K": 18}),
    ("gw2a-18", table(160 * 120, 16), ring(512, 30), {"BSRAM": 20}),
    ("gw1nr-9", table(64 * 64, 16), ring(256, 27), {"BSRAM": 5}),
    ("zynq-7020", table(320 * 240, 16), ring(1024, 34), {"RAMB18E1": 2 * 39}),
    ("zynq-7020", table(320 * 320, 16), ring(2048, 32), {"RAMB18E1": 2 * 52}),
    ("zynq-7020", table(640 * 480, 16), ring(4096, 34), {"RAMB18E1": 2 * 154}),
]


@pytest.mark.parametrize(("part", "cells", "entries", "blocks"), ROUTED)
def test_blocks_are_those_of_the_routed_prototype(
    part: str, cells: LogicalMemory, entries: LogicalMemory, blocks: dict[str, int]
) -> None:
    result = map_memories([cells, entries], fpga(part))
    assert result.blocks == blocks
    assert result.fits == all(use.need <= use.have for use in result.uses)


def test_a_table_beyond_the_part_does_not_fit_and_tells_what_is_missing() -> None:
    for part in ("zynq-7020", "artix-7-100t"):
        result = map_memories([table(640 * 480, 16), ring(4096, 34)], fpga(part))
        assert not result.fits
        assert not result.of("table").fits
        assert result.of("ring").fits
    (use,) = map_memories([table(640 * 480, 16)], fpga("ecp5-85f")).uses
    assert (use.need, use.have, use.usable) == (300, 208, 166)


def test_a_table_with_two_ports_cannot_go_to_single_port_ram() -> None:
    assert map_memories([table(160 * 120, 16, shared=True)], fpga("ice40up5k")).of("table").kind == "SB_SPRAM256KA"
    separate = map_memories([table(160 * 120, 16)], fpga("ice40up5k"))
    assert separate.of("table").kind == "SB_RAM40_4K"
    assert not separate.fits


def test_ram_without_contents_is_not_given_to_a_memory_that_needs_them() -> None:
    memory = table(160 * 120, 16, shared=True)
    assert placements(replace(memory, needs_init=True), fpga("ice40up5k"))[0].kind == "SB_RAM40_4K"


def test_each_further_read_port_costs_a_copy() -> None:
    one = placements(table(19_200, 16), fpga("ecp5-45f"))[0]
    three = placements(replace(table(19_200, 16), read_ports=3), fpga("ecp5-45f"))[0]
    assert (three.copies, three.blocks) == (3, 3 * one.blocks)
    assert three.waste_bits > 2 * one.memory.bits


def test_two_write_ports_beside_a_read_port_have_no_place() -> None:
    memory = replace(table(19_200, 16), write_ports=2)
    result = map_memories([memory, ring(512, 30)], fpga("ecp5-45f"))
    assert result.unplaced == (memory,)
    assert not result.fits
    assert result.blocks == {"DP16KD": 1}


def test_a_mode_with_fewer_blocks_is_taken_when_blocks_run_short() -> None:
    target = fpga("ecp5-45f")
    short = replace(target, memories=(replace(target.memories[0], count=75),))
    assert map_memories([table(76_800, 16)], target).blocks == {"DP16KD": 76}
    assert map_memories([table(76_800, 16)], short).blocks == {"DP16KD": 75}
    assert map_memories([table(76_800, 16)], short).fits


memories = st.builds(
    LogicalMemory,
    name=st.just("m"),
    words=st.integers(1, 400_000),
    width_bits=st.integers(1, 80),
    read_ports=st.integers(1, 3),
    write_ports=st.just(1),
    shared_ports=st.just(0),
) | st.builds(
    LogicalMemory,
    name=st.just("m"),
    words=st.integers(1, 400_000),
    width_bits=st.integers(1, 80),
    read_ports=st.just(0),
    write_ports=st.just(0),
    shared_ports=st.integers(1, 2),
)


@settings(max_examples=150, deadline=None)
@given(memory=memories, part=st.sampled_from(FPGAS))
def test_no_way_to_hold_a_memory_has_fewer_bits_than_it_needs(memory: LogicalMemory, part: str) -> None:
    for option in placements(memory, fpga(part)):
        assert option.bits_taken >= memory.bits * option.copies
        assert option.waste_bits >= 0
        assert option.rows * option.mode[0] >= memory.words
        assert option.blocks * prod(option.mode) >= memory.bits or option.kind in ("LUT", "FF")


@settings(max_examples=150, deadline=None)
@given(
    memory=memories,
    part=st.sampled_from(FPGAS),
    more_words=st.integers(0, 50_000),
    more_bits=st.integers(0, 20),
)
def test_a_larger_memory_never_needs_less(memory: LogicalMemory, part: str, more_words: int, more_bits: int) -> None:
    larger = replace(memory, words=memory.words + more_words, width_bits=memory.width_bits + more_bits)

    def fewest(options: list[MemoryPlacement]) -> dict[str, int]:
        return {
            kind: min(option.blocks for option in options if option.kind == kind)
            for kind in {option.kind for option in options} - {"LUT", "FF"}
        }

    small, large = placements(memory, fpga(part)), placements(larger, fpga(part))
    assert small[0].worth_luts <= large[0].worth_luts if large else True
    assert all(fewest(small)[kind] <= blocks for kind, blocks in fewest(large).items())


@settings(max_examples=60, deadline=None)
@given(
    shapes=st.lists(st.tuples(st.integers(1, 60_000), st.integers(1, 40)), min_size=1, max_size=6),
    part=st.sampled_from(FPGAS),
)
def test_no_block_is_given_twice(shapes: list[tuple[int, int]], part: str) -> None:
    target = fpga(part)
    result = map_memories(
        [LogicalMemory(name=str(index), words=words, width_bits=bits) for index, (words, bits) in enumerate(shapes)],
        target,
    )
    have = {memory.name: memory.count for memory in target.memories}
    for kind, count in have.items():
        fitted = sum(option.blocks for option in result.placements if option.kind == kind and option.fits)
        assert fitted <= count
        assert result.blocks[kind] == sum(option.blocks for option in result.placements if option.kind == kind)
    assert len(result.placements) == len(shapes)
