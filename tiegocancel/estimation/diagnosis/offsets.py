"""Pair predictions with every real event around them: the offsets tell where the motion was wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.motion.rotation import RotationTrajectory

__all__ = ["LEAST_MOTION_PX", "Pairs", "Predictions", "Shift", "pairs_of", "predictions_of"]

LEAST_MOTION_PX = 2.5
"""Predictions nearer than this to the event they come from are left out: a pixel that fires again would answer them."""

_Floats = NDArray[np.float64]
_SLIDE_PX = 2.0
_TILES = 100
_SMALLEST_TILE_PX = 16.0
_STRETCHES = 8


class Shift(NamedTuple):
    """A rigid motion of the picture: a turn about an anchor in rad, then a move in px."""

    turn_rad: float = 0.0
    right_px: float = 0.0
    down_px: float = 0.0

    def then(self, other: Shift) -> Shift:
        """Return this shift followed by another about the same anchor."""
        cosine, sine = math.cos(other.turn_rad), math.sin(other.turn_rad)
        return Shift(
            self.turn_rad + other.turn_rad,
            cosine * self.right_px - sine * self.down_px + other.right_px,
            sine * self.right_px + cosine * self.down_px + other.down_px,
        )

    def applied(self, right: _Floats, down: _Floats) -> tuple[_Floats, _Floats]:
        """Move points that are given relative to the anchor, float64[n] each."""
        cosine, sine = math.cos(self.turn_rad), math.sin(self.turn_rad)
        return cosine * right - sine * down + self.right_px, sine * right + cosine * down + self.down_px


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Predictions:
    """Where the events of a few stretches are expected one horizon later, and the real events around that time.

    ``groups``: for each stretch and polarity the predictions float64[n, 6] ``x y cx cy ω t`` and the real events
    float64[m, 3] ``x y t`` (px from ``anchor_px``, rad/s, µs since the stretch began). ``gate_us`` is how early or
    late a real event may be. ``turn_rad`` and ``center_px`` (image) are means of the motion over the predictions;
    ``radius_px`` is their typical distance from the anchor; ``tile_px`` the side of a neighbourhood.
    """

    groups: tuple[tuple[_Floats, _Floats], ...]
    anchor_px: tuple[float, float]
    center_px: tuple[float, float]
    turn_rad: float
    radius_px: float
    tile_px: float
    gate_us: int
    span_us: tuple[int, int]

    @property
    def count(self) -> int:
        """Number of predictions."""
        return sum(len(made) for made, _ in self.groups)


class Pairs(NamedTuple):
    """Real events near a prediction: place of the prediction and offset of the event from it, float64[n] px each.

    Places are relative to the anchor. ``tile`` and ``cluster`` int64[n] number neighbourhoods in space, and in space
    and time: the pairs of one stand or fall together. ``made`` int64[n] numbers the predictions.
    """

    right: _Floats
    down: _Floats
    dx: _Floats
    dy: _Floats
    tile: NDArray[np.int64]
    cluster: NDArray[np.int64]
    made: NDArray[np.int64]

    def select(self, mask: NDArray[np.bool_]) -> Pairs:
        """Return the pairs where ``mask`` bool[n] is true."""
        right, down, dx, dy, tile, cluster, made = self
        return Pairs(right[mask], down[mask], dx[mask], dy[mask], tile[mask], cluster[mask], made[mask])


def predictions_of(
    events: Events, trajectory: RotationTrajectory, horizon_us: int, gate_us: int, *, max_events: int, seed: int
) -> Predictions | None:
    """Predict the events of stretches spread over a recording; ``None`` where nothing moves far enough to tell.

    The gate is narrowed where most edges would pass more than 2 px within it, and to half the horizon, so that no
    event is paired with itself.
    """
    usable = int(np.searchsorted(events.t, int(events.t[-1]) - horizon_us, side="right")) if len(events) else 0
    if horizon_us < 2 or usable < 1:
        return None
    parts = [events[first:stop] for first, stop in _spread(usable, max_events, np.random.default_rng(seed))]
    whole = Events.concatenate(parts)
    begin_us = np.repeat([part.t[0] for part in parts], [len(part) for part in parts])
    cx, cy, theta = trajectory.turns(whole.t, horizon_us)
    right, down = whole.x - cx, whole.y - cy
    way_px = 2.0 * np.abs(np.sin(0.5 * theta)) * np.hypot(right, down)
    far = way_px >= LEAST_MOTION_PX
    if not far.any():
        return None
    ahead_x = cx + np.cos(theta) * right - np.sin(theta) * down
    ahead_y = cy + np.sin(theta) * right + np.cos(theta) * down
    anchor = (float(ahead_x[far].mean()), float(ahead_y[far].mean()))
    columns = np.column_stack(
        [
            ahead_x - anchor[0],
            ahead_y - anchor[1],
            cx - anchor[0],
            cy - anchor[1],
            theta / (horizon_us * 1e-6),
            (whole.t - begin_us + horizon_us).astype(np.float64),
        ]
    )
    widest_us = int(_SLIDE_PX / float(np.quantile(way_px[far], 0.95)) * horizon_us)
    gate = max(min(gate_us, horizon_us // 2, widest_us), 1)
    groups: list[tuple[_Floats, _Floats]] = []
    start = 0
    for part in parts:
        stop = start + len(part)
        due_us = int(part.t[0]) + horizon_us
        real = events.between(due_us - gate, int(part.t[-1]) + horizon_us + gate + 1)
        since_us = (real.t - part.t[0]).astype(np.float64)
        rows = np.column_stack([real.x - anchor[0], real.y - anchor[1], since_us])
        groups += [(columns[start:stop][far[start:stop] & (part.p == sign)], rows[real.p == sign]) for sign in (0, 1)]
        start = stop
    distance = np.hypot(columns[far, 0], columns[far, 1])
    return Predictions(
        groups=tuple(groups),
        anchor_px=anchor,
        center_px=(float(cx[far].mean()), float(cy[far].mean())),
        turn_rad=float(theta[far].mean()),
        radius_px=max(float(np.sqrt(np.mean(distance**2))), 1.0),
        tile_px=max(_SMALLEST_TILE_PX, 2.0 * float(np.quantile(distance, 0.98)) / math.sqrt(_TILES)),
        gate_us=gate,
        span_us=(int(whole.t[0]), int(whole.t[-1])),
    )


def pairs_of(predictions: Predictions, shift: Shift, reach_px: float, *, every: int = 1) -> Pairs:
    """Pair every prediction, moved by ``shift``, with all real events of its polarity within ``reach_px``.

    A real event that is late by ``τ`` is compared with the prediction turned on by ``ω·τ``: the gate in time costs no
    sharpness. Only one in ``every`` predictions takes part.
    """
    from scipy.spatial import cKDTree

    found = [np.zeros((0, 6))]
    box = reach_px + _SLIDE_PX + 1.0
    scale = box / predictions.gate_us
    before = 0
    for index, (whole, real) in enumerate(predictions.groups):
        made = whole[::every]
        first, before = before, before + len(made)
        if not len(made) or not len(real):
            continue
        at = np.column_stack([*shift.applied(made[:, 0], made[:, 1]), made[:, 5] * scale])
        around = cKDTree(np.column_stack([real[:, 0], real[:, 1], real[:, 2] * scale]))
        met = cKDTree(at).sparse_distance_matrix(around, box * (1.0 + 1e-9), p=np.inf, output_type="ndarray")
        x, y, cx, cy, omega, due = made[met["i"]].T
        on = omega * ((real[met["j"], 2] - due) * 1e-6)
        turned_x = cx + np.cos(on) * (x - cx) - np.sin(on) * (y - cy)
        turned_y = cy + np.sin(on) * (x - cx) + np.cos(on) * (y - cy)
        right, down = shift.applied(turned_x, turned_y)
        dx, dy = real[met["j"], 0] - right, real[met["j"], 1] - down
        rows = np.column_stack([right, down, dx, dy, np.full(len(dx), index // 2), met["i"] + first])
        found.append(rows[dx**2 + dy**2 <= reach_px**2])
    right, down, dx, dy, stretch, number = np.concatenate(found).T
    across, along = (np.floor(place / predictions.tile_px).astype(np.int64) for place in (right, down))
    tile = _numbered(across, along)
    cluster = _numbered(tile, stretch.astype(np.int64))
    return Pairs(right, down, dx, dy, tile, cluster, number.astype(np.int64))


def _numbered(one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number the distinct pairs of two columns from 0 on."""
    if not len(one):
        return np.zeros(0, np.int64)
    key = (one - one.min()) * (int(other.max() - other.min()) + 1) + other - other.min()
    number: NDArray[np.int64] = np.unique(key, return_inverse=True)[1].reshape(-1).astype(np.int64)
    return number


def _spread(usable: int, most: int, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Cut stretches that hold ``most`` of the first ``usable`` events, each at a random place of its part."""
    count = min(_STRETCHES, usable)
    length = min(most, usable) // count
    edges = np.linspace(0, usable, count + 1).astype(np.int64).tolist()
    if usable <= most:
        return list(pairwise(edges))
    starts = [int(rng.integers(a, max(b - length, a) + 1)) for a, b in pairwise(edges)]
    return [(start, start + length) for start in starts]
