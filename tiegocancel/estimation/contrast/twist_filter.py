"""Filter the twists of single windows into a velocity field and its acceleration (Kalman filter)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.contrast.scorer import Twist

__all__ = ["FilterConfig", "TwistFilter", "TwistState"]

_SURPRISE = 11.0
"""Squared innovation over its covariance that three right measurements reach in one of a hundred cases."""
_LARGEST_WIDENING = 1e6
_JUMP = 30.0
_ADAPT, _MOST_SURPRISE, _MOST_AGILITY = 0.08, 30.0, 300.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterConfig:
    """Say how quickly the motion may change.

    ``jerk_share``: typical second derivative of the motion in 1/s² as a share of itself (2 % of ripple at 2 Hz has 3);
    ``jerk_floor_px_s3`` is added to it, in px at a quarter of the sensor's diagonal; an acceleration fades within
    ``fade_s``.
    """

    jerk_share: float = 3.0
    jerk_floor_px_s3: float = 300.0
    fade_s: float = 0.3

    def __post_init__(self) -> None:
        for name in ("jerk_share", "jerk_floor_px_s3"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be a finite number of at least 0, not {getattr(self, name)!r}")
        if not 0.0 < self.fade_s < math.inf:
            raise ValueError(f"fade_s must be above 0 s, not {self.fade_s!r}")


@dataclass(frozen=True, slots=True, eq=False)
class TwistState:
    """The motion at one time: ``mean`` [6] and ``covariance`` [6, 6] of (vx, vy, ω) at the anchor and their slopes."""

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @property
    def twist(self) -> Twist:
        """Return the velocity of the anchor and ω."""
        return Twist(float(self.mean[0]), float(self.mean[1]), float(self.mean[2]))

    def growth_1_s(self, scale_px: float) -> float:
        """Return the rate at which the motion as a whole speeds up, in 1/s: its slope along itself over itself.

        ``ω̇ = growth·ω`` is what a turn about one centre speeds up by. The slope of ω alone would not do: where the
        centre is far away, ω is next to nothing, and so little of a slope would multiply the speed.
        """
        metric = np.array([1.0, 1.0, scale_px**2])
        size = float(metric @ self.mean[:3] ** 2)
        return float(metric @ (self.mean[:3] * self.mean[3:])) / size if size > 0.0 else 0.0

    def center_sigma_px(self) -> float:
        """Return one standard deviation of the centre along its worst direction; ∞ where ω may be 0."""
        vx, vy, omega = self.mean[:3]
        if abs(omega) <= 2.0 * math.sqrt(max(float(self.covariance[2, 2]), 0.0)) or omega == 0.0:
            return math.inf
        slope = np.array([[0.0, -1.0 / omega, vy / omega**2], [1.0 / omega, 0.0, -vx / omega**2]])
        spread = slope @ self.covariance[:3, :3] @ slope.T
        return math.sqrt(max(float(np.linalg.eigvalsh(spread)[-1]), 0.0))


class TwistFilter:
    """Track the twist at ``anchor_px``; a window measures it at an anchor of its own, which is linear in the state.

    ``agility`` says how many times the configured jerk the motion shows of late: a hand-held camera has a hundred times
    that of a rig. Unlike ``(cx, cy, ω)`` the twist stays well conditioned for straight motions and while ω passes
    through 0. Velocities have an acceleration that fades; a measurement that surprises widens the state until it fits
    (adaptive fading), so that stop-and-go is followed within an update or two. ``scale_px`` weighs ω against
    velocities.
    """

    def __init__(self, config: FilterConfig, *, anchor_px: tuple[float, float], scale_px: float) -> None:
        self.anchor_px = anchor_px
        self._config, self._scale_px = config, scale_px
        self._state = TwistState(np.zeros(6), np.zeros((6, 6)))
        self._time_s: float | None = None
        self.agility = 1.0

    @property
    def started(self) -> bool:
        """Tell whether the filter holds a state."""
        return self._time_s is not None

    def at(self, time_s: float) -> TwistState:
        """Return the state at a later time without keeping it; an earlier time gives the present state."""
        assert self._time_s is not None
        step = time_s - self._time_s
        return self._ahead(step) if step > 0.0 else self._state

    def expected(self, time_s: float, anchor_px: tuple[float, float]) -> Twist:
        """Return the twist that the state has at a time and an anchor."""
        return Twist(*(self._seen_from(anchor_px) @ self.at(time_s).mean[:3]).tolist())

    def update(
        self, time_s: float, twist: Twist, anchor_px: tuple[float, float], covariance: NDArray[np.float64]
    ) -> None:
        """Take the measurement of a window whose middle is ``time_s``; the first one starts the filter."""
        seen = self._seen_from(anchor_px)
        if not self.started:
            back = np.linalg.inv(seen)
            spread = np.zeros((6, 6))
            spread[:3, :3] = back @ covariance @ back.T
            mean = np.concatenate([back @ np.array(twist), np.zeros(3)])
            spread[3:, 3:] = self._unknown_acceleration(mean)
            self._state, self._time_s = TwistState(mean, spread), time_s
            return
        slope = np.hstack([seen, np.zeros((3, 3))])
        measured = np.array(twist)
        jumped = self._surprise(self.at(time_s), slope, measured, covariance) > _JUMP
        if not jumped:
            self._adapt(self._surprise(self.at(time_s), slope, measured, covariance))
        state = self.at(time_s)
        if jumped:
            state = self._after_jump(state)
        for _ in range(3):
            surprise = self._surprise(state, slope, measured, covariance)
            if surprise <= _SURPRISE:
                break
            state = replace(state, covariance=state.covariance * min(surprise / 3.0, _LARGEST_WIDENING))
        mean, spread = state.mean, state.covariance
        innovation = measured - slope @ mean
        total = slope @ spread @ slope.T + covariance
        gain = np.linalg.solve(total, slope @ spread).T
        keep = np.eye(6) - gain @ slope
        spread = keep @ spread @ keep.T + gain @ covariance @ gain.T
        self._state = TwistState(mean + gain @ innovation, 0.5 * (spread + spread.T))
        assert self._time_s is not None
        self._time_s = max(time_s, self._time_s)

    @staticmethod
    def _surprise(
        state: TwistState, slope: NDArray[np.float64], measured: NDArray[np.float64], covariance: NDArray[np.float64]
    ) -> float:
        """Return the squared innovation over its covariance."""
        innovation = measured - slope @ state.mean
        total = slope @ state.covariance @ slope.T + covariance
        return float(innovation @ np.linalg.solve(total, innovation))

    def _adapt(self, surprise: float) -> None:
        """Raise the jerk that is expected while measurements surprise, lower it again while they do not."""
        step = _ADAPT * (min(surprise, _MOST_SURPRISE) / 3.0 - 1.0)
        self.agility = min(max(self.agility * math.exp(step), 1.0), _MOST_AGILITY)

    def _after_jump(self, state: TwistState) -> TwistState:
        """Forget the acceleration: of a velocity that has jumped it says nothing."""
        spread = np.zeros((6, 6))
        spread[:3, :3] = state.covariance[:3, :3]
        spread[3:, 3:] = self._unknown_acceleration(state.mean)
        return TwistState(np.concatenate([state.mean[:3], np.zeros(3)]), spread)

    def _ahead(self, step_s: float) -> TwistState:
        config = self._config
        fade = math.exp(-step_s / config.fade_s)
        move = np.eye(6)
        move[:3, 3:] = config.fade_s * (1.0 - fade) * np.eye(3)
        move[3:, 3:] = fade * np.eye(3)
        # White jerk that keeps its sign for about a tenth of a second.
        jerk = self.agility * (config.jerk_share * self._speed(self._state.mean) + config.jerk_floor_px_s3)
        power = 0.1 * np.diag([jerk**2, jerk**2, (jerk / self._scale_px) ** 2])
        noise = np.block(
            [[power * step_s**3 / 3.0, power * step_s**2 / 2.0], [power * step_s**2 / 2.0, power * step_s]]
        )
        return TwistState(move @ self._state.mean, move @ self._state.covariance @ move.T + noise)

    def _unknown_acceleration(self, mean: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance [3, 3] of an acceleration that may change the motion by its size within a second."""
        change = self._speed(mean) + 10.0
        return np.diag([change**2, change**2, (change / self._scale_px) ** 2])

    def _speed(self, mean: NDArray[np.float64]) -> float:
        """Return the typical velocity on the sensor in px/s."""
        return math.hypot(float(mean[0]), float(mean[1]), float(mean[2]) * self._scale_px)

    def _seen_from(self, anchor_px: tuple[float, float]) -> NDArray[np.float64]:
        """Return the matrix that takes the twist at the filter's anchor to another anchor."""
        right, down = anchor_px[0] - self.anchor_px[0], anchor_px[1] - self.anchor_px[1]
        return np.array([[1.0, 0.0, -down], [0.0, 1.0, right], [0.0, 0.0, 1.0]])
