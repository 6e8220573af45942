"""Name what the firmware's loop does for an event, and how often: work that its table of instructions prices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.mcu.layout import WordLayout

from tiegocancel.matching.config import CancelConfig

__all__ = ["ITEMS", "PRIMITIVES", "primitives_of_items"]

ITEMS = (
    "event", "pass", "write", "way_written", "look", "way_looked", "candidate", "take", "output", "map", "store",
    "border", "border_offset",
)  # fmt: skip
"""What is counted event by event:

``event`` itself; ``pass`` of a ring entry by a pointer; ``write`` of a cell and ``way_written`` compared for it;
``look`` at a bin's cell and ``way_looked`` at; ``candidate`` found; ``take`` of a use; ``output`` of a residual;
``map`` of a place when the event is remembered; ``store`` in the ring; ``border``: an event whose window leaves the
sensor, and ``border_offset`` in that window. Where one candidate decides (``need = 1``, nothing carried), looking stops
there.
"""

PRIMITIVES = (
    "event", "event_horizon", "event_spread", "event_line", "event_carry", "event_bin",
    "pass", "pass_map", "pass_map_wide", "pass_wide",
    "write", "write_carry", "write_uses", "write_set", "write_wide", "way_written", "way_written_wide",
    "look", "look_spread", "look_wide", "look_set", "way_looked", "way_looked_wide",
    "candidate", "candidate_gates", "candidate_carry", "candidate_line", "take", "take_uses", "output",
    "map", "map_wide", "map_least", "map_choose", "store", "store_wide", "border", "border_offset", "border_bin",
)  # fmt: skip
"""Stretches of the loop's code; a name that begins with an item's adds to it under an option.

``_horizon``: for each horizon beyond the first; ``_spread``, ``_line``, ``_gates`` (of OFF), ``_carry``, ``_bin``,
``_uses`` (above 1), ``_choose``, ``_least``: under that option; ``_set``: with sets of ways instead of a cell for every
bin; ``_map``: where the place is computed when the entry is passed; ``_wide``: with words or coefficients of 64 bits.
"""


def primitives_of_items(config: CancelConfig, words: WordLayout) -> NDArray[np.float64]:
    """Return how many of each primitive an item is, float64[items, primitives]."""
    wide_cell, wide_entry, wide_map = words.cell == 64, words.ring_entry == 64, words.coefficient == 64
    gates = len({*zip(config.late_gates_us, config.reaches_squared_px, strict=True)}) > 1
    sets = config.set_bits is not None
    carries, uses = config.carry > 0, config.uses > 1
    table: dict[str, dict[str, float]] = {
        "event": {
            "event": 1,
            "event_horizon": len(config.horizons_us) - 1,
            "event_spread": config.spreads,
            "event_line": config.lines,
            "event_carry": carries,
            "event_bin": config.bin_bits > 0,
        },
        "pass": {
            "pass": 1,
            "pass_map": not words.places,
            "pass_map_wide": not words.places and wide_map,
            "pass_wide": wide_entry,
        },
        "write": {
            "write": 1,
            "write_carry": carries,
            "write_uses": uses,
            "write_set": sets,
            "write_wide": wide_cell,
        },
        "way_written": {"way_written": 1, "way_written_wide": wide_cell},
        "look": {"look": 1, "look_spread": config.spreads, "look_wide": wide_cell, "look_set": sets},
        "way_looked": {"way_looked": 1, "way_looked_wide": wide_cell},
        "candidate": {
            "candidate": 1,
            "candidate_gates": gates,
            "candidate_carry": carries,
            "candidate_line": config.lines,
        },
        "take": {"take": 1, "take_uses": uses},
        "output": {"output": 1},
        "map": {
            "map": 1,
            "map_wide": wide_map,
            "map_least": config.least_shift_squared_px > 0,
            "map_choose": config.chooses,
        },
        "store": {"store": 1, "store_wide": wide_entry},
        "border": {"border": 1},
        "border_offset": {"border_offset": 1, "border_bin": config.bin_bits > 0},
    }
    return np.array([[float(table[item].get(name, 0)) for name in PRIMITIVES] for item in ITEMS])
