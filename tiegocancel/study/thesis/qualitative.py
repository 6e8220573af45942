"""Make the pictures of one window: before, predicted, after (Fig. 7.6 and 7.8), and what splatting does to them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import MOVER, NOISE, Events
from tiegocancel.matching.reference import run_reference
from tiegocancel.metrics.raster import raster
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.probe import Bench, measure, stream_of
from tiegocancel.study.thesis.results import share

__all__ = ["Panels", "panels"]


@dataclass(frozen=True, slots=True, eq=False)
class Panels:
    """One point in pictures: ``real`` events of the window, ``residual`` of them.

    ``ahead_x`` ``ahead_y`` float64 and ``ahead_p`` of the predictions that fall due in the window; ``original``,
    ``combined`` and ``left`` signed images: all events, all events with every anti-event, the residual. ``left_over``
    by how much of the absolute signed image stays when the matched pairs are added up as events and anti-events,
    bilinear and nearest: the thesis's equivalence of dropping pairs and adding them (§5.6) would make it 0.
    ``controls``: the share suppressed under zero and reversed motion, and of the mover and of noise where labelled.
    """

    point: Point
    ratio: float
    real: Events
    residual: Events
    ahead_x: NDArray[np.float64]
    ahead_y: NDArray[np.float64]
    ahead_p: NDArray[np.uint8]
    original: NDArray[np.float64]
    combined: NDArray[np.float64]
    left: NDArray[np.float64]
    left_over: dict[str, float]
    controls: dict[str, float]

    def median_count(self, events: Events) -> float:
        """Return the median number of events of a pixel that has any (§7.6)."""
        counts = np.bincount(events.y.astype(np.int64) * events.width + events.x)
        lit = counts[counts > 0]
        return float(np.median(lit)) if len(lit) else 0.0


def panels(bench: Bench, point: Point) -> Panels:
    """Run one point of the reference and keep what its pictures need."""
    events = stream_of(bench, point)
    found = run_reference(events, point.motion_of(bench.motion), point.reference_config())
    window = bench.windows[point.window]
    counted_us = window.start_us
    if not point.isolated:
        counted_us = max(counted_us, int(window.events.t[0]) + point.horizon_us + point.tolerance_us)
    counted: NDArray[np.bool_] = events.t >= counted_us
    due = found.forecast.made & (found.forecast.due_us >= counted_us) & (found.forecast.due_us < window.stop_us)
    real = events.select(counted)
    residual = events.select(counted & ~found.suppressed)
    splat = partial(raster, width=events.width, height=events.height)
    signs = events.p.astype(np.int32) * 2 - 1
    ahead = found.forecast.ahead_x[due], found.forecast.ahead_y[due]
    anti: NDArray[np.int32] = -signs[due]
    original = splat(real.x, real.y, signs[counted])
    match = found.match
    pairs = splat(events.x[match.real], events.y[match.real], signs[match.real])
    left_over = {}
    for name, nearest in (("bilinear", False), ("nearest", True)):
        places = found.forecast.ahead_x[match.source], found.forecast.ahead_y[match.source]
        opposed = splat(*places, -signs[match.source], nearest=nearest)
        left_over[name] = float(np.abs(pairs + opposed).sum() / max(np.abs(pairs).sum(), 1.0))
    return Panels(
        point=point,
        ratio=float(found.suppressed[counted].mean()) if counted.any() else 0.0,
        real=real,
        residual=residual,
        ahead_x=ahead[0],
        ahead_y=ahead[1],
        ahead_p=events.p[due],
        original=original,
        combined=original + splat(*ahead, anti),
        left=splat(residual.x, residual.y, residual.p.astype(np.int32) * 2 - 1),
        left_over=left_over,
        controls=_controls(bench, point, real, found.suppressed[counted]),
    )


def _controls(bench: Bench, point: Point, real: Events, suppressed: NDArray[np.bool_]) -> dict[str, float]:
    """Return what the point suppresses when it is told a wrong motion, and what it takes of what it should leave."""
    controls = {}
    for motion in ("zero", "reversed"):
        row = measure(bench, [point.at(motion=motion).job()])[0]
        controls[f"{motion} motion"] = share(row)
    if real.label is not None:
        for name, label in (("mover", MOVER), ("noise", NOISE)):
            inside = real.label == label
            if inside.any():
                controls[f"the {name}" if name == "mover" else name] = float(suppressed[inside].mean())
    return controls
