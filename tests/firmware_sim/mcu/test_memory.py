"""Arrays are as C packs them and lie where the part has room; code in flash costs what does not fit its cache."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from tiegocancel.firmware_sim import load_target, place_arrays
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.mcu.costs import loop_table
from tiegocancel.firmware_sim.mcu.memory import data_cache, fetch_cycles, memory_cost
from tiegocancel.firmware_sim.mcu.primitives import ITEMS, PRIMITIVES
from tiegocancel.firmware_sim.mcu.simulator import McuSimulator
from tiegocancel.firmware_sim.target_mcu import McuTarget

from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.presets import PRESETS
from tiegocancel.motion.schedule import MotionSchedule


def firmware(part: str, table: dict[str, Any], size: tuple[int, int], **config: Any) -> McuSimulator:
    target = load_target(part)
    assert isinstance(target, McuTarget)
    return McuSimulator(
        target, McuConfig(**config), CancelConfig(**table), MotionSchedule.still(), width=size[0], height=size[1]
    )


def test_arrays_hold_whole_words_and_buffers_lie_where_dma_reaches() -> None:
    made = firmware("stm32f405", {**PRESETS["selective"], "ring_capacity": 8192}, (320, 240))
    ring, table, input_, output = made.arrays()
    assert (ring.words, ring.cell_bytes) == (8192, made.words.ring_entry // 8)
    assert (table.words, table.cell_bytes) == (8 << 11, made.words.cell // 8)
    assert input_.bytes == output.bytes == 512 * 8
    assert made.fits
    dma = {bank.name for bank in made.target.ram if bank.dma}
    assert set(made.ram.of("input").banks) | set(made.ram.of("output").banks) <= dma
    assert not next(
        one for one in firmware("stm32f405", {}, (64, 48), input="interrupt").arrays() if one.name == "input"
    ).dma


def test_what_the_part_cannot_hold_does_not_fit() -> None:
    assert not firmware("rp2040", {}, (1280, 720)).fits
    assert firmware("rp2040", {**PRESETS["lean"], "ring_capacity": 4096}, (1280, 720)).fits


def test_a_cell_grows_until_the_sweep_has_time() -> None:
    narrow, wide = (firmware("rp2040", {"ring_capacity": 64}, size).words for size in ((16, 16), (160, 120)))
    assert (narrow.cell, wide.cell) == (16, 32)
    made = firmware("rp2040", {"ring_capacity": 64}, (160, 120))
    blocks = -(-160 * 120 // made.table.sweep_cells)
    assert made.plan.sweep_cycles * blocks <= made.words.sweep_ticks * made.target.clock_mhz
    with pytest.raises(ValueError, match="time_bits must be above 11: a sweep"):
        firmware("rp2040", {"ring_capacity": 64}, (160, 120), time_bits=11)


def test_waits_follow_the_bank_and_the_cache_serves_what_lies_behind_it(draw_slow: Any) -> None:
    made = firmware("stm32h743", {}, (320, 240))
    assert data_cache(made.target) is not None
    assert made.ram.of("table").wait_cycles > 0
    assert made.plan.cached & 1
    for bit, name in enumerate(("table", "ring")):
        assert made.plan.miss_cycles[bit] == made.ram.of(name).wait_cycles + 3
    small = firmware("stm32f405", {"ring_capacity": 512}, (64, 48))
    assert data_cache(small.target) is None
    assert not small.plan.wait.any()
    part = draw_slow(False)
    placed = place_arrays(small.arrays(), part)
    cost = memory_cost(part, dataclasses.replace(small.words, cell=64), placed)
    wait = placed.of("table").wait_cycles
    assert cost.wait[ITEMS.index("look")] == 2 * wait
    assert cost.wait[ITEMS.index("write")] == 4 * wait


def test_code_in_flash_is_free_where_a_cache_holds_it_and_waits_where_none_does() -> None:
    f405 = load_target("stm32f405")
    assert isinstance(f405, McuTarget)
    table = loop_table(f405, "O2")
    roomy = dataclasses.replace(f405, flash=dataclasses.replace(f405.flash, accelerator_bytes=8192))
    assert not fetch_cycles(roomy, table, plain=True).any()
    part = fetch_cycles(f405, table, plain=True)
    bare = dataclasses.replace(f405, flash=dataclasses.replace(f405.flash, accelerator_bytes=0, prefetch=False))
    whole = fetch_cycles(bare, table, plain=True)
    assert (part <= whole).all()
    assert 0 < part.sum() < whole.sum()
    event = PRIMITIVES.index("look")
    lines = table.counts[event, :8].sum() * table.bytes_per_instruction / 16
    taken = table.counts[event, 5] + table.counts[event, 7]
    assert whole[event] == pytest.approx(5 * (lines + taken))
    outside = dataclasses.replace(f405, flash=dataclasses.replace(bare.flash, bytes=0), caches=())
    with pytest.raises(ValueError, match="code must be ram on the STM32F405RG"):
        fetch_cycles(outside, table, plain=True)
    ram, flash = (
        firmware("stm32f405", {"ring_capacity": 512}, (64, 48), code=where).plan.cost for where in ("ram", "flash")
    )
    assert (flash >= ram).all()
    assert flash.sum() > ram.sum()


def test_a_queue_of_another_depth_leaves_the_arrays_where_they_are() -> None:
    target = load_target("stm32h743")
    assert isinstance(target, McuTarget)
    made = [
        McuSimulator(
            target, McuConfig(), CancelConfig(), MotionSchedule.still(), width=64, height=48, queue_depth=depth
        )
        for depth in (0, 1 << 16)
    ]
    assert made[0].ram.placements == made[1].ram.placements
    assert np.array_equal(made[0].plan.wait, made[1].plan.wait)
    assert [one.plan.input_depth for one in made] == [512, 1 << 16]
