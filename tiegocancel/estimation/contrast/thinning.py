"""Draw some of the events of a window."""

from __future__ import annotations

import numpy as np

from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.events import Events

__all__ = ["thinned", "thinned_by_place"]

_BLOCK_PX = 32.0
_FEWEST_BLOCKS = 16


def thinned(events: Events, most: int, rng: np.random.Generator) -> Events:
    """Return at most ``most`` events, drawn at random over the whole of them and kept in order."""
    if len(events) <= most:
        return events
    mask = np.zeros(len(events), np.bool_)
    mask[rng.choice(len(events), most, replace=False)] = True
    return events.select(mask)


def thinned_by_place(
    events: Events,
    motion: Twist,
    anchor_px: tuple[float, float],
    middle_us: int,
    most: int,
    rng: np.random.Generator,
) -> Events:
    """Return about ``most`` events, all those of some places that move with ``motion``, in order.

    Drawing single events keeps a share f of them and f² of the pairs that an estimate rests on; drawing squares of 32
    px, as they lie in the middle of the window, keeps f of the pairs. Where too few squares would be left, single
    events are drawn all the same.
    """
    if len(events) <= most:
        return events
    omega = motion.omega_rad_s
    elapsed = (events.t - middle_us).astype(np.float32) * np.float32(1e-6)
    x = events.x.astype(np.float32) - np.float32(anchor_px[0])
    y = events.y.astype(np.float32) - np.float32(anchor_px[1])
    sine, cosine = np.sin(-omega * elapsed), np.cos(-omega * elapsed)
    # To first order along the translation: a place needs to be followed within a few px only.
    column = cosine * x - sine * y - np.float32(motion.vx_px_s) * elapsed
    row = sine * x + cosine * y - np.float32(motion.vy_px_s) * elapsed
    block_x = np.floor(column / _BLOCK_PX).astype(np.int32)
    block_y = np.floor(row / _BLOCK_PX).astype(np.int32)
    block_x -= block_x.min()
    block_y -= block_y.min()
    wide = int(block_x.max()) + 1
    block = block_y * wide + block_x
    held = np.bincount(block).astype(np.float64)
    if float(len(events)) ** 2 < _FEWEST_BLOCKS * float(held @ held) * len(events) / most:
        return thinned(events, most, rng)
    order = rng.permutation(len(held))
    reached = np.cumsum(held[order])
    chosen = np.zeros(len(held), np.bool_)
    chosen[order[: int(np.searchsorted(reached, most, side="left")) + 1]] = True
    return events.select(chosen[block])
