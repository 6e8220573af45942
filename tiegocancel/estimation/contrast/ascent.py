"""Climb to the nearest peak of contrast by Newton's method, trusting the tiles of the sensor that agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.window import Rates, Slopes, Window, unfolded

__all__ = ["Ascent", "ascend", "rates_of", "twist_of"]

_ROTATION = np.array([[0, 0, 0], [0, 0, -1], [1, 0, 0], [0, 0, 1], [0, 0, 0], [0, 1, 0]], np.float64)
"""Columns: the rates of ``vx``, ``vy`` and ``ω``."""
_CLOSE_CELLS = 0.01
_STRIDE_CELLS = 1.5
_OUTLIER_PX = 0.6
_FEWEST_TILES = 16
_BURST = 100.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Ascent:
    """The peak that a climb ended on: ``twist`` at the window's anchor and its covariance [3, 3] over (vx, vy, ω).

    ``gain`` is the contrast there over that at rest, ``correlation`` that of the early and the late half's images;
    ``kept_share`` the share of events in tiles that agree, ``agreeing`` those tiles (:meth:`Window.within`) and
    ``support`` their effective number: how much of the image moves so. ``converged``: the last step was small and the
    curvature is that of a peak.
    """

    twist: Twist
    covariance: NDArray[np.float64]
    gain: float
    correlation: float
    kept_share: float
    agreeing: NDArray[np.int64]
    support: float
    converged: bool


def rates_of(twist: Twist) -> Rates:
    """Return the rates ``a b c d e f`` of a twist about its anchor."""
    return _ROTATION @ np.array(twist, np.float64)


def twist_of(rates: Rates) -> Twist:
    """Return the twist of a velocity field's rotation and translation."""
    return Twist(float(rates[2]), float(rates[5]), float(rates[3]))


def ascend(
    window: Window, start: Twist, *, cells_px: tuple[float, ...] = (2.0,), most_steps: int = 8, robust: bool = True
) -> Ascent:
    """Climb from ``start``, first in the largest cells: a peak is found within about two cells of displacement.

    Newton's steps on the exact slopes of the contrast. With ``robust`` each tile is weighted by how far its own peak
    lies from the common one (Geman–McClure at 0.6 px), and a tile without a peak of its own is left out: a mover or
    flicker loses its say. The covariance is the sandwich of the curvature and the spread of the slopes over tiles
    (clusters), because the events of one edge are not independent.
    """
    units = np.array([window.units[2], window.units[5], window.units[3]])
    basis = _ROTATION
    point = np.array(start, np.float64) / units
    near = False
    for cell in cells_px:
        for _ in range(most_steps):
            slopes = window.slopes(rates_of(Twist(*(point * units).tolist())), cell)
            if not len(slopes.events):
                return _nowhere(start)
            bend = _Bend.of(slopes)
            weight = _agreement(slopes, bend) if robust else np.ones(len(slopes.events))
            slope = basis.T @ (weight @ slopes.slope)
            curvature = basis.T @ unfolded(weight @ slopes.bends) @ basis
            step = _step(slope, curvature)
            length = float(np.abs(step).max())
            near = length <= (_CLOSE_CELLS if cell == cells_px[-1] else 0.1) * cell
            point = point + step * (_STRIDE_CELLS * cell / max(length, _STRIDE_CELLS * cell))
            if near:
                break
    twist = Twist(*(point * units).tolist())
    peaked = bool((np.linalg.eigvalsh(curvature) < 0.0).all())
    gain, correlation = window.sharpness()
    support = _effective(weight * bend.strength)
    return Ascent(
        twist=twist,
        covariance=_covariance(slopes, weight, curvature, support) * np.outer(units, units),
        gain=gain,
        correlation=correlation,
        kept_share=float(weight @ slopes.events / slopes.events.sum()),
        agreeing=slopes.tile[(weight > 0.3) & (bend.strength > 0.0)],
        support=support,
        converged=near and peaked,
    )


def _nowhere(start: Twist) -> Ascent:
    """Return the outcome of a climb that carried every event out of the image."""
    return Ascent(
        twist=start,
        covariance=np.full((3, 3), np.inf),
        gain=0.0,
        correlation=0.0,
        kept_share=0.0,
        agreeing=np.zeros(0, np.int64),
        support=0.0,
        converged=False,
    )


