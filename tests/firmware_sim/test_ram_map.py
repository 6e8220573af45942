"""Arrays in RAM: whole cells, no gap within an array, nothing on top of another."""

from __future__ import annotations

from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.ram_map import RamArray, place_arrays
from tiegocancel.firmware_sim.target import load_target, target_names
from tiegocancel.firmware_sim.target_mcu import McuTarget

MCUS = tuple(name for name in target_names() if isinstance(load_target(name), McuTarget))


@cache
def mcu(name: str) -> McuTarget:
    target = load_target(name)
    assert isinstance(target, McuTarget)
    return target


def test_cells_are_padded_to_what_a_core_loads() -> None:
    sizes = {bits: RamArray(name="a", words=1, width_bits=bits).cell_bytes for bits in (1, 8, 9, 16, 17, 32, 33, 65)}
    assert sizes == {1: 1, 8: 1, 9: 2, 16: 2, 17: 4, 32: 4, 33: 8, 65: 16}
    assert RamArray(name="a", words=1000, width_bits=18).padding_bits == 14_000


def test_no_array_crosses_the_gap_of_an_stm32f405() -> None:
    """192 kB are 64 + 128: a table of 150 kB does not fit, one of 112 kB and one of 64 kB do."""
    assert not place_arrays([RamArray(name="t", words=76_800, width_bits=16)], mcu("stm32f405"), reserve_bytes=0).fits
    two = place_arrays(
        [RamArray(name="t", words=114_688, width_bits=8), RamArray(name="r", words=65_536, width_bits=8)],
        mcu("stm32f405"),
    )
    assert two.fits
    assert (two.of("t").banks, two.of("r").banks, two.of("reserve").banks) == (("SRAM1",), ("CCM",), ("SRAM2",))
    assert two.largest_free_bytes == 0


def test_an_array_may_span_banks_that_touch() -> None:
    spanning = place_arrays([RamArray(name="t", words=120_000, width_bits=8)], mcu("stm32f405"), reserve_bytes=0)
    assert spanning.of("t").banks == ("SRAM1", "SRAM2")
    f746 = place_arrays([RamArray(name="t", words=300_000, width_bits=8)], mcu("stm32f746"), reserve_bytes=0)
    assert f746.of("t").banks == ("DTCM", "SRAM1")
    assert f746.of("t").wait_cycles == 4


def test_what_dma_must_reach_keeps_out_of_core_coupled_memory() -> None:
    arrays = [RamArray(name="fifo", words=4096, width_bits=32, dma=True)]
    assert place_arrays(arrays, mcu("stm32f405")).of("fifo").banks == ("SRAM1",)
    assert place_arrays([RamArray(name="t", words=4096, width_bits=32)], mcu("stm32f405")).of("t").banks == ("CCM",)


def test_the_fastest_memory_that_holds_an_array_is_taken() -> None:
    result = place_arrays(
        [RamArray(name="table", words=76_800, width_bits=16), RamArray(name="ring", words=8192, width_bits=32)],
        mcu("stm32h743"),
    )
    assert result.of("ring").banks == ("DTCM",)
    assert result.of("table").banks == ("AXI SRAM",)
    assert result.of("ring").wait_cycles == 0 < result.of("table").wait_cycles
    assert result.of("table").cached


def test_a_negative_reserve_is_refused() -> None:
    with pytest.raises(ValueError, match="reserve_bytes must not be negative, not -1"):
        place_arrays([], mcu("rp2040"), reserve_bytes=-1)


@settings(max_examples=200, deadline=None)
@given(
    shapes=st.lists(st.tuples(st.integers(1, 100_000), st.integers(1, 40), st.booleans()), max_size=6),
    part=st.sampled_from(MCUS),
    reserve=st.integers(0, 40_000),
)
def test_arrays_lie_in_ram_whole_aligned_and_apart(
    shapes: list[tuple[int, int, bool]], part: str, reserve: int
) -> None:
    target = mcu(part)
    arrays = [
        RamArray(name=str(index), words=words, width_bits=bits, dma=dma)
        for index, (words, bits, dma) in enumerate(shapes)
    ]
    result = place_arrays(arrays, target, reserve_bytes=reserve)
    assert len(result.placements) == len(arrays) + (reserve > 0)
    taken: list[tuple[int, int]] = []
    for placement in result.placements:
        if not placement.fits:
            continue
        start, stop = placement.base, placement.base + placement.array.bytes
        covered = sum(
            max(0, min(stop, bank.base + bank.bytes) - max(start, bank.base))
            for bank in target.banks
            if bank.name in placement.banks
        )
        assert covered == placement.array.bytes
        assert start % placement.array.cell_bytes == 0
        assert all(stop <= other or end <= start for other, end in taken)
        taken.append((start, stop))
    if result.fits:
        assert result.need_bytes <= result.have_bytes
