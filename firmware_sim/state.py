"""Count the bits that a canceller must hold on a device: ring and table at chosen widths."""

from __future__ import annotations

from dataclasses import dataclass

from tiegocancel.matching.config import CancelConfig

__all__ = ["StateBits", "state_bits"]

PACKED_TIME_BITS = 30
"""Width of a time stamp in the packed kernel of the plain rule."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StateBits:
    """Widths and totals in bits; pointers and counters, a few words, and the schedule's rows are left out.

    ``ring = ring_entry · (capacities of all rings) + index``; ``table = cell · cells``. ``time``: a cell's stamp;
    ``address``: a place on the sensor; ``support``: the carried support, in entry and cell; ``index``: where in the
    ring each tick begins, 0 where the entries hold their own time; ``tag``: which bin a cell of a set serves;
    ``sweep_ticks``: every cell is looked at once in so many ticks, 0 where the host moves the base of the times
    instead.
    """

    time: int
    address: int
    ring_entry: int
    ring: int
    cell: int
    table: int
    cells: int
    support: int = 0
    index: int = 0
    tag: int = 0
    sweep_ticks: int = 0

    @property
    def total(self) -> int:
        """Ring and table together."""
        return self.ring + self.table

    @property
    def total_kib(self) -> float:
        """Ring and table in KiB, before rounding to the memory blocks of a part."""
        return self.total / 8192


def state_bits(config: CancelConfig, *, width: int, height: int, time_bits: int | None = None) -> StateBits:
    """Return the state of ``config`` for a sensor of ``width`` × ``height`` px with time stamps of ``time_bits``.

    **Plain rule.** An entry is time, address and polarity of a prediction, a cell is time, polarity, valid. 30 bits of
    time, the default, is what the packed kernel holds. Fewer wrap sooner and need a scrub of the table; below
    ``log2(2·(Δt + ε_t) + 1)`` a pending prediction is ambiguous, and ``ValueError`` says so.

    **Otherwise** an entry is column, row, polarity and carried support of an event, and a cell is tag, time, polarity,
    a bit for each horizon (none set: no cell), carried support, ``⌈log2 uses⌉`` bits and, under ``line_px``, the
    predicted place within its bin, ``bin_bits + fraction_bits`` for each axis. In ticks, with
    ``G = early + late + 1``:

    - A cell's stamp ``τ'`` is kept modulo ``2^T``. What is written at tick ``τ`` is open until ``L = τ' + late`` and
      has ``τ − late ≤ τ' ≤ τ + early``; what is past its gate when it is written is not written. The cell seems
      open while ``r = (τ' − τ + late) mod 2^T < G``, which is the truth when it is written. ``r`` falls by one a tick:
      it is 0 at ``L`` and ``2^T − j`` at ``L + j``, so below ``G`` again, an alias, from ``j = 2^T − G + 1`` on. Hence
      **T needs 2^T > G, and a sweep that looks at every cell once in any** ``2^T − G`` **ticks and empties the closed
      ones hides every alias**. Emptying them shows in no decision and no count: closed is closed, for time does not go
      back. Of open ways the one due first has the least ``r``. The default ``T`` leaves the sweep a quarter of ``G``.
    - Where OFF has a late gate of its own, a cell's ``late`` is that of its polarity, and ``G`` takes the wider one.
    - Of an entry the device must know its age, from 0 to ``A = Δ_n + late``; one older is past every gate, and a
      pointer for each horizon, moved by the clock, tells where those end. That takes ``2^R > A + 1`` in every entry or,
      entries being in order, the place where each of ``A + 1`` ticks begins; the smaller one is counted. The tick
      stands for the time where a schedule changes at whole ticks only. Where events choose a horizon, each has its
      ring, with an ``A`` of its own, and every entry the stamp of the longest.

    ``ValueError`` says the least ``T``.
    """
    if not config.is_plain:
        return _selective_bits(config, width, height, time_bits)
    time_bits = PACKED_TIME_BITS if time_bits is None else time_bits
    least = (2 * config.warm_up_us).bit_length()
    if not least <= time_bits <= 64:
        raise ValueError(
            f"time_bits must be from {least} to 64 for a horizon of {config.horizon_us} µs, not {time_bits}"
        )
    address = (width * height - 1).bit_length()
    ring_entry, cell = time_bits + address + 1, time_bits + 2
    return StateBits(
        time=time_bits,
        address=address,
        ring_entry=ring_entry,
        ring=ring_entry * sum(config.ring_capacities),
        cell=cell,
        table=cell * width * height,
        cells=width * height,
    )


def _selective_bits(config: CancelConfig, width: int, height: int, time_bits: int | None) -> StateBits:
    """Return the state beyond the plain rule, see :func:`state_bits`."""
    early, late, longest = (
        value >> config.tick_bits for value in (config.early_gate_us, config.late_gate_us, config.horizons_us[-1])
    )
    gate = early + late + 1
    if time_bits is None:
        time_bits = (gate + max(1, gate // 4) - 1).bit_length()
    if not gate.bit_length() <= time_bits <= 64:
        raise ValueError(
            f"time_bits must be from {gate.bit_length()} to 64 for a gate of {gate} ticks, not {time_bits}"
        )
    support = config.carry.bit_length()
    address = (width - 1).bit_length() + (height - 1).bit_length()
    rings = config.ring_capacities
    due = [horizon >> config.tick_bits for horizon in config.horizons_us] if config.chooses else [longest]
    stamp = (longest + late + 1).bit_length()
    index = sum((ticks + late + 1) * held.bit_length() for ticks, held in zip(due, rings, strict=True))
    stamped = stamp * sum(rings) <= index
    ring_entry = address + 1 + support + (stamp if stamped else 0)
    index = 0 if stamped else index
    bins = [((side - 1) >> config.bin_bits) + 1 for side in (width, height)]
    tag, cells = 0, bins[0] * bins[1]
    if config.set_bits is not None:
        tag = sum(max((many - 1).bit_length() - low, 0) for many, low in zip(bins, config.set_bits, strict=True))
        cells = config.ways << sum(config.set_bits)
    uses = (config.uses - 1).bit_length() if config.uses else 0
    cell = tag + time_bits + 1 + len(config.horizons_us) + support + uses
    if config.lines:
        cell += 2 * (config.bin_bits + config.fraction_bits)
    return StateBits(
        time=time_bits,
        address=address,
        ring_entry=ring_entry,
        ring=ring_entry * sum(rings) + index,
        cell=cell,
        table=cell * cells,
        cells=cells,
        support=support,
        index=index,
        tag=tag,
        sweep_ticks=(1 << time_bits) - gate,
    )
