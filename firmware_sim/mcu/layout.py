"""Lay out ring entries and cells as a firmware packs them: whole words of 8, 16, 32 or 64 bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.state import state_bits

from tiegocancel.matching.config import CancelConfig

__all__ = ["SWEEP_SHARE", "WordLayout", "fits_32_bits", "lay_out_words"]

SWEEP_SHARE = 0.02
"""Most of the core's time that the sweep of stamps may take before cells grow by a word size."""

_CLOCK_BITS = 32
"""Events carry µs in 32 bits, so no stamp is wider than what ``tick_bits`` leaves of them."""
_INT32 = 1 << 31


@dataclass(frozen=True, slots=True, kw_only=True)
class WordLayout:
    """Widths in bits. ``time``: a cell's stamp; ``cell``: the padded cell; ``ring_stamp``, ``ring_entry``: of the ring.

    ``places``: ring entries hold the place predicted when the event came, which saves the map when they are passed;
    where several horizons share a ring, or the motion is asked when the gate opens, they hold the event.
    ``sweep_ticks``: every cell is looked at once in so many ticks. ``coefficient``: of the motion, 32 or 64.
    """

    places: bool
    time: int
    cell: int
    cells: int
    ring_stamp: int
    ring_entry: int
    sweep_ticks: int
    coefficient: int


def lay_out_words(
    config: CancelConfig,
    *,
    width: int,
    height: int,
    coefficient_bits: int = 32,
    time_bits: int = 0,
    sweep_cycles: float = 20.0,
    clock_mhz: float = 100.0,
) -> WordLayout:
    """Return the words of a configuration; ``time_bits`` of a cell's stamp are chosen when 0.

    A cell is the smallest word whose stamp hides its aliases with a sweep of at most :data:`SWEEP_SHARE` of a core of
    ``clock_mhz`` that looks at a cell in ``sweep_cycles``. Raise ``ValueError`` where nothing holds a cell or an entry.
    """
    early, late, longest = (
        value >> config.tick_bits for value in (config.early_gate_us, config.late_gate_us, config.horizons_us[-1])
    )
    gate = early + late + 1
    places = config.motion_at == "event" and (config.chooses or len(config.horizons_us) == 1)
    least = state_bits(config, width=width, height=height, time_bits=None)
    cells, address = least.cells, (width - 1).bit_length() + (height - 1).bit_length()
    fraction = 2 * (config.bin_bits + config.fraction_bits) if config.lines else 0
    horizons = len(config.horizons_us)
    uses = (config.uses - 1).bit_length() if config.uses else 0
    rest = 1 + horizons + config.carry.bit_length() + uses + least.tag + fraction
    widest = _CLOCK_BITS - config.tick_bits
    chosen = None
    for word in (8, 16, 32, 64):
        bits = time_bits or min(word - rest, widest)
        if bits + rest > word or bits < gate.bit_length():
            continue
        sweep_us = ((1 << bits) - gate) << config.tick_bits
        chosen = word, bits
        if time_bits or cells * sweep_cycles / (sweep_us * clock_mhz) <= SWEEP_SHARE:
            break
    if chosen is None:
        raise ValueError(f"time_bits must be from {gate.bit_length()} to {64 - rest} here, not {time_bits}")
    entry_rest = address + 1 + config.carry.bit_length()
    if places and config.lines:
        entry_rest += 2 * config.fraction_bits
    stamp = (longest + late + 1).bit_length()
    entry = next((word for word in (32, 64) if stamp + entry_rest <= word), 0)
    if not entry:
        raise ValueError(f"a ring entry of {stamp + entry_rest} bits does not fit 64")
    return WordLayout(
        places=places,
        time=chosen[1],
        cell=chosen[0],
        cells=cells,
        ring_stamp=min(entry - entry_rest, widest),
        ring_entry=entry,
        sweep_ticks=(1 << chosen[1]) - gate,
        coefficient=coefficient_bits,
    )


def fits_32_bits(rows: NDArray[np.int64], *, width: int, height: int) -> bool:
    """Tell whether 32-bit arithmetic gives every prediction exactly; ``rows`` int64[..., 6] are ``a b c d e f``.

    Sums wrap without harm as long as ``(x << 16) + a·x + b·y + c + 32768`` itself fits, and being affine it is
    largest in a corner. A row that predicts beyond one side of the sensor from every pixel may be far out, as that of
    an unknown motion is: any nearer place beyond does as well.
    """
    table = rows.reshape(-1, 6)
    ok = np.zeros((len(table), 2), np.bool_)
    for axis, (own, limit) in enumerate((("x", width), ("y", height))):
        part = table[:, 3 * axis : 3 * axis + 3]
        corners = np.stack(
            [
                ((x if own == "x" else y) << 16) + part[:, 0] * x + part[:, 1] * y + part[:, 2] + 32768
                for x in (0, width - 1)
                for y in (0, height - 1)
            ]
        )
        low, high = corners.min(axis=0), corners.max(axis=0)
        inside = (low >= -_INT32) & (high < _INT32)
        beyond = ((low >> 16 >= limit) | (high >> 16 < 0)) & (high - low < _INT32 >> 1)
        ok[:, axis] = inside | beyond
    return bool(ok.all())
