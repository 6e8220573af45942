"""Refine the rotation of one window from a rough start to the peak of its contrast."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tiegocancel.estimation.contrast.ascent import ascend
from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.window import Window
from tiegocancel.events import Events

__all__ = ["WindowFit", "refine"]

_CELLS_PX = (8.0, 4.0, 2.0, 1.0)
_LARGE_SIDE_PX = 400
_SLOTS = 4096


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowFit:
    """The rotation of one window as a twist, and how far to trust it.

    ``contrast_gain`` is the contrast it brings over that at rest, ``correlation`` that of early and late events,
    ``kept_share`` the share of events in tiles that agree, ``omega_sigma_rad_s`` one standard deviation of ω;
    ``converged``: it is a peak.
    """

    start_us: int
    stop_us: int
    events_used: int
    twist: Twist
    contrast_gain: float
    correlation: float
    kept_share: float
    omega_sigma_rad_s: float
    converged: bool


def refine(events: Events, twist: Twist, *, anchor_px: tuple[float, float], signed: bool) -> WindowFit:
    """Climb to the peak near ``twist``, which is one at ``anchor_px`` as is the result."""
    start_us, stop_us = int(events.t[0]), int(events.t[-1]) + 1
    middle = (float(events.x.mean()), float(events.y.mean()))
    window = Window(events, start_us=start_us, stop_us=stop_us, anchor_px=middle, signed=signed, slots=_SLOTS)
    # On small sensors and in short windows the finest cells resolve what the coarser ones blur.
    cells = _CELLS_PX if max(events.width, events.height) > _LARGE_SIDE_PX else _CELLS_PX[1:]
    peak = ascend(window, twist.seen_from(anchor_px, middle), cells_px=cells, most_steps=12)
    return WindowFit(
        start_us=start_us,
        stop_us=stop_us,
        events_used=len(events),
        twist=peak.twist.seen_from(middle, anchor_px),
        contrast_gain=peak.gain,
        correlation=peak.correlation,
        kept_share=peak.kept_share,
        omega_sigma_rad_s=math.sqrt(max(float(peak.covariance[2, 2]), 0.0)),
        converged=peak.converged,
    )
