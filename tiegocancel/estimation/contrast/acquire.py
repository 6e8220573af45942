"""Find a motion that is not where it was expected: about the centre known last, or with no knowledge at all."""

from __future__ import annotations

import math

import numpy as np

from tiegocancel.estimation.contrast.ascent import Ascent, ascend
from tiegocancel.estimation.contrast.scorer import Contrast, Twist
from tiegocancel.estimation.contrast.search import search
from tiegocancel.estimation.contrast.thinning import thinned
from tiegocancel.estimation.contrast.window import Window

__all__ = ["COARSE_CELLS", "FINE_CELLS", "SMALL_SUPPORT", "hunted", "scanned"]

COARSE_CELLS, FINE_CELLS = (8.0, 4.0, 2.0), (2.0,)
SMALL_SUPPORT = 16.0
"""A motion that fewer tiles share may be that of one object."""

_SCAN_EVENTS = 4_000
_SCAN_CELL_BITS = 3
_FEWEST_REST = 300
_STARTS = 3


def scanned(
    window: Window, center_px: tuple[float, float], max_omega_rad_s: float, rng: np.random.Generator
) -> list[Ascent]:
    """Climb from the best of every ω about a centre; return the peaks."""
    few = thinned(window.events, _SCAN_EVENTS, rng)
    scorer = Contrast(few, anchor_px=window.anchor_px, cell_bits=_SCAN_CELL_BITS, signed=True, slots=64)
    # From one ω to the next the events move by one and a half cells against each other.
    step = 1.5 * (1 << _SCAN_CELL_BITS) / (max(window.radius_px, 8.0) * window.half_s)
    count = min(int(min(max_omega_rad_s, math.pi / window.half_s) / step), 400)
    twists = [Twist.about(center_px, k * step, window.anchor_px) for k in range(-count, count + 1)]
    best = np.argsort(-scorer.gain(twists), kind="stable")[:_STARTS]
    return [ascend(window, twists[int(index)], cells_px=COARSE_CELLS) for index in best]


def hunted(window: Window, max_omega_rad_s: float, rng: np.random.Generator) -> list[Ascent]:
    """Search the motion from scratch; return the peaks.

    Contrast counts pairs, and a small dense object may have more of them than a whole sparse background: where the
    first find covers few tiles, the events outside of it are searched for another.
    """
    peaks = [ascend(window, twist, cells_px=COARSE_CELLS) for twist in _starts(window, max_omega_rad_s, rng)]
    if peaks and peaks[-1].support < SMALL_SUPPORT:
        # The window's last image is that of the last climb, and so are the tiles.
        outside = window.events.select(~window.within(peaks[-1].agreeing))
        if len(outside) >= _FEWEST_REST and outside.span_us > 1:
            rest = window.of(outside)
            for twist in _starts(rest, max_omega_rad_s, rng):
                second = ascend(rest, twist, cells_px=COARSE_CELLS)
                peaks.append(ascend(window, second.twist, cells_px=FINE_CELLS))
    return peaks


def _starts(window: Window, max_omega_rad_s: float, rng: np.random.Generator) -> list[Twist]:
    """Search a window; return its best motion, if any."""
    found = search(window.events, anchor_px=window.anchor_px, max_omega_rad_s=max_omega_rad_s, signed=True, rng=rng)
    return [twist for _, twist in found[:1]]
