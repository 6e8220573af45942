"""Fit what the thesis fits to CR against Δt, and what a window that was cut out does by itself."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.study.thesis.results import Curve

__all__ = ["Decay", "cut_law", "fit_decay"]


_NO_DECAY = 1e-3
"""Halvings a ms below which a curve does not fall: over the 20 ms of the thesis that is 1.4 %."""


@dataclass(frozen=True, slots=True)
class Decay:
    """``CR = amplitude · 2^(−Δt/half_ms)``; ``rms`` of what it leaves, as a share."""

    amplitude: float
    half_ms: float
    rms: float

    def at(self, horizon_ms: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the fitted share."""
        return self.amplitude * np.exp2(-horizon_ms / self.half_ms)


def fit_decay(curve: Curve) -> Decay | None:
    """Fit the exponential to a curve over Δt in µs, all its points alike; ``None`` of fewer than four points.

    A curve that does not fall has no half-life: ``half_ms`` is then inf and the amplitude its mean.
    """
    from scipy.optimize import OptimizeWarning, curve_fit

    seen = np.isfinite(curve.y)
    x, y = curve.x[seen] / 1000, curve.y[seen]
    if len(x) < 4:
        return None

    def decay(horizon_ms: NDArray[np.float64], amplitude: float, rate: float) -> NDArray[np.float64]:
        return amplitude * np.exp2(-horizon_ms * rate)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OptimizeWarning)  # a flat curve bounds no rate; that is an answer too
        (amplitude, rate), _ = curve_fit(decay, x, y, p0=(float(y[0]), 0.2), maxfev=10_000)
    if rate <= _NO_DECAY:
        return Decay(float(y.mean()), float("inf"), float(np.std(y)))
    left = y - decay(x, amplitude, rate)
    return Decay(float(amplitude), float(1.0 / rate), float(np.sqrt(np.mean(left**2))))


def cut_law(horizon_us: NDArray[np.float64], length_us: float) -> NDArray[np.float64]:
    """Return the largest CR that a window of ``length_us`` allows when it is cut out: ``1 − Δt/T``, not below 0.

    Predictions that fall due after its end meet nothing, and events of its first ``Δt`` were never predicted.
    """
    return np.clip(1.0 - horizon_us / length_us, 0.0, 1.0)
