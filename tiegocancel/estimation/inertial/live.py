"""Follow a gyroscope whose lines come in among the events, alone or fused with an estimator on the events."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.estimate import Estimator, MotionEstimate
from tiegocancel.estimation.inertial.bias import RestConfig, RestingBias, Rests
from tiegocancel.estimation.inertial.edvs_lines import parse_edvs_line
from tiegocancel.estimation.inertial.fusion import Fusion, fuse
from tiegocancel.estimation.inertial.gyro import axes_matrix, image_omega
from tiegocancel.events import Events

__all__ = ["LiveFusedEstimator", "LiveGyro", "LiveGyroEstimator"]

_MOST_LINES = 1 << 16


class LiveGyro:
    """Take lines as they come and give the samples in them, once each, on the events' clock and in the camera's axes.

    ``axes`` maps the device's axes (see :func:`axes_matrix`), ``offset_us`` is added to the times. A line bears the
    time of the event before it; several at one time become one sample, their mean. ``lines`` read, ``malformed``
    among them, ``samples`` that came of them.
    """

    def __init__(self, *, axes: str | None = None, offset_us: int = 0) -> None:
        self._axes: NDArray[np.float64] = np.eye(3) if axes is None else axes_matrix(axes)
        self._offset_us = offset_us
        self._waiting: list[tuple[int, tuple[float, float, float]]] = []
        self._last_us: int | None = None
        self.lines = self.malformed = self.samples = 0

    def add(self, lines: Iterable[tuple[int, str]]) -> None:
        """Take lines, each with its time in µs; what is no line of a gyroscope is passed over."""
        for t_us, text in lines:
            self.lines += 1
            parsed = parse_edvs_line(text)
            self.malformed += parsed.kind == "malformed"
            if parsed.kind == "gyro":
                self._waiting.append((t_us + self._offset_us, parsed.rate_rad_s))
        # While no events come nobody asks; a gyroscope alone must not fill the memory.
        del self._waiting[: max(len(self._waiting) - _MOST_LINES, 0)]

    def take(self, until_us: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return times int64[m], strictly increasing, and rates float64[m, 3] in rad/s of the samples before a time."""
        due: dict[int, list[tuple[float, float, float]]] = {}
        rest = []
        for t_us, rate in self._waiting:
            if t_us >= until_us:
                rest.append((t_us, rate))
            elif self._last_us is None or t_us > self._last_us:
                due.setdefault(t_us, []).append(rate)
        self._waiting = rest
        times = np.array(sorted(due), np.int64)
        rates = np.array([np.mean(due[int(t_us)], axis=0) for t_us in times], np.float64).reshape(-1, 3)
        if len(times):
            self._last_us = int(times[-1])
            self.samples += len(times)
        return times, rates @ self._axes.T


class LiveGyroEstimator:
    """Return ω of the image about a known centre, a row for each sample of a live gyroscope.

    ``center_px`` is where the optical axis meets the image. ``follow_bias``: the bias is found whenever the gyroscope
    rests, and rows before the first rest are in doubt; otherwise there is none. A row uses samples before its time.
    """

    def __init__(
        self,
        gyro: LiveGyro,
        center_px: tuple[float, float],
        *,
        follow_bias: bool = True,
        noise_rad_s: float = 0.005,
    ) -> None:
        self._gyro, self._center_px, self._noise_rad_s = gyro, center_px, noise_rad_s
        self._bias = RestingBias() if follow_bias else None

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the rows that came before the time of its last event."""
        if not len(events):
            return []
        times, rates = self._gyro.take(int(events.t[-1]))
        return [self._row(times[row : row + 1], rates[row : row + 1]) for row in range(len(times))]

    def _row(self, time_us: NDArray[np.int64], rate: NDArray[np.float64]) -> MotionEstimate:
        """Return the row of one sample, time int64[1] and rate float64[1, 3]."""
        doubt, sigma = "", 0.0
        if self._bias is not None:
            rate = rate - self._bias.process(time_us, rate)
            if self._bias.found:
                sigma = float(self._bias.sigma_rad_s[2])
            else:
                doubt, sigma = "the bias is unknown: no rest so far", RestConfig().max_bias_rad_s
        return MotionEstimate(
            t_us=int(time_us[0]),
            center_px=self._center_px,
            omega_rad_s=float(image_omega(rate)[0]),
            omega_sigma_rad_s=math.hypot(sigma, self._noise_rad_s),
            doubt=doubt,
        )


class LiveFusedEstimator:
    """Fuse an estimator on events with a live gyroscope; each row uses events before its time and samples up to it.

    ``follow_bias`` tells the filter the bias whenever the gyroscope rests.
    """

    def __init__(self, estimator: Estimator, gyro: LiveGyro, fusion: Fusion, *, follow_bias: bool = False) -> None:
        self._estimator, self._gyro, self._fusion = estimator, gyro, fusion
        self._rests = Rests() if follow_bias else None
        self._last_us: int | None = None

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the rows that became due."""
        estimates = self._estimator.process(events)
        if not len(events):
            return estimates
        until_us = max([int(events.t[-1]), *(row.t_us + 1 for row in estimates[-1:])])
        times, rates = self._gyro.take(until_us)
        rests = self._rests.process(times, rates) if self._rests is not None and len(times) else None
        rows = []
        for row in fuse(self._fusion, estimates, times, image_omega(rates), rests=rests):
            if self._last_us is None or row.t_us > self._last_us:
                rows.append(row)
                self._last_us = row.t_us
        return rows
