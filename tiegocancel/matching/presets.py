"""Name operating points of the canceller that were measured, see ``tests/benchmarks/bench_selectivity.py``."""

from __future__ import annotations

import difflib
from typing import Any

from tiegocancel.errors import ConfigError

__all__ = ["PRESETS", "preset_table"]

_COMMON = {
    "early_us": 2560,
    "late_us": 2560,
    "tick_bits": 9,
    "uses": 0,
    "carry": 3,
    "least_shift_px": 1.0,
}
"""Wide in time, narrow in space: an edge crosses the lattice of pixels, and half a pixel is a millisecond or three."""

PRESETS: dict[str, dict[str, Any]] = {
    "plain": {},
    "selective": {
        **_COMMON,
        "horizon_us": 12_288,
        "tolerance_px": 1.0,
        "bin_bits": 1,
        "need": 4,
        "set_bits": [6, 5],
        "ways": 8,
        "ring_capacity": 49_152,
    },
    "two-speed": {
        **_COMMON,
        "horizon_us": 6_144,
        "more_horizons_us": [12_288],
        "choose_px": 4.0,
        "tolerance_px": 1.0,
        "bin_bits": 1,
        "need": 4,
        "set_bits": [6, 5],
        "ways": 8,
        "ring_capacity": 10_240,
        "more_ring_capacities": [28_672],
    },
    "lean": {
        **_COMMON,
        "horizon_us": 8_192,
        "tolerance_px": 0.0,
        "bin_bits": 1,
        "need": 3,
        "set_bits": [6, 5],
        "ways": 8,
        "ring_capacity": 32_768,
    },
    "dense": {**_COMMON, "horizon_us": 10_240, "tolerance_px": 1.4143, "need": 4, "ring_capacity": 65_536},
}
"""Tables for ``[cancel]``: times fit edges that move at several hundred px/s; slower ones need longer times alike.

``plain`` is the rule of the thesis made causal; ``selective`` keeps nearly all movers in 176 KiB at 1280×720;
``two-speed`` lets fast pixels choose half the horizon, and holds a fifth less;
``lean`` looks at one cell an event; ``dense`` has a cell for every pixel.
"""


def preset_table(name: object, where: str) -> dict[str, Any]:
    """Return a preset's table; raise ``ConfigError`` naming the nearest one where there is none of that name."""
    if isinstance(name, str) and name in PRESETS:
        return dict(PRESETS[name])
    near = difflib.get_close_matches(str(name), PRESETS, n=1, cutoff=0.5)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise ConfigError(f"{where} must be one of {', '.join(PRESETS)}, not {name!r}{hint}")
