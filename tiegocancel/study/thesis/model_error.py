"""Measure how far a wrong motion moves predictions, beside the formulas of the thesis (eq. 4.7 to 4.9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.matching.forecast import Forecast
from tiegocancel.matching.reference import run_reference
from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.probe import Bench, stream_of
from tiegocancel.study.thesis.settings import ThesisSettings

__all__ = ["ErrorCurve", "ModelErrors", "model_errors"]

_BANDS = 12
_FEWEST = 30


@dataclass(frozen=True, slots=True, eq=False)
class ErrorCurve:
    """``size`` of the error (rad/s or px) at ``horizon_us``: px moved, by ``radius_px``.

    ``predictions``: mean over the window's predictions; ``exact``: the formula; ``bound``: as printed; ``matched``:
    mean offset of the matches, event minus prediction, in the direction of the error; ``sigma`` of that mean. NaN where
    a band holds too little.
    """

    size: float
    horizon_us: int
    radius_px: NDArray[np.float64]
    predictions: NDArray[np.float64]
    exact: NDArray[np.float64]
    bound: NDArray[np.float64]
    matched: NDArray[np.float64]
    sigma: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """Curves of a wrong ω and of a wrong centre."""

    omega: tuple[ErrorCurve, ...]
    center: tuple[ErrorCurve, ...]


def model_errors(bench: Bench, settings: ThesisSettings) -> ModelErrors:
    """Return the curves of the first window, for errors whose offsets are large enough to be seen in pixels.

    A wrong ω moves a prediction by ``2r|sin(Δω·Δt/2)|`` (4.7), a wrong centre by ``2|sin(ωΔt/2)|·‖Δc‖``, of which
    (4.8) prints the bound ``‖Δc‖`` alone. Matches show both through the gate, which cuts and dilutes them.
    """
    horizon_us = settings.point.long_horizon_us
    base = base_of("gated", settings).at(horizon_us=horizon_us)
    omega = float(bench.motion.mean(start_us=bench.windows[0].start_us, stop_us=bench.windows[0].stop_us)[1])
    rim_turn = bench.radius_px * horizon_us * 1e-6
    rates = [round(pixels / rim_turn, 3) for pixels in (0.5, 1.0)]
    sine = max(2.0 * abs(np.sin(0.5 * omega * horizon_us * 1e-6)), 1e-9)
    centers = [round(pixels / sine, 1) for pixels in (0.5, 1.0)]
    return ModelErrors(
        omega=tuple(_curve(bench, base, base.at(omega_bias_rad_s=rate), omega) for rate in rates),
        center=tuple(_curve(bench, base, base.at(center_bias_px=size), omega) for size in centers),
    )


def _curve(bench: Bench, true: Point, wrong: Point, omega_rad_s: float) -> ErrorCurve:
    """Compare the predictions under two motions, and follow the matches under the wrong one."""
    events = stream_of(bench, wrong)
    config = wrong.reference_config()
    told, right = (Forecast.of(events, point.motion_of(bench.motion), config) for point in (wrong, true))
    moved_x, moved_y = told.ahead_x - right.ahead_x, told.ahead_y - right.ahead_y
    radius = np.hypot(told.x - bench.center_px[0], told.y - bench.center_px[1])
    edges = np.linspace(0.0, bench.radius_px, _BANDS + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    turn = 1e-6 * wrong.horizon_us
    if wrong.omega_bias_rad_s:
        size = wrong.omega_bias_rad_s
        exact = 2 * middle * np.abs(np.sin(0.5 * size * turn))
        bound = middle * abs(size) * turn
    else:
        size = wrong.center_bias_px
        exact = np.full(len(middle), 2 * abs(np.sin(0.5 * omega_rad_s * turn)) * size)
        bound = np.full(len(middle), size)
    match = run_reference(events, wrong.motion_of(bench.motion), config).match
    # An event lies where the true prediction is: against the shift that the error gave its prediction.
    off_x = told.x[match.real] - told.ahead_x[match.source]
    off_y = told.y[match.real] - told.ahead_y[match.source]
    length = np.maximum(np.hypot(moved_x, moved_y)[match.source], 1e-12)
    along = -(off_x * moved_x[match.source] + off_y * moved_y[match.source]) / length
    moved, _ = _banded(radius, np.hypot(moved_x, moved_y), edges)
    matched, sigma = _banded(radius[match.source], along, edges)
    return ErrorCurve(size, wrong.horizon_us, middle, moved, exact, bound, matched, sigma)


def _banded(
    radius: NDArray[np.float64], value: NDArray[np.float64], edges: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean in each band of radius and the deviation of that mean, NaN of fewer than 30 values."""
    band = np.searchsorted(edges, radius, side="right") - 1
    inside = (band >= 0) & (band < len(edges) - 1)
    count = np.bincount(band[inside], minlength=len(edges) - 1).astype(np.float64)
    count[count < _FEWEST] = np.nan
    mean = np.bincount(band[inside], value[inside], len(edges) - 1) / count
    square = np.bincount(band[inside], value[inside] ** 2, len(edges) - 1) / count
    return mean, np.sqrt(np.maximum(square - mean**2, 0.0) / count)