def _step(slope: NDArray[np.float64], curvature: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Newton's step, uphill along every axis even where the curvature is not that of a peak."""
    value, axis = np.linalg.eigh(curvature)
    steep = np.maximum(np.abs(value), max(1e-9 * float(np.abs(value).max()), 1e-30))
    step: NDArray[np.float64] = axis @ ((axis.T @ slope) / steep)
    return step


@dataclass(frozen=True, slots=True, eq=False)
class _Bend:
    """How each tile's agreement bends along a pan: the two curvatures float64[T], the lesser first, and their axes.

    ``sharp`` is the curvature across the tile's edges, ``blunt`` that along them; the axis of ``sharp`` is
    ``(−sine, cosine)`` and that of ``blunt`` ``(cosine, sine)``. In closed form: a library call a tile costs more.
    """

    sharp: NDArray[np.float64]
    blunt: NDArray[np.float64]
    cosine: NDArray[np.float64]
    sine: NDArray[np.float64]

    @classmethod
    def of(cls, slopes: Slopes) -> _Bend:
        """Take the eigenvalues and axes of the symmetric 2 × 2 curvature along ``c`` and ``f``."""
        xx, xy, yy = slopes.pan_curvature
        mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
        radius = np.hypot(half, xy)
        angle = 0.5 * np.arctan2(xy, half)
        return cls(mean - radius, mean + radius, np.cos(angle), np.sin(angle))

    @property
    def strength(self) -> NDArray[np.float64]:
        """How sharply each tile's agreement bends across its edges, float64[T]; 0 where it has no peak."""
        strength: NDArray[np.float64] = np.maximum(-self.sharp, 0.0)
        return strength


def _agreement(slopes: Slopes, bend: _Bend) -> NDArray[np.float64]:
    """Weigh each tile by the displacement, px a half window, at which its own agreement would peak, float64[T].

    All count alike where a few tiles hold nearly everything: parts of one object pull in different directions, and
    only together they say how it moves.
    """
    strength = bend.strength
    if _effective(strength) < _FEWEST_TILES:
        return np.ones(len(strength))
    right, down = slopes.slope[:, 2], slopes.slope[:, 5]
    squared = np.zeros(len(strength))
    # Across an edge the curvature is strong, along it there is none to speak of: only the first counts in full.
    for value, along in (
        (bend.sharp, bend.cosine * down - bend.sine * right),
        (bend.blunt, bend.cosine * right + bend.sine * down),
    ):
        share = np.clip(-value / np.where(strength > 0.0, strength, 1.0), 0.0, 1.0)
        off = np.where(value < 0.0, along / np.where(value < 0.0, value, 1.0), 0.0)
        squared += off * off * share
    weight: NDArray[np.float64] = np.where(strength > 0.0, (1.0 + squared / _OUTLIER_PX**2) ** -2.0, 0.0)
    return weight


def _covariance(
    slopes: Slopes, weight: NDArray[np.float64], curvature: NDArray[np.float64], support: float
) -> NDArray[np.float64]:
    """Return the sandwich ``H⁻¹ V H⁻¹`` [3, 3], in px a half window; infinite where the curvature has no inverse.

    ``V`` is the spread of the slopes over tiles, because the events of one edge are not independent; of few tiles it is
    that over events, widened for their bursts: so much makes the deviations of a real spinning dot its errors.
    """
    value, axis = np.linalg.eigh(curvature)
    if not (value < -1e-9 * max(float(np.abs(value).max()), 1e-300)).all():
        return np.full((3, 3), np.inf)
    by_event = _ROTATION.T @ unfolded((weight * weight) @ slopes.squares) @ _ROTATION
    by_tile = (weight[:, None] * slopes.slope) @ _ROTATION
    spread = _BURST * by_event if support < _FEWEST_TILES else by_tile.T @ by_tile + by_event
    inverse = axis @ np.diag(1.0 / value) @ axis.T
    result: NDArray[np.float64] = inverse @ spread @ inverse
    return result


def _effective(strength: NDArray[np.float64]) -> float:
    """Return how many tiles share a strength between them."""
    square = float(strength @ strength)
    return float(strength.sum()) ** 2 / square if square > 0.0 else 0.0
