"""The table of the loop is whole, says its error, and prices the prototype's configuration as it was measured."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tiegocancel.firmware_sim import load_target
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.mcu.costs import CLASSES, class_cycles, loop_table
from tiegocancel.firmware_sim.mcu.layout import lay_out_words
from tiegocancel.firmware_sim.mcu.primitives import ITEMS, PRIMITIVES, primitives_of_items
from tiegocancel.firmware_sim.mcu.simulator import McuSimulator
from tiegocancel.firmware_sim.target import target_names
from tiegocancel.firmware_sim.target_mcu import McuTarget

from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.schedule import MotionSchedule

PARTS = [name for name in target_names() if isinstance(load_target(name), McuTarget)]


def part(name: str) -> Any:
    return load_target(name)


@pytest.mark.parametrize("optimisation", ["O2", "Os"])
@pytest.mark.parametrize("name", PARTS)
def test_every_part_has_a_table_of_every_primitive_with_its_error(name: str, optimisation: str) -> None:
    table = loop_table(part(name), optimisation)
    assert table.counts.shape == (len(PRIMITIVES), len(CLASSES))
    assert (table.counts >= 0).all()
    assert 0 < table.fit_share < table.fit_worst
    assert {"isr_event", "isr_half", "sweep_block"} == set(table.once)
    assert 300 < table.code_bytes_plain < table.code_bytes < 4000
    assert table.borrowed == (part(name).core.isa == "Xtensa")


def test_code_for_size_is_smaller_and_slower() -> None:
    fast, small = (loop_table(part("stm32f405"), optimisation) for optimisation in ("O2", "Os"))
    assert small.code_bytes < fast.code_bytes
    cancel = CancelConfig(tolerance_px=1.5)
    rows = primitives_of_items(cancel, lay_out_words(cancel, width=160, height=120))
    usual = usual_work(9.0)
    assert usual @ rows @ fast.cycles(part("stm32f405").cycles) < usual @ rows @ small.cycles(part("stm32f405").cycles)


def usual_work(looks: float) -> np.ndarray:
    """A usual event: one pass, one write, a third suppressed."""
    work = dict.fromkeys(ITEMS, 0.0)
    work.update({"event": 1, "pass": 0.9, "write": 0.9, "look": looks, "candidate": 0.3, "take": 0.3})
    work.update({"output": 0.7, "map": 1, "store": 0.9})
    return np.array([work[item] for item in ITEMS])


def test_cycles_a_class_are_the_parts_own() -> None:
    cycles = class_cycles(part("rp2040").cycles)
    assert dict(zip(CLASSES, cycles.tolist(), strict=True))["load"] == 2
    assert len(cycles) == len(CLASSES)


@pytest.mark.parametrize(("name", "cycles"), [("rp2040", 400), ("stm32f405", 302)])
def test_the_plain_rule_costs_about_what_the_prototype_took(name: str, cycles: float) -> None:
    cancel = CancelConfig(tolerance_px=1.5)
    words = lay_out_words(cancel, width=160, height=120, time_bits=14)
    priced = primitives_of_items(cancel, words) @ loop_table(part(name), "O2").cycles(part(name).cycles)
    assert usual_work(7.5) @ priced == pytest.approx(cycles, rel=0.12)


def test_the_stated_error_is_wider_where_counts_are_borrowed() -> None:
    shares = {}
    for name in ("stm32f405", "esp32-s3"):
        made = McuSimulator(part(name), McuConfig(), CancelConfig(), MotionSchedule.still(), width=64, height=48)
        assert made.error_share > made.table.fit_share
        shares[name] = made.error_share
    assert shares["stm32f405"] < 0.2 < 0.5 < shares["esp32-s3"] < 1
