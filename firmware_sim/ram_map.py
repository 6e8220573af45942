"""Place the arrays of a firmware in a microcontroller's RAM: whole cells, no array across a gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tiegocancel.firmware_sim.target_mcu import McuTarget, RamBank

__all__ = ["RamArray", "RamMap", "RamPlacement", "place_arrays"]

RESERVE_BYTES = 16384
"""Stack, buffers of DMA and what else a firmware needs, unless the caller says otherwise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RamArray:
    """An array of ``words`` cells of ``width_bits``, each padded to 1, 2, 4 or 8 bytes and more by 8.

    ``dma``: it must lie where DMA reaches.
    """

    name: str
    words: int
    width_bits: int
    dma: bool = False

    def __post_init__(self) -> None:
        if self.words < 1 or self.width_bits < 1:
            raise ValueError(f"words and width_bits must be positive, not {self.words} and {self.width_bits}")

    @property
    def cell_bytes(self) -> int:
        """Bytes of a padded cell."""
        return next((size for size in (1, 2, 4) if self.width_bits <= 8 * size), -(-self.width_bits // 64) * 8)

    @property
    def bytes(self) -> int:
        """Bytes of the array."""
        return self.words * self.cell_bytes

    @property
    def padding_bits(self) -> int:
        """Bits lost to whole cells."""
        return 8 * self.bytes - self.words * self.width_bits


@dataclass(frozen=True, slots=True, kw_only=True)
class RamPlacement:
    """An array at ``base`` in ``banks`` that touch; ``wait_cycles`` of the slowest of them; no banks: does not fit."""

    array: RamArray
    banks: tuple[str, ...]
    base: int
    wait_cycles: int
    cached: bool

    @property
    def fits(self) -> bool:
        """Whether a place was found."""
        return bool(self.banks)


@dataclass(frozen=True, slots=True, kw_only=True)
class RamMap:
    """Where every array went. ``need_bytes``: arrays and reserve; ``largest_free_bytes``: what one more could have."""

    placements: tuple[RamPlacement, ...]
    reserve_bytes: int
    need_bytes: int
    have_bytes: int
    largest_free_bytes: int

    @property
    def fits(self) -> bool:
        """Whether the reserve and all arrays found a place."""
        return all(placement.fits for placement in self.placements)

    @property
    def padding_bits(self) -> int:
        """Bits lost to whole cells."""
        return sum(placement.array.padding_bits for placement in self.placements)

    def of(self, name: str) -> RamPlacement:
        """Return the placement of the array ``name``; raise ``KeyError`` where there is none."""
        for placement in self.placements:
            if placement.array.name == name:
                return placement
        raise KeyError(name)


def place_arrays(arrays: Sequence[RamArray], target: McuTarget, *, reserve_bytes: int = RESERVE_BYTES) -> RamMap:
    """Place the reserve, then ``arrays``, the largest first, in the fastest memory that holds them, tightest first.

    An array lies in one bank if one has the room, otherwise across banks that follow each other in address. The
    reserve, which DMA must reach, goes to the end of the smallest piece that holds it.
    """
    if reserve_bytes < 0:
        raise ValueError(f"reserve_bytes must not be negative, not {reserve_bytes}")
    free: list[tuple[int, int]] = [(bank.base, bank.base + bank.bytes) for bank in target.banks]
    placed: dict[int, RamPlacement] = {}
    reserve = RamArray(name="reserve", words=max(reserve_bytes, 1), width_bits=8, dma=True)
    if reserve_bytes:
        placed[len(arrays)] = _place(reserve, target, free, at_end=True)
    for index, array in sorted(enumerate(arrays), key=lambda item: -item[1].bytes):
        placed[index] = _place(array, target, free, at_end=False)
    return RamMap(
        placements=tuple(placed[index] for index in sorted(placed)),
        reserve_bytes=reserve_bytes,
        need_bytes=reserve_bytes + sum(array.bytes for array in arrays),
        have_bytes=target.ram_bytes,
        largest_free_bytes=max((stop - start for start, stop in _runs(free)), default=0),
    )


def _runs(free: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Join free pieces that touch."""
    runs: list[tuple[int, int]] = []
    for start, stop in sorted(free):
        if runs and runs[-1][1] == start:
            runs[-1] = (runs[-1][0], stop)
        else:
            runs.append((start, stop))
    return runs


def _spanned(target: McuTarget, start: int, stop: int) -> list[RamBank]:
    return [bank for bank in target.banks if bank.base < stop and start < bank.base + bank.bytes]


def _place(array: RamArray, target: McuTarget, free: list[tuple[int, int]], *, at_end: bool) -> RamPlacement:
    """Take the best place out of ``free`` and return it."""
    options = []
    for pieces in (free, _runs(free)):
        for start, stop in pieces:
            base = stop - array.bytes if at_end else -(-start // array.cell_bytes) * array.cell_bytes
            if base < start or base + array.bytes > stop:
                continue
            banks = _spanned(target, base, base + array.bytes)
            if array.dma and not all(bank.dma for bank in banks):
                continue
            wait = 0 if at_end else max(bank.wait_cycles for bank in banks)
            options.append((wait, stop - start - array.bytes, len(banks), base, banks))
        if options:
            break
    if not options:
        return RamPlacement(array=array, banks=(), base=0, wait_cycles=0, cached=False)
    _, _, _, base, banks = min(options, key=lambda option: option[:4])
    free[:] = [
        piece
        for start, stop in free
        for piece in ((start, min(stop, base)), (max(start, base + array.bytes), stop))
        if piece[0] < piece[1]
    ]
    return RamPlacement(
        array=array,
        banks=tuple(bank.name for bank in banks),
        base=base,
        wait_cycles=max(bank.wait_cycles for bank in banks),
        cached=all(bank.cached or bank.wait_cycles == 0 for bank in banks),
    )
