"""Find the rigid shift at which predictions and real events coincide, against what chance brings."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.diagnosis.offsets import Pairs, Predictions, Shift, pairs_of

__all__ = ["Coincidence", "Ring", "find_coincidence", "rings_of"]

_Floats = NDArray[np.float64]

_SIGMA_PX = 1.0
_REACH_PX = 6.0
_RIM_PX = 3.5
_LEAST_CONTRAST = 1.4
_FIRST_PREDICTIONS = 30_000
_ROUNDS = 4
_CORE_PX = 1.5
_FLOOR_PX = 0.006
"""What remains of pixels, jitter and movers however many events there are, measured on simulated discs."""
_WIDE_REACH_PX = 10.0
_LARGEST_PX = 7.0
_BIN_PX = 0.5
_BLUR_PX = 1.5
_RINGS = 8
_LEAST_RING_PAIRS = 500
_STEP_PX = 1e-4


class Ring(NamedTuple):
    """Offset of real events from predictions in a ring about the centre of the motion, with one standard deviation.

    ``turning_px`` runs along the ring, positive as x turns towards y: the part that a wrong ω makes, growing with the
    radius. ``right_px`` and ``down_px`` are the same all round: the part that a wrong centre makes.
    """

    radius_px: float
    turning_px: float
    right_px: float
    down_px: float
    turning_sigma_px: float
    flat_sigma_px: float


class Coincidence(NamedTuple):
    """The ``shift`` at the peak, and how high the peak stands.

    ``covariance`` float64[3, 3] of turn (rad) and move (px). ``kept_share``: share of the predictions in tiles that
    have a peak there; ``met_share``: share of the predictions that meet a real event there, beyond chance.
    ``contrast``: density of real events at the peak over that around it, in the tiles kept. ``is_peak``: it falls off
    to all sides, so that the covariance means something. ``pairs`` of the tiles kept, with what the shift leaves of
    their offsets.
    """

    shift: Shift
    covariance: _Floats
    kept_share: float
    met_share: float
    contrast: float
    is_peak: bool
    pairs: Pairs


class _Peak(NamedTuple):
    """Turn (in px at the typical radius) and move at a peak, float64[3], and the covariance of these."""

    point: _Floats
    covariance: _Floats
    is_peak: bool


def find_coincidence(predictions: Predictions) -> Coincidence:
    """Search the shift on a grid, then climb, each time on the tiles alone that have a peak there.

    A hand or a still background has its own peak elsewhere, or none: its tiles would only pull.
    """
    every = max(predictions.count // _FIRST_PREDICTIONS, 1)
    shift = _coarse(predictions, every)
    radius = predictions.radius_px
    for number in range(_ROUNDS):
        pairs = pairs_of(predictions, shift, _REACH_PX, every=every)
        good = pairs.select(_kept(pairs)[0]) if number else pairs
        shift = shift.then(_as_shift(_climb(good, radius).point, radius))
    pairs = pairs_of(predictions, shift, _REACH_PX)
    chosen, contrast, share = _kept(pairs)
    kept = pairs.select(chosen)
    peak = _climb(kept, radius)
    dx, dy = _misses(kept, peak.point, radius)
    scale = np.array([1.0 / radius, 1.0, 1.0])
    return Coincidence(
        shift=shift.then(_as_shift(peak.point, radius)),
        covariance=peak.covariance * np.outer(scale, scale),
        kept_share=share,
        met_share=_met(kept) / max(predictions.count, 1),
        contrast=contrast,
        is_peak=peak.is_peak,
        pairs=kept._replace(dx=dx, dy=dy),
    )


def rings_of(found: Coincidence, predictions: Predictions) -> tuple[Ring, ...]:
    """Fit turn and move of each of eight rings about the centre by itself: what one shift of all should explain."""
    center = np.subtract(predictions.center_px, predictions.anchor_px)
    base = np.subtract(found.shift.applied(*center), center)
    places = np.hypot(found.pairs.right - center[0], found.pairs.down - center[1])
    if not len(places):
        return ()
    edges = np.linspace(float(places.min()), float(np.quantile(places, 0.99)), _RINGS + 1)
    rings = []
    for inner, outer in pairwise(edges):
        inside = (places >= inner) & (places < outer)
        if np.count_nonzero(inside) < _LEAST_RING_PAIRS:
            continue
        ring = found.pairs.select(inside)
        about = ring._replace(right=ring.right - center[0], down=ring.down - center[1])
        radius = float(np.mean(places[inside]))
        peak = _climb(about, radius)
        if not peak.is_peak or np.abs(peak.point).max() > _CORE_PX:
            continue
        turning, right, down = np.add(peak.point, (found.shift.turn_rad * radius, *base))
        spread = np.sqrt(np.diag(peak.covariance))
        rings.append(Ring(radius, float(turning), float(right), float(down), float(spread[0]), float(spread[1:].max())))
    return tuple(rings)


def _coarse(predictions: Predictions, every: int) -> Shift:
    """Return the best of a grid of shifts, 7 px at most each way, by the correlogram of offsets of every tile."""
    from scipy.ndimage import gaussian_filter

    pairs = pairs_of(predictions, Shift(), _WIDE_REACH_PX, every=every)
    if not len(pairs.dx):
        return Shift()
    side = round(2 * _WIDE_REACH_PX / _BIN_PX)
    weight = np.bincount(pairs.tile)
    column, row = (_bins(offset, side) for offset in (pairs.dx, pairs.dy))
    counts = np.bincount((pairs.tile * side + row) * side + column, minlength=len(weight) * side * side)
    blur = _BLUR_PX / _BIN_PX
    density = gaussian_filter(counts.reshape(-1, side, side).astype(np.float64), (0.0, blur, blur))
    # Chance is alike at every offset: without it, a tile whose offset leaves the window neither gains nor loses.
    density -= (weight / (math.pi * (_WIDE_REACH_PX / _BIN_PX) ** 2))[:, None, None]
    steps = np.arange(-_LARGEST_PX, _LARGEST_PX + 1.0)
    turn, right, down = (axis.ravel() for axis in np.meshgrid(steps / predictions.radius_px, steps, steps))
    score = np.zeros(len(turn))
    for tile, middle in enumerate(np.column_stack([np.bincount(pairs.tile, at) for at in (pairs.right, pairs.down)])):
        x, y = middle / weight[tile]
        off_x = right + (np.cos(turn) - 1.0) * x - np.sin(turn) * y
        off_y = down + (np.cos(turn) - 1.0) * y + np.sin(turn) * x
        inside = np.hypot(off_x, off_y) <= _WIDE_REACH_PX - _BLUR_PX
        score[inside] += density[tile, _bins(off_y[inside], side), _bins(off_x[inside], side)]
    best = int(np.argmax(score))
    return Shift(float(turn[best]), float(right[best]), float(down[best]))


def _bins(offset: _Floats, side: int) -> NDArray[np.int64]:
    """Return the cell of the correlogram that each offset in px lies in."""
    return np.minimum(((offset + _WIDE_REACH_PX) / _BIN_PX).astype(np.int64), side - 1)


def _kept(pairs: Pairs) -> tuple[NDArray[np.bool_], float, float]:
    """Mark the pairs in tiles with a peak at no offset, bool[n]; return their contrast and share of predictions too.

    The choice is made by tile and not by pair, or the fit would confirm itself on the pairs it likes.
    """
    if not len(pairs.dx):
        return np.zeros(0, np.bool_), 1.0, 0.0
    squared = pairs.dx**2 + pairs.dy**2
    core = np.bincount(pairs.tile, np.exp(-0.5 * squared / _SIGMA_PX**2))
    around = np.bincount(pairs.tile, squared > _RIM_PX**2) * (2.0 * _SIGMA_PX**2 / (_REACH_PX**2 - _RIM_PX**2))
    # Σ of squared weights is half of Σ of weights: the variance of what chance brings. One pair at least is expected.
    chance = around + 1.0
    good = (core > _LEAST_CONTRAST * chance) & (core - chance > 3.0 * np.sqrt(0.5 * chance))
    made = np.bincount(pairs.tile[np.unique(pairs.made, return_index=True)[1]], minlength=len(core))
    contrast = float(core[good].sum() / chance[good].sum()) if good.any() else 1.0
    return good[pairs.tile], contrast, float(made[good].sum() / made.sum())


def _met(pairs: Pairs) -> float:
    """Return how many predictions meet a real event within 1.5 px, less those that chance lets meet one."""
    if not len(pairs.dx):
        return 0.0
    distance = np.hypot(pairs.dx, pairs.dy)
    predictions = len(np.unique(pairs.made))
    around = np.count_nonzero(distance > _RIM_PX) / predictions
    by_chance = 1.0 - math.exp(-around * _CORE_PX**2 / (_REACH_PX**2 - _RIM_PX**2))
    return max(len(np.unique(pairs.made[distance <= _CORE_PX])) - predictions * by_chance, 0.0)


def _climb(pairs: Pairs, radius_px: float, *, rounds: int = 40) -> _Peak:
    """Climb to the mode of the offsets about the model ``φ·J·u + s`` (``J`` a quarter turn, ``u`` the place).

    Every pair counts with a Gaussian of 1 px about the model, so that evenly spread chance does not pull. Newton's
    method where the peak is round, mean shift elsewhere. The covariance is the sandwich of curvature and scores summed
    by cluster: the events of one edge are not independent.
    """
    point = np.zeros(3)
    if not len(pairs.dx):
        return _Peak(point, np.full((3, 3), np.inf), False)
    height, scores, curvature, round_peak = _slopes(pairs, point, radius_px)
    for _ in range(rounds):
        step = np.linalg.lstsq(curvature, scores.sum(axis=1), rcond=None)[0]
        step /= max(float(np.abs(step).max()), 1.0)
        while float(np.abs(step).max()) >= _STEP_PX:
            slopes = _slopes(pairs, point + step, radius_px)
            if slopes[0] > height:
                break
            step /= 2.0  # a full step of Newton's method may leap over the peak, and back again for ever
        else:
            break
        point = point + step
        height, scores, curvature, round_peak = slopes
    sums = np.stack([np.bincount(pairs.cluster, score) for score in scores])
    inverse = np.linalg.pinv(curvature)
    return _Peak(point, inverse @ (sums @ sums.T) @ inverse + _FLOOR_PX**2 * np.eye(3), round_peak)


def _slopes(pairs: Pairs, point: _Floats, radius_px: float) -> tuple[float, _Floats, _Floats, bool]:
    """Return the height, each pair's score float64[3, n], the curvature to step with, whether it is that of a peak."""
    miss_x, miss_y = _misses(pairs, point, radius_px)
    weight = np.exp(-0.5 * (miss_x**2 + miss_y**2) / _SIGMA_PX**2)
    across, along = -pairs.down / radius_px, pairs.right / radius_px
    slopes = np.stack([across * miss_x + along * miss_y, miss_x, miss_y])
    scores = weight * slopes
    turns, cross_x, cross_y = (float(weight @ part) for part in (across**2 + along**2, across, along))
    total = float(weight.sum())
    metric = np.array([[turns, cross_x, cross_y], [cross_x, total, 0.0], [cross_y, 0.0, total]])
    curvature = metric - scores @ slopes.T / _SIGMA_PX**2
    round_peak = float(np.linalg.eigvalsh(curvature)[0]) > 1e-3 * total
    return total, scores, curvature if round_peak else metric, round_peak


def _misses(pairs: Pairs, point: _Floats, radius_px: float) -> tuple[_Floats, _Floats]:
    """Return what the model leaves of the offsets."""
    turn = point[0] / radius_px
    return pairs.dx - point[1] + turn * pairs.down, pairs.dy - point[2] - turn * pairs.right


def _as_shift(point: _Floats, radius_px: float) -> Shift:
    return Shift(float(point[0]) / radius_px, float(point[1]), float(point[2]))
