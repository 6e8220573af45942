"""Find the rotation of one window of events: a coarse search over centre and ω, then refinement at finer cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.contrast.scorer import MAX_CELL_BITS, Contrast, Twist, fine_cell_bits
from tiegocancel.estimation.contrast.thinning import thinned
from tiegocancel.events import Events

__all__ = ["polish", "search"]

_LARGEST_TURN_RAD = 0.5
"""Candidates about unknown centres turn by this much at most: beyond it the centre would have to be known well."""
_SHORTEST_US = 2_500
_FEWEST = 1_000
_EVENTS = 10_000
_SLOTS = 256
_LARGE_SIDE_PX = 400
_GRID = (-0.25, 0.125, 0.5, 0.875, 1.25)
_SURVIVORS = 2
_POOL = 4


def search(
    events: Events,
    *,
    anchor_px: tuple[float, float],
    max_omega_rad_s: float,
    signed: bool,
    rng: np.random.Generator,
) -> list[tuple[float, Twist]]:
    """Return ``(gain over the whole window, twist)`` of candidate rotations, best first, found from scratch.

    The search begins in the shortest middle of the window, because a fast rotation about an unknown centre looks
    simple only for a short time. What is found there is carried to longer and longer middles, up to the whole window;
    each adds the best of its own grid.
    """
    cell_bits = fine_cell_bits(events)
    if max(events.width, events.height) > _LARGE_SIDE_PX:
        cell_bits = min(cell_bits + 1, MAX_CELL_BITS)
    parts = [thinned(part, _EVENTS, rng) for part in _middles(events)]
    scorers = [Contrast(part, anchor_px=anchor_px, cell_bits=cell_bits, signed=signed, slots=_SLOTS) for part in parts]
    pool: list[tuple[float, Twist]] = []
    for part, scorer in reversed(list(zip(parts, scorers, strict=True))):
        twists = _grid(part, scorer, max_omega_rad_s)
        best = np.argsort(-scorer.gain(twists), kind="stable")[:_SURVIVORS]
        starts = [twist for _, twist in pool] + [twists[int(index)] for index in best]
        pool = []
        for start in starts:
            twist, gain = polish(start, scorer, max_omega_rad_s, evaluations=50)
            if not any(scorer.distance_px(twist, other) < 1 << cell_bits for _, other in pool):
                pool.append((gain, twist))
        pool = sorted(pool, key=lambda pair: -pair[0])[:_POOL]
    return pool


def polish(
    twist: Twist, scorer: Contrast, max_omega_rad_s: float, *, evaluations: int, step_cells: float = 1.0
) -> tuple[Twist, float]:
    """Climb to the nearest peak of contrast; return the twist and its gain.

    With a bound of 0 on ω only ``v`` varies. The simplex works in px of displacement over the window, so that one
    step means the same in ``v`` and in ω.
    """
    from scipy.optimize import minimize

    step = np.array([1.0, 1.0, 1.0 / scorer.radius_px]) / scorer.span_s
    start = np.array(twist) / step

    def loss(point: NDArray[np.float64]) -> float:
        vx, vy, omega = (np.append(point, 0.0)[:3] * step).tolist()
        if abs(omega) > max_omega_rad_s:
            return 0.0
        return -float(scorer.gain([Twist(vx, vy, omega)])[0])

    side = step_cells * (1 << scorer.cell_bits)
    axes = 3 if max_omega_rad_s else 2
    simplex = start[:axes] + side * np.vstack([np.zeros(axes), np.eye(axes)])
    best = minimize(
        loss,
        start[:axes],
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": evaluations, "xatol": 0.01, "fatol": 1e-6},
    )
    vx, vy, omega = (np.append(best.x, 0.0)[:3] * step).tolist()
    return Twist(vx, vy, omega), -float(best.fun)


def _middles(events: Events) -> list[Events]:
    """Return the whole window, then its middle half, quarter … while time and events suffice."""
    parts = [events]
    start, stop = int(events.t[0]), int(events.t[-1]) + 1
    while True:
        quarter = (stop - start) // 4
        start, stop = start + quarter, stop - quarter
        part = events.between(start, stop)
        if stop - start < _SHORTEST_US or len(part) < _FEWEST or part.span_us == 0:
            return parts
        parts.append(part)


def _grid(events: Events, scorer: Contrast, max_omega_rad_s: float) -> list[Twist]:
    """Return twists about the centroid and the image's middle at any ω, and about a coarse grid up to half a radian.

    The step of ω moves the events at their typical distance by one and a half cells from the middle to an end of the
    window, so that no peak falls between two candidates.
    """
    width, height = float(events.width), float(events.height)
    centroid = (float(events.x.mean()), float(events.y.mean()))
    near = {centroid, (0.5 * width, 0.5 * height)}
    grid = [(width * right, height * down) for down in _GRID for right in _GRID]
    twists = [Twist(0.0, 0.0, 0.0)]
    for center in [*sorted(near), *(center for center in grid if center not in near)]:
        limit = max_omega_rad_s
        if center not in near:
            limit = min(limit, _LARGEST_TURN_RAD / scorer.span_s)
        radius = float(np.sqrt(np.mean((events.x - center[0]) ** 2 + (events.y - center[1]) ** 2)))
        step = 3.0 * (1 << scorer.cell_bits) / (max(radius, 1.0) * scorer.span_s)
        count = int(limit / step)
        twists += [Twist.about(center, k * step, scorer.anchor_px) for k in range(-count, count + 1) if k != 0]
    return twists
