"""Say how the matching core is built: the micro-architecture that a study varies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tiegocancel.matching.config import CancelConfig

__all__ = ["CoreConfig", "window_shape"]

Lookup = Literal["serial", "row", "banked"]
Overlap = Literal["none", "interlock", "forward"]


@dataclass(frozen=True, slots=True, kw_only=True)
class CoreConfig:
    """Describe one matching core; how each number acts is said in ``core/timing.py`` (rules R1 to R8).

    - ``input_depth``, ``output_depth``: events that the FIFOs hold.
    - ``lookup``: cells of the window read in a cycle: one (``serial``), a row of bins (``row``), or all (``banked``).
    - ``ways_per_read``: ways of a set read together, 0 for all of them.
    - ``lanes``: tiles of the table, stripes of columns, each with ports of its own.
    - ``overlap``: a tile works on one operation at a time (``none``); on several, waiting only where one may write
      what the next one reads (``interlock``); or with results forwarded, so that nothing waits (``forward``).
    - ``read_latency``: cycles from address to data, 1, or 2 with the output register of a block RAM.
    - ``select_depth``: cycles from data to decision.
    - ``predict_multipliers``: for the prediction of an event when it comes; ``drain_multipliers``: of a ring entry when
      it is passed. Four products are wanted for a place; with fewer multipliers a place takes more cycles.
    - ``map_depth``: stages from coordinates to a place.
    - ``table_memory``: ``block`` RAM, ``single_port`` RAM (read and write share a port: ``overlap`` must be ``none``)
      or ``external`` behind a cache of ``cache_lines`` lines of ``line_cells`` cells, where a line that is missing
      takes ``miss_cycles``, twice as many when the line that leaves was written to.
    - ``scrub_ticks``: every word of the table is looked at once in so many ticks of the clock, 0 for never.
    - ``coefficient_fraction_bits``: of the motion, 16 as in the semantics or fewer.
    - ``stamp_bits``: width ``T`` of a cell's stamp without a sweep (0: never wraps, or a sweep hides it).

    Raise ``ValueError`` with field, rule and value.
    """

    input_depth: int = 512
    output_depth: int = 64
    lookup: Lookup = "serial"
    ways_per_read: int = 0
    lanes: int = 1
    overlap: Overlap = "none"
    read_latency: int = 1
    select_depth: int = 2
    predict_multipliers: int = 4
    drain_multipliers: int = 4
    map_depth: int = 3
    table_memory: Literal["block", "single_port", "external"] = "block"
    cache_lines: int = 256
    line_cells: int = 16
    miss_cycles: int = 40
    scrub_ticks: int = 0
    coefficient_fraction_bits: int = 16
    stamp_bits: int = 0

    def __post_init__(self) -> None:
        for name, low, high in (
            ("input_depth", 1, 1 << 20),
            ("output_depth", 1, 1 << 20),
            ("ways_per_read", 0, 64),
            ("lanes", 1, 64),
            ("read_latency", 1, 8),
            ("select_depth", 0, 16),
            ("predict_multipliers", 1, 64),
            ("drain_multipliers", 1, 64),
            ("map_depth", 1, 16),
            ("cache_lines", 1, 1 << 20),
            ("line_cells", 1, 4096),
            ("miss_cycles", 1, 1 << 16),
            ("scrub_ticks", 0, 1 << 40),
            ("coefficient_fraction_bits", 0, 16),
            ("stamp_bits", 0, 62),
        ):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
                raise ValueError(f"{name} must be an integer from {low} to {high}, not {value!r}")
        for name, allowed in (
            ("lookup", ("serial", "row", "banked")),
            ("overlap", ("none", "interlock", "forward")),
            ("table_memory", ("block", "single_port", "external")),
        ):
            if getattr(self, name) not in allowed:
                raise ValueError(f"{name} must be one of {', '.join(allowed)}, not {getattr(self, name)!r}")
        if self.table_memory == "single_port" and (self.overlap != "none" or self.lookup != "serial"):
            raise ValueError(
                "table_memory single_port has one port to read and write: overlap must be none and lookup serial, not "
                f"{self.overlap} and {self.lookup}"
            )
        if self.table_memory == "external" and (self.lanes != 1 or self.lookup != "serial"):
            raise ValueError(
                f"table_memory external has one port: lanes must be 1 and lookup serial, not {self.lanes} and "
                f"{self.lookup}"
            )


def window_shape(cancel: CancelConfig) -> tuple[int, int, int]:
    """Return the most bins that one match looks at: in all, and as columns and rows of bins, wherever it lies."""
    side = 1 << cancel.bin_bits
    most, columns, rows = 0, 0, 0
    for x in range(side):
        for y in range(side):
            bins = {((x + dx) >> cancel.bin_bits, (y + dy) >> cancel.bin_bits) for dx, dy in cancel.offsets}
            most = max(most, len(bins))
            columns = max(columns, len({column for column, _ in bins}))
            rows = max(rows, len({row for _, row in bins}))
    return most, columns, rows
