"""Estimate the rotation from the gyroscope alone: no event is looked at, only its time."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.estimation.inertial.bias import GyroBias, RestConfig, RestingBias
from tiegocancel.estimation.inertial.gyro import GyroSamples, image_omega
from tiegocancel.events import Events

__all__ = ["GyroEstimator"]


class GyroEstimator:
    """Return ω of the image about a known centre, a row for each batch of gyro samples.

    ``samples`` on the events' clock and in the camera's frame. ``center_px`` is where the optical axis meets the image
    (the principal point): a turn of the camera about its own axis turns the image about it. ``bias``: one that was
    found before, ``None`` where the samples are free of it, or ``"causal"`` to follow it at rest as the stream goes on.
    A batch is the samples within ``row_us``; its row stands at the last of them, with their mean. ``noise_rad_s`` is
    the standard deviation of one sample where ``bias`` tells none.
    """

    def __init__(
        self,
        samples: GyroSamples,
        center_px: tuple[float, float],
        *,
        bias: GyroBias | Literal["causal"] | None = None,
        rest: RestConfig | None = None,
        row_us: int = 1000,
        noise_rad_s: float = 0.005,
        center_sigma_px: float = math.inf,
    ) -> None:
        if row_us < 1:
            raise ValueError(f"row_us must be at least 1 µs, not {row_us}")
        if not all(math.isfinite(value) for value in center_px):
            raise ValueError(f"center_px must be finite, not {center_px}")
        if not 0.0 < noise_rad_s < math.inf:
            raise ValueError(f"noise_rad_s must be positive and finite, not {noise_rad_s}")
        self._samples = samples
        self._center_px = (float(center_px[0]), float(center_px[1]))
        self._center_sigma_px = center_sigma_px
        self._given = bias if isinstance(bias, GyroBias) else None
        self._follower = RestingBias(rest) if bias == "causal" else None
        self._noise_rad_s = noise_rad_s
        batch = samples.t_us // row_us
        self._stops = np.append(np.flatnonzero(np.diff(batch)) + 1, len(samples))
        self._next = 0

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the rows up to the time of its last event."""
        return self.until(int(events.t[-1])) if len(events) else []

    def until(self, t_us: int) -> list[MotionEstimate]:
        """Return the rows that are due up to a time in µs and were not yet returned."""
        rows = []
        while self._next < len(self._stops):
            stop = int(self._stops[self._next])
            if int(self._samples.t_us[stop - 1]) > t_us:
                break
            start = int(self._stops[self._next - 1]) if self._next else 0
            rows.append(self._row(slice(start, stop)))
            self._next += 1
        return rows

    def _row(self, batch: slice) -> MotionEstimate:
        times, rates = self._samples.t_us[batch], self._samples.rate_rad_s[batch]
        bias, sigma, noise, doubt = self._bias(times, rates)
        right, down, forward = (rates - bias).mean(axis=0).tolist()
        return MotionEstimate(
            t_us=int(times[-1]),
            center_px=self._center_px,
            omega_rad_s=float(image_omega(rates - bias).mean()),
            center_sigma_px=self._center_sigma_px,
            omega_sigma_rad_s=math.hypot(sigma, noise / math.sqrt(len(times))),
            doubt=doubt,
            turn_rad_s=(right, down, forward),
        )

    def _bias(
        self, times: NDArray[np.int64], rates: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], float, float, str]:
        """Return bias [n, 3] or [3], its deviation about z, that of a sample, and the doubt, if any."""
        if self._follower is not None:
            bias = self._follower.process(times, rates)
            if self._follower.found:
                return bias, float(self._follower.sigma_rad_s[2]), self._noise_rad_s, ""
            return bias, self._follower.config.max_bias_rad_s, self._noise_rad_s, "the bias is unknown: no rest so far"
        if self._given is None:
            return np.zeros(3), 0.0, self._noise_rad_s, ""
        if self._given.found:
            return self._given.bias_rad_s, float(self._given.sigma_rad_s[2]), float(self._given.noise_rad_s[2]), ""
        return self._given.bias_rad_s, RestConfig().max_bias_rad_s, self._noise_rad_s, "the bias is unknown: no rest"
