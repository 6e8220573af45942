"""The RAM that a part offers follows from its data file."""

from __future__ import annotations

import pytest
from tiegocancel.firmware_sim.target import load_target, target_names
from tiegocancel.firmware_sim.target_fpga import FpgaTarget
from tiegocancel.firmware_sim.target_mcu import McuTarget
from tiegocancel.firmware_sim.target_ram import usable_ram_bits


def test_a_microcontroller_offers_all_its_banks() -> None:
    target = load_target("rp2040")
    assert isinstance(target, McuTarget)
    assert usable_ram_bits(target) == 8 * sum(bank.bytes for bank in target.ram)


def test_an_fpga_offers_the_usable_share_of_each_kind_of_block() -> None:
    target = load_target("ice40up5k")  # 30 blocks of 4 kbit and 4 of 256 kbit
    assert isinstance(target, FpgaTarget)
    by_hand = 30 * 4096 * target.usable.block_ram + 4 * 262_144 * target.usable.large_ram
    assert usable_ram_bits(target) == pytest.approx(by_hand, abs=2)


@pytest.mark.parametrize("name", target_names())
def test_every_part_offers_some(name: str) -> None:
    assert usable_ram_bits(load_target(name)) > 50_000
