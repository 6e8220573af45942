"""Energy an event: from the datasheet's current where there is one, and openly none otherwise."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tiegocancel.firmware_sim.energy import NO_FIGURE, estimate_energy
from tiegocancel.firmware_sim.target import load_target, target_names
from tiegocancel.firmware_sim.target_fpga import FpgaEnergy, FpgaTarget
from tiegocancel.firmware_sim.target_mcu import McuTarget


def test_current_by_clock_times_supply_times_cycles() -> None:
    """300 cycles on an STM32F405: 40 mA at 168 MHz and 3.3 V is 786 pJ a cycle, 0.24 µJ an event."""
    estimate = estimate_energy(load_target("stm32f405"), cycles_per_event=300, events_per_second=500_000)
    assert estimate.nanojoules_per_event == pytest.approx(300 * 40e-3 / 168e6 * 3.3 * 1e9, rel=0.001)
    assert estimate.milliwatts == pytest.approx(estimate.nanojoules_per_event * 0.5, rel=1e-9)
    assert "DS8626" in estimate.source
    assert estimate.text == "236 nJ/event"


def test_every_part_has_a_figure_with_a_document_or_says_that_it_has_none() -> None:
    figures = 0
    for name in target_names():
        target = load_target(name)
        estimate = estimate_energy(target, cycles_per_event=100)
        if isinstance(target, McuTarget) and target.energy is not None:
            figures += 1
            assert estimate.nanojoules_per_event == pytest.approx(0.1 * target.energy.picojoules_per_cycle)
            assert estimate.source == target.energy.source
        else:
            assert (estimate.nanojoules_per_event, estimate.milliwatts) == (None, None)
            assert estimate.text == NO_FIGURE
            assert estimate.source.startswith(NO_FIGURE)
            assert target.part in estimate.source
    assert figures == 3


def test_static_power_is_said_and_not_made_an_energy() -> None:
    target = load_target("ecp5-45f")
    assert isinstance(target, FpgaTarget)
    known = replace(target, energy=FpgaEnergy(static_milliwatts=60, source="a board that was measured"))
    estimate = estimate_energy(known, cycles_per_event=20)
    assert estimate.nanojoules_per_event is None
    assert "static power 60 mW: a board that was measured" in estimate.source


def test_negative_cycles_are_refused() -> None:
    with pytest.raises(ValueError, match="cycles_per_event must not be negative, not -1"):
        estimate_energy(load_target("rp2040"), cycles_per_event=-1)
