"""Fuse events and gyroscope with a Kalman filter for ω and the gyroscope's bias."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.estimation.inertial.held_center import HeldCenter

__all__ = ["KalmanConfig", "KalmanFusion"]


@dataclass(frozen=True, slots=True, kw_only=True)
class KalmanConfig:
    """What the filter assumes; standard deviations in rad/s, walks in rad/s per √s.

    ``omega_walk``: how ω wanders; large lets the gyro through at once, small smooths it. ``bias_walk``: how the bias
    does. ``gyro_sigma_rad_s``: one gyro sample; √n times its scatter where the device's own filter spreads noise over n
    samples (an MPU-6500 at 1 kHz: 0.0018 rad/s, n ≈ 3). ``initial_omega_sigma_rad_s``, ``initial_bias_rad_s`` with
    ``initial_bias_sigma_rad_s``: before the first sample, for instance from :func:`estimate_bias`.

    ``event_delay_us``: how old the events' ω is at its own time, 0 where an estimator carries it on. An estimate is
    taken with its own deviation times ``event_sigma_scale``, ``least_event_sigma_rad_s`` at least: windows that overlap
    give errors that hang together, so n-fold overlap wants about √n. One that is more than ``gate_sigma`` away is left
    out, unless ``most_rejected`` in a row were: then bias and ω are opened again, but not where that would ask for a
    bias beyond ``max_bias_rad_s``, nor within ``rest_us`` of a rest of the gyroscope: the events then follow something
    that moves by itself. ``max_sigma_rad_s``: beyond it a result is not confident. After ``coast_us`` without an
    estimate from events the doubt says so.
    """

    omega_walk: float = 5.0
    bias_walk: float = 1e-3
    gyro_sigma_rad_s: float = 0.005
    initial_omega_sigma_rad_s: float = 100.0
    initial_bias_rad_s: float = 0.0
    initial_bias_sigma_rad_s: float = 0.1
    event_delay_us: int = 0
    event_sigma_scale: float = 1.0
    least_event_sigma_rad_s: float = 1e-3
    gate_sigma: float = 5.0
    most_rejected: int = 10
    max_bias_rad_s: float = 0.2
    rest_us: int = 300_000
    max_sigma_rad_s: float = 0.5
    coast_us: int = 200_000
    memory_us: int = 200_000

    def __post_init__(self) -> None:
        for name in (
            "omega_walk",
            "bias_walk",
            "gyro_sigma_rad_s",
            "initial_omega_sigma_rad_s",
            "initial_bias_sigma_rad_s",
            "event_sigma_scale",
            "least_event_sigma_rad_s",
            "gate_sigma",
            "max_bias_rad_s",
            "max_sigma_rad_s",
        ):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, not {getattr(self, name)}")
        if not math.isfinite(self.initial_bias_rad_s):
            raise ValueError(f"initial_bias_rad_s must be finite, not {self.initial_bias_rad_s}")
        if self.most_rejected < 1:
            raise ValueError(f"most_rejected must be at least 1, not {self.most_rejected}")
        for name in ("coast_us", "rest_us"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, not {getattr(self, name)}")
        if not 0 <= self.event_delay_us <= self.memory_us:
            raise ValueError(
                f"event_delay_us must be from 0 to memory_us ({self.memory_us}), not {self.event_delay_us}"
            )


@dataclass(frozen=True, slots=True)
class _State:
    """Mean and covariance of ω and bias at a time."""

    t_us: int
    omega: float
    bias: float
    omega_variance: float
    covariance: float
    bias_variance: float

    def at(self, t_us: int, config: KalmanConfig) -> _State:
        """Carry on to a later time: the means stay, the variances grow."""
        step_s = (t_us - self.t_us) * 1e-6
        if step_s <= 0.0:
            return self
        return _State(
            t_us,
            self.omega,
            self.bias,
            self.omega_variance + config.omega_walk**2 * step_s,
            self.covariance,
            self.bias_variance + config.bias_walk**2 * step_s,
        )

    def measured(self, value: float, variance: float, omega_share: float, bias_share: float) -> _State:
        """Take a measurement of ``omega_share``·ω + ``bias_share``·bias."""
        omega_part = omega_share * self.omega_variance + bias_share * self.covariance
        bias_part = omega_share * self.covariance + bias_share * self.bias_variance
        total = omega_share * omega_part + bias_share * bias_part + variance
        away = value - omega_share * self.omega - bias_share * self.bias
        omega_gain, bias_gain = omega_part / total, bias_part / total
        return _State(
            self.t_us,
            self.omega + omega_gain * away,
            self.bias + bias_gain * away,
            max(self.omega_variance - omega_gain * omega_part, 0.0),
            self.covariance - omega_gain * bias_part,
            max(self.bias_variance - bias_gain * bias_part, 0.0),
        )


@dataclass(frozen=True, slots=True)
class _Step:
    """One measurement that was taken, and the state after it."""

    value: float
    variance: float
    omega_share: float
    bias_share: float
    after: _State

    @classmethod
    def of(cls, state: _State, value: float, variance: float, omega_share: float, bias_share: float) -> _Step:
        """Take a measurement in."""
        after = state.measured(value, variance, omega_share, bias_share)
        return cls(value, variance, omega_share, bias_share, after)


class KalmanFusion:
    """Estimate ω and the gyroscope's bias for one axis, both random walks (two states, scalar measurements).

    The gyroscope gives ω + bias at its full rate, its rests give the bias, the events ω itself, late by
    ``event_delay_us``: a late one is taken at its own time and the samples since are taken again, which is exact.
    State: the steps of the last ``memory_us``.
    While the events are in doubt the gyroscope carries ω on alone, and the deviation grows as the bias is less known.
    """

    def __init__(
        self, config: KalmanConfig | None = None, *, center_px: tuple[float, float] = (math.nan, math.nan)
    ) -> None:
        self.config = config or KalmanConfig()
        self._center = HeldCenter(center_px)
        self._steps: deque[_Step] = deque()
        self._base: _State | None = None
        self._rejected = 0
        self._event_us: int | None = None
        self._rest_us: int | None = None
        self._first_us: int | None = None

    @property
    def bias_rad_s(self) -> float:
        """The gyroscope's bias as known now, in rad/s."""
        return self._steps[-1].after.bias if self._steps else self.config.initial_bias_rad_s

    @property
    def bias_sigma_rad_s(self) -> float:
        """One standard deviation of it."""
        return math.sqrt(self._steps[-1].after.bias_variance) if self._steps else self.config.initial_bias_sigma_rad_s

    def gyro(self, t_us: int, omega_rad_s: float) -> MotionEstimate:
        """Take one gyro sample, not before the one ahead of it."""
        state = self._latest(t_us)
        self._append(_Step.of(state, omega_rad_s, self.config.gyro_sigma_rad_s**2, 1.0, 1.0))
        return self._row(t_us, "")

    def rest(self, t_us: int, bias_rad_s: float, sigma_rad_s: float) -> None:
        """Take the bias that a rest of the gyroscope tells, not before the sample ahead of it."""
        self._rest_us = t_us
        self._append(_Step.of(self._latest(t_us), bias_rad_s, sigma_rad_s**2, 0.0, 1.0))

    def event(self, estimate: MotionEstimate) -> MotionEstimate:
        """Take one estimate from events if it is confident and within the gate."""
        self._center.take(estimate)
        self._latest(estimate.t_us)
        if not (estimate.confident and math.isfinite(estimate.omega_sigma_rad_s)):
            return self._row(estimate.t_us, f"event estimate left out: {estimate.doubt or 'no ω'}")
        sigma = max(estimate.omega_sigma_rad_s * self.config.event_sigma_scale, self.config.least_event_sigma_rad_s)
        then_us = estimate.t_us - self.config.event_delay_us
        if self._base is not None:
            then_us = max(then_us, self._base.t_us)
        later: list[_Step] = []
        while self._steps and self._steps[-1].after.t_us > then_us:
            later.append(self._steps.pop())
        state = self._latest(then_us)
        away = estimate.omega_rad_s - state.omega
        apart = abs(away) / math.sqrt(state.omega_variance + sigma * sigma)
        doubt = ""
        if apart > self.config.gate_sigma:
            self._rejected += 1
            resting = self._rest_us is not None and estimate.t_us - self._rest_us <= self.config.rest_us
            impossible = abs(state.bias - away) > self.config.max_bias_rad_s
            if self._rejected < self.config.most_rejected or resting or impossible:
                doubt = f"event estimate left out: {apart:.1f} σ away"
            else:
                # Persistent disagreement: the bias has jumped, or the events had been wrong before.
                state = replace(
                    state,
                    omega_variance=state.omega_variance + away * away,
                    bias_variance=state.bias_variance + away * away,
                )
        if not doubt:
            self._rejected = 0
            self._event_us = estimate.t_us
            self._steps.append(_Step.of(state, estimate.omega_rad_s, sigma * sigma, 1.0, 0.0))
            state = self._steps[-1].after
        for step in reversed(later):
            state = state.at(step.after.t_us, self.config)
            again = _Step.of(state, step.value, step.variance, step.omega_share, step.bias_share)
            self._steps.append(again)
            state = again.after
        self._trim()
        return self._row(estimate.t_us, doubt)

    def _opening(self, t_us: int) -> _State:
        """Return what is assumed before the first measurement."""
        config = self.config
        return _State(
            t_us,
            0.0,
            config.initial_bias_rad_s,
            config.initial_omega_sigma_rad_s**2,
            0.0,
            config.initial_bias_sigma_rad_s**2,
        )

    def _latest(self, t_us: int) -> _State:
        if self._first_us is None:
            self._first_us = t_us
        last = self._steps[-1].after if self._steps else self._base
        return last.at(t_us, self.config) if last is not None else self._opening(t_us)

    def _append(self, step: _Step) -> None:
        self._steps.append(step)
        self._trim()

    def _trim(self) -> None:
        """Forget the steps that no late estimate can reach."""
        oldest = self._steps[-1].after.t_us - self.config.memory_us if self._steps else 0
        while len(self._steps) > 1 and self._steps[0].after.t_us < oldest:
            self._base = self._steps.popleft().after

    def _row(self, t_us: int, doubt: str) -> MotionEstimate:
        state = self._latest(t_us)
        sigma = math.sqrt(state.omega_variance)
        since_us = t_us - (self._event_us if self._event_us is not None else self._first_us or t_us)
        if not doubt and since_us > self.config.coast_us:
            doubt = f"no estimate from events for {since_us * 1e-6:.2f} s: on the gyroscope alone"
        confident = sigma <= self.config.max_sigma_rad_s
        if not confident and not doubt:
            doubt = f"ω is known to ±{sigma:.2g} rad/s only"
        return self._center.row(
            t_us, omega_rad_s=state.omega, omega_sigma_rad_s=sigma, confident=confident, doubt=doubt
        )
