"""Say where the firmware's arrays lie and what their memory costs: wait states, or lines of the data cache."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.mcu.config import McuConfig
from tiegocancel.firmware_sim.mcu.costs import LoopTable, class_cycles
from tiegocancel.firmware_sim.mcu.layout import WordLayout
from tiegocancel.firmware_sim.mcu.primitives import ITEMS
from tiegocancel.firmware_sim.ram_map import RamArray, RamMap
from tiegocancel.firmware_sim.target_mcu import Cache, McuTarget

from tiegocancel.matching.config import CancelConfig

__all__ = ["EVENT_BITS", "MemoryCost", "arrays_of", "data_cache", "fetch_cycles", "memory_cost"]

EVENT_BITS = 64
"""An event in the buffers: 32 bits of µs, 14 bits of column and row each, polarity."""

_BUS_BYTES = 8
"""A line comes over a bus of 64 bits, a beat a cycle, after the wait of the first one."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MemoryCost:
    """Wait cycles an item, int64[items]; which arrays the cache serves (1 table, 2 ring, 4 input, 8 output).

    ``miss_cycles`` int64[4]: of a line of each of them.
    """

    wait: NDArray[np.int64]
    cached: int
    miss_cycles: NDArray[np.int64]


def arrays_of(cancel: CancelConfig, config: McuConfig, words: WordLayout) -> list[RamArray]:
    """Return ring, table, input and output buffers as C declares them, for :func:`place_arrays`."""
    return [
        RamArray(name="ring", words=sum(cancel.ring_capacities), width_bits=words.ring_entry),
        RamArray(name="table", words=words.cells, width_bits=words.cell),
        RamArray(name="input", words=config.input_depth, width_bits=EVENT_BITS, dma=config.input != "interrupt"),
        RamArray(name="output", words=config.output_depth, width_bits=EVENT_BITS, dma=True),
    ]


def data_cache(target: McuTarget) -> Cache | None:
    """Return the cache that serves data of the RAM, if there is one."""
    if not any(bank.cached for bank in target.ram):
        return None
    return next((cache for cache in target.caches if cache.serves in ("data", "both")), None)


def memory_cost(target: McuTarget, words: WordLayout, ram: RamMap) -> MemoryCost:
    """Return what every array's place costs.

    An array that found no place waits as the slowest bank does. A line that misses takes the wait of the bank and its
    beats over a bus of 64 bits.
    """
    cache = data_cache(target)
    slowest = max(bank.wait_cycles for bank in target.ram)
    cell_words, entry_words = max(words.cell // 32, 1), words.ring_entry // 32
    accesses = {
        "table": {"write": 2 * cell_words, "way_written": cell_words, "look": cell_words, "way_looked": cell_words,
                  "take": cell_words},
        "ring": {"pass": entry_words, "store": entry_words},
        "input": {"event": 2},
        "output": {"output": 2},
    }  # fmt: skip
    wait = np.zeros(len(ITEMS), np.int64)
    cached, penalty = 0, np.zeros(len(accesses), np.int64)
    for bit, (name, table) in enumerate(accesses.items()):
        place = ram.of(name)
        cycles = place.wait_cycles if place.fits else slowest
        if not cycles:
            continue
        if cache is not None and place.cached:
            cached |= 1 << bit
            penalty[bit] = cycles + cache.line_bytes // _BUS_BYTES - 1
            continue
        for item, count in table.items():
            wait[ITEMS.index(item)] += count * cycles
    return MemoryCost(wait=wait, cached=cached, miss_cycles=penalty)


def fetch_cycles(target: McuTarget, table: LoopTable, *, plain: bool) -> NDArray[np.float64]:
    """Return the cycles a primitive that fetching code from flash adds, float64[primitives].

    A loop that the flash's accelerator or the instruction cache holds costs nothing more; of a larger one the share
    that does not fit is fetched: each line of ``fetch_bits`` waits ``wait_states``, less what a prefetch hides while
    the line before runs, and each taken branch waits in full. Raise ``ValueError`` where code in an external flash
    does not fit the cache: there is no figure for that.
    """
    flash = target.flash
    size = table.code_bytes_plain if plain else table.code_bytes
    held = max(
        [flash.accelerator_bytes] + [cache.bytes for cache in target.caches if cache.serves in ("instructions", "both")]
    )
    missing = max(0.0, 1 - held / size)
    if not missing:
        return np.zeros(len(table.counts))
    if not flash.bytes:
        raise ValueError(
            f"code must be ram on the {target.part}: a loop of {size} bytes does not fit the cache of {held} bytes, "
            "and no wait states of the external flash are known"
        )
    counts = table.counts
    executed = counts[:, :8].sum(axis=1) * table.bytes_per_instruction
    lines = executed / (flash.fetch_bits / 8)
    taken = counts[:, 5] + counts[:, 7]
    own = counts @ class_cycles(target.cycles)
    hidden = np.minimum(own, lines * flash.wait_states) if flash.prefetch else np.zeros(len(counts))
    return np.asarray(missing * (lines * flash.wait_states - hidden + taken * flash.wait_states), np.float64)
