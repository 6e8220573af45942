"""Refine the rotation of one window on the events that agree with it, leaving out what moves otherwise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.motion.contrast import MAX_CELL_BITS, Contrast, Twist, fine_cell_bits
from tiegocancel.motion.search import polish, thinned

__all__ = ["WindowFit", "refine"]

_SLOTS = 2_048
_ROUNDS = ((1, 1.0, 0.5), (0, 1.0, 0.3), (0, 0.5, 0.15), (0, 0.25, 0.15))
"""Of each climb: doublings of the cell, first step in cells, how far from 1 the best multiple of a tile may lie."""
_FIRST_ROUNDS_EVENTS = 40_000
_MULTIPLES = (1.0, 0.0, -0.5, 0.25, 0.5, 0.7, 0.85, 1.15, 1.3, 1.5, 2.0)
"""Speeds, as multiples of the fit, that a tile is tried at; on a tie the first wins."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowFit:
    """The rotation of one window, the gain of contrast it brings, and the share of events that agree with it."""

    start_us: int
    stop_us: int
    events_used: int
    twist: Twist
    contrast_gain: float
    kept_share: float


def refine(
    events: Events,
    twist: Twist,
    *,
    anchor_px: tuple[float, float],
    max_omega_rad_s: float,
    signed: bool,
    rng: np.random.Generator,
) -> WindowFit:
    """Climb to the peak near ``twist``, each time leaving out the tiles of the sensor that move otherwise.

    A static background, a hand at the edge or flicker would pull the peak away. The first climbs look at some of the
    events, the last ones at all of them; the gain that is returned counts all, also those left out.
    """
    finest = fine_cell_bits(events)
    few = thinned(events, _FIRST_ROUNDS_EVENTS, rng)
    kept_tiles = np.ones(int(_tile(events).max()) + 1, np.bool_)
    for doublings, step_cells, tolerance in _ROUNDS:
        cell_bits = min(finest + doublings, MAX_CELL_BITS)
        part = few if step_cells == 1.0 else events
        kept = part.select(kept_tiles[_tile(part)])
        scorer = Contrast(kept, anchor_px=anchor_px, cell_bits=cell_bits, signed=signed, slots=_SLOTS)
        twist, _ = polish(twist, scorer, max_omega_rad_s, evaluations=100, step_cells=step_cells)
        whole = Contrast(part, anchor_px=anchor_px, cell_bits=finest, signed=signed, slots=_SLOTS)
        kept_tiles = _agreeing(part, whole, twist, tolerance, len(kept_tiles))
    return WindowFit(
        start_us=int(events.t[0]),
        stop_us=int(events.t[-1]) + 1,
        events_used=len(events),
        twist=twist,
        contrast_gain=float(whole.gain([twist])[0]),
        kept_share=float(kept_tiles[_tile(events)].mean()),
    )


def _tile(events: Events) -> NDArray[np.int64]:
    """Return the square of about a twentieth of the sensor, 16 px at least, that each event lies in."""
    bits = max(4, (max(events.width, events.height) // 20).bit_length() - 1)
    across = (events.width >> bits) + 1
    return (events.y.astype(np.int64) >> bits) * across + (events.x.astype(np.int64) >> bits)


def _agreeing(events: Events, scorer: Contrast, twist: Twist, tolerance: float, tiles: int) -> NDArray[np.bool_]:
    """Mark the tiles that are most coherent near ``twist`` itself, not at rest or at another speed, bool[tiles].

    Each tile is scored under multiples of the twist; the best multiple must lie within ``1 ± tolerance``. The choice
    is made by tile and not by event, or the fit would confirm itself on the events it likes. All tiles stay when
    almost no event would.
    """
    tile = _tile(events)
    score = np.zeros((len(_MULTIPLES), tiles), np.int64)
    for row, multiple in zip(score, _MULTIPLES, strict=True):
        np.add.at(row, tile, scorer.coherence(twist.scaled(multiple)))
    best = np.array(_MULTIPLES)[np.argmax(score, axis=0)]
    kept: NDArray[np.bool_] = np.abs(best - 1.0) <= tolerance
    enough = int(kept[tile].sum()) >= max(100, len(events) // 20)
    return kept if enough else np.ones(tiles, np.bool_)
