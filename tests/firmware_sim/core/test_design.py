"""A design holds the bits that the state says, sweeps before stamps come back, and grows with its look-up."""

from __future__ import annotations

import pytest
from tiegocancel.firmware_sim.core.config import CoreConfig, window_shape
from tiegocancel.firmware_sim.core.design import CoreDesign

from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.presets import preset_table


def selective() -> CancelConfig:
    table = preset_table("selective", "test")
    return CancelConfig(**{**table, "set_bits": tuple(table["set_bits"])})


def table_bits(design: CoreDesign) -> int:
    return sum(one.bits for one in design.memories() if one.name.startswith("table"))


@pytest.mark.parametrize("lookup", ["serial", "row", "banked"])
def test_memories_hold_ring_and_table(lookup: str) -> None:
    design = CoreDesign(CoreConfig(lookup=lookup), selective(), 1280, 720, 66e6)  # type: ignore[arg-type]
    memories = {one.name: one for one in design.memories()}
    assert memories["ring"].bits == design.state.ring_entry * 49_152
    assert design.state.table <= table_bits(design) <= 1.1 * design.state.table + 4096
    assert len([name for name in memories if name.startswith("table")]) == design.banks


@pytest.mark.parametrize("clock_hz", [12e6, 48e6, 200e6])
@pytest.mark.parametrize("cancel", [CancelConfig(), selective()])
def test_the_sweep_looks_at_every_word_before_a_stamp_comes_back(clock_hz: float, cancel: CancelConfig) -> None:
    design = CoreDesign(CoreConfig(), cancel, 640, 480, clock_hz)
    round_us = design.scrub_cycles * design.table_words / clock_hz * 1e6
    gate = ((cancel.early_gate_us + cancel.late_gate_us) >> cancel.tick_bits) + 1
    assert round_us <= ((1 << design.stamp_bits) - gate) * (1 << cancel.tick_bits)
    assert design.scrub_cycles >= 10 * (1 + 1 + 2)


def test_a_window_of_bins_is_counted_wherever_it_lies() -> None:
    assert window_shape(CancelConfig(tolerance_px=2.0)) == (13, 5, 5)
    assert window_shape(CancelConfig(tolerance_px=1.0, bin_bits=1)) == (3, 2, 2)
    assert window_shape(CancelConfig(tolerance_px=0.0, bin_bits=2)) == (1, 1, 1)


def test_an_external_table_leaves_its_cache_inside() -> None:
    names = [one.name for one in CoreDesign(CoreConfig(table_memory="external"), selective(), 64, 64, 1e8).memories()]
    assert "table_cache" in names
    assert "table" not in names


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"input_depth": 0}, "input_depth must be an integer from 1 to 1048576, not 0"),
        ({"lookup": "fast"}, "lookup must be one of serial, row, banked, not 'fast'"),
        ({"table_memory": "single_port", "overlap": "forward"}, "one port to read and write"),
        ({"table_memory": "external", "lanes": 2}, "lanes must be 1 and lookup serial, not 2"),
    ],
)
def test_a_core_that_cannot_be_built_is_refused(table: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        CoreConfig(**table)  # type: ignore[arg-type]
