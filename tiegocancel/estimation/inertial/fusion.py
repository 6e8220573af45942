"""Fuse ω from events with ω from a gyroscope, causally: exponential averaging, and what any such filter offers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.estimate import Estimator, MotionEstimate
from tiegocancel.estimation.inertial.bias import Rest, RestConfig, Rests
from tiegocancel.estimation.inertial.gyro import GyroSamples, image_omega
from tiegocancel.estimation.inertial.held_center import HeldCenter
from tiegocancel.estimation.inertial.kalman import KalmanConfig, KalmanFusion
from tiegocancel.events import Events

__all__ = [
    "ExponentialConfig",
    "ExponentialFusion",
    "FusedEstimator",
    "Fusion",
    "KalmanConfig",
    "KalmanFusion",
    "fuse",
]


class Fusion(Protocol):
    """Take measurements in the order of time and return the motion as known after each."""

    def gyro(self, t_us: int, omega_rad_s: float) -> MotionEstimate:
        """Take one sample of the image's ω in rad/s from the gyroscope (:func:`image_omega`)."""
        ...

    def rest(self, t_us: int, bias_rad_s: float, sigma_rad_s: float) -> None:
        """Take the bias of the image's ω that a rest of the gyroscope tells, with one standard deviation."""
        ...

    def event(self, estimate: MotionEstimate) -> MotionEstimate:
        """Take one estimate from events; one that is doubtful, or constrains no ω, only lends its centre and time."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ExponentialConfig:
    """Weights of a new ω: ``alpha`` for the gyroscope's, ``event_alpha`` for the events', both in (0, 1].

    ``gyro_sigma_rad_s`` is the standard deviation of one gyro sample, for the deviation of the result.
    """

    alpha: float = 0.2
    event_alpha: float = 0.2
    gyro_sigma_rad_s: float = 0.005

    def __post_init__(self) -> None:
        for name in ("alpha", "event_alpha"):
            if not 0.0 < getattr(self, name) <= 1.0:
                raise ValueError(f"{name} must lie in (0, 1], not {getattr(self, name)}")
        if not 0.0 < self.gyro_sigma_rad_s < math.inf:
            raise ValueError(f"gyro_sigma_rad_s must be positive and finite, not {self.gyro_sigma_rad_s}")


class ExponentialFusion:
    """Average exponentially, ω̂ ← (1 − α) ω̂ + α ω̃ (thesis, eq. 3.7), whichever sensor gives ω̃.

    Three numbers of state. It knows of a bias what rests tell, and nothing of time: a bias that no rest told passes
    into ω̂ by the share of its weight, and ω̂ trails a changing ω by about (1 − α)/α samples. The deviation is that of
    the noise alone, without bias and lag.
    """

    def __init__(
        self, config: ExponentialConfig | None = None, *, center_px: tuple[float, float] = (math.nan, math.nan)
    ) -> None:
        self.config = config or ExponentialConfig()
        self._center = HeldCenter(center_px)
        self._omega = math.nan
        self._variance = math.inf
        self._bias = 0.0

    def rest(self, t_us: int, bias_rad_s: float, sigma_rad_s: float) -> None:
        """Take off this bias from now on."""
        self._bias = bias_rad_s

    def gyro(self, t_us: int, omega_rad_s: float) -> MotionEstimate:
        """Blend in one gyro sample."""
        self._blend(omega_rad_s - self._bias, self.config.gyro_sigma_rad_s, self.config.alpha)
        return self._row(t_us, "")

    def event(self, estimate: MotionEstimate) -> MotionEstimate:
        """Blend in one estimate from events that is confident."""
        self._center.take(estimate)
        usable = estimate.confident and math.isfinite(estimate.omega_sigma_rad_s)
        if usable:
            self._blend(estimate.omega_rad_s, estimate.omega_sigma_rad_s, self.config.event_alpha)
        return self._row(estimate.t_us, "" if usable else f"event estimate left out: {estimate.doubt or 'no ω'}")

    def _blend(self, omega_rad_s: float, sigma_rad_s: float, alpha: float) -> None:
        if not math.isfinite(self._omega):
            alpha, self._omega, self._variance = 1.0, 0.0, 0.0
        self._omega = (1.0 - alpha) * self._omega + alpha * omega_rad_s
        self._variance = (1.0 - alpha) ** 2 * self._variance + (alpha * sigma_rad_s) ** 2

    def _row(self, t_us: int, doubt: str) -> MotionEstimate:
        known = math.isfinite(self._omega)
        return self._center.row(
            t_us,
            omega_rad_s=self._omega if known else 0.0,
            omega_sigma_rad_s=math.sqrt(self._variance),
            confident=known,
            doubt=doubt if known else "no ω was measured yet",
        )


def fuse(
    fusion: Fusion,
    estimates: Sequence[MotionEstimate],
    t_us: NDArray[np.int64],
    omega_rad_s: NDArray[np.float64],
    *,
    row_us: int = 0,
    rests: Mapping[int, Rest] | None = None,
) -> list[MotionEstimate]:
    """Feed both series to a filter in the order of time, the gyro first at equal times; return a row for each instant.

    ``t_us`` int64[m], ``omega_rad_s`` float64[m]: the gyroscope's, and its ``rests`` by time, each taken before the
    sample of that time. Rows that only the gyro caused are left out where they follow the last by less than ``row_us``.
    """
    rows: list[MotionEstimate] = []
    place = 0
    for estimate in [*estimates, None]:
        stop = len(t_us) if estimate is None else int(np.searchsorted(t_us, estimate.t_us, side="right"))
        for index in range(place, max(stop, place)):
            now_us = int(t_us[index])
            if rests and now_us in rests:
                fusion.rest(now_us, rests[now_us].image_bias_rad_s, rests[now_us].image_sigma_rad_s)
            row = fusion.gyro(now_us, float(omega_rad_s[index]))
            if not rows or row.t_us >= rows[-1].t_us + max(row_us, 1):
                rows.append(row)
        place = max(stop, place)
        if estimate is not None:
            row = fusion.event(estimate)
            if rows and rows[-1].t_us == row.t_us:
                rows.pop()
            if not rows or row.t_us > rows[-1].t_us:
                rows.append(row)
    return rows


class FusedEstimator:
    """Run an estimator on events and fuse what it finds with a gyroscope on the events' clock.

    Each row uses events before its time and gyro samples up to it, nothing later; rows that only the gyro caused follow
    the last row by ``row_us`` at least. With ``rest`` the filter is told the bias whenever the gyroscope rests.
    """

    def __init__(
        self,
        estimator: Estimator,
        gyro: GyroSamples,
        fusion: Fusion,
        *,
        row_us: int = 1000,
        rest: RestConfig | None = None,
    ) -> None:
        if row_us < 0:
            raise ValueError(f"row_us must not be negative, not {row_us}")
        self._estimator = estimator
        self._fusion = fusion
        self._t_us = gyro.t_us
        self._omega = image_omega(gyro)
        self._row_us = row_us
        self._rests = None if rest is None else Rests(rest).process(gyro.t_us, gyro.rate_rad_s)
        self._place = 0
        self._last_us: int | None = None

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the rows up to the time of its last event."""
        estimates = self._estimator.process(events)
        if not len(events) and not estimates:
            return []
        # Samples at the time of the last event wait: an estimate for that time may come with the next chunk.
        until_us = max([int(events.t[-1])] * bool(len(events)) + [row.t_us + 1 for row in estimates[-1:]])
        stop = int(np.searchsorted(self._t_us, until_us, side="left"))
        part = slice(self._place, max(stop, self._place))
        self._place = part.stop
        due = []
        # Thinned here, not in fuse: the last row may have left with the chunk before.
        events_at = {row.t_us for row in estimates}
        for row in fuse(self._fusion, estimates, self._t_us[part], self._omega[part], rests=self._rests):
            soon = self._last_us is not None and row.t_us < self._last_us + max(self._row_us, 1)
            again = self._last_us is not None and row.t_us <= self._last_us
            if again or (soon and row.t_us not in events_at):
                continue
            due.append(row)
            self._last_us = row.t_us
        return due
