"""Find how far the clock of a gyroscope lies from that of the events, from the two series of ω."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.estimation.inertial.gyro import GyroSamples, image_omega

__all__ = ["OffsetConfig", "TimeOffset", "find_time_offset", "offset_of_estimates"]

_FEWEST_ROWS = 20
_MOST_STEPS = 4_000
_TOP = 0.1
_RIVAL = 2.0
_SLOPE_SPANS_US = (4_000.0, 6_000.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetConfig:
    """Bounds of the search: ``|offset| ≤ max_offset_us``, tried every ``step_us``.

    An answer is trusted where the series vary by ``least_variation_rad_s`` (standard deviation), correlate by
    ``least_correlation`` and give the offset to ``max_sigma_us``.
    """

    max_offset_us: int = 100_000
    step_us: int = 500
    least_variation_rad_s: float = 0.02
    least_correlation: float = 0.5
    max_sigma_us: float = 2_000.0

    def __post_init__(self) -> None:
        if self.step_us < 1:
            raise ValueError(f"step_us must be at least 1 µs, not {self.step_us}")
        if not 3 * self.step_us <= self.max_offset_us <= _MOST_STEPS * self.step_us:
            raise ValueError(
                f"max_offset_us must be from 3 to {_MOST_STEPS} steps of {self.step_us} µs, not {self.max_offset_us}"
            )
        if not 0.0 < self.least_variation_rad_s < math.inf:
            raise ValueError(f"least_variation_rad_s must be positive and finite, not {self.least_variation_rad_s}")
        if not 0.0 < self.least_correlation < 1.0:
            raise ValueError(f"least_correlation must lie in (0, 1), not {self.least_correlation}")
        if not self.max_sigma_us > 0.0:
            raise ValueError(f"max_sigma_us must be positive, not {self.max_sigma_us}")


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeOffset:
    """How much later the event clock reads than the gyro's: ``samples.shifted(offset_us)`` lies on the event clock.

    ``sigma_us`` one standard deviation, ``correlation`` of the series at the offset (−1…1). ``gain`` and
    ``bias_rad_s``: ω of the events ≈ gain · ω of the gyro − bias. ``confident``: fit for use; otherwise ``doubt`` says
    why not, and ``offset_us`` is 0 where nothing could be found at all.
    """

    offset_us: float
    sigma_us: float
    correlation: float
    gain: float
    bias_rad_s: float
    rows: int
    confident: bool
    doubt: str = ""

    @property
    def text(self) -> str:
        """Say the result in one line."""
        if not self.confident:
            return f"time offset unknown: {self.doubt}"
        return (
            f"gyro clock {self.offset_us:+.0f} ± {self.sigma_us:.0f} µs to the event clock "
            f"(correlation {self.correlation:.3f}, gain {self.gain:.3f}, {self.rows} rows)"
        )


def offset_of_estimates(
    estimates: Sequence[MotionEstimate],
    gyro: GyroSamples,
    *,
    delay_us: float = 0.0,
    config: OffsetConfig | None = None,
) -> TimeOffset:
    """Find the offset between confident estimates from events and a gyroscope about the optical axis.

    What a window alone says of its middle is taken where it is known, since a causal filter lags. The sensor's dead
    time stays in the offset and not in its deviation: with 2 ms of it the events seem 1.5 ms early. Elsewhere
    ``delay_us`` is how old an estimate's ω is at its own time: without it the delay is part of the offset.
    """
    known = [row for row in estimates if row.confident and math.isfinite(row.omega_rad_s)]
    pairs = sorted(row.window or (row.t_us - delay_us, row.omega_rad_s) for row in known)
    times, omega = np.array(pairs, np.float64).reshape(-1, 2).T
    return find_time_offset(times, omega, gyro.t_us, image_omega(gyro), config=config)


def find_time_offset(
    t_us: NDArray[np.generic],
    omega_rad_s: NDArray[np.float64],
    gyro_t_us: NDArray[np.int64],
    gyro_omega_rad_s: NDArray[np.float64],
    *,
    config: OffsetConfig | None = None,
) -> TimeOffset:
    """Find the offset at which the correlation of two series of image ω is largest; a parabola refines it.

    ``t_us``, ``omega_rad_s`` [n]: from the events, in the order of time; ``gyro_t_us``, ``gyro_omega_rad_s`` [m]: from
    the gyroscope (:func:`image_omega`). Mean and scale of the series play no part, so the gyro's bias need not be
    known; a steady ω, or one that only ramps, says nothing about the offset and is refused. The deviation is that of a
    least-squares fit of offset, gain and bias, with residuals that hang together counted as fewer.
    """
    config = config or OffsetConfig()
    if len(t_us) != len(omega_rad_s) or len(gyro_t_us) != len(gyro_omega_rad_s):
        raise ValueError(
            f"times and ω must have one length, not {len(t_us)} and {len(omega_rad_s)}, "
            f"{len(gyro_t_us)} and {len(gyro_omega_rad_s)}"
        )
    if len(gyro_t_us) < 2 or len(t_us) < _FEWEST_ROWS:
        return _unknown(f"{len(t_us)} estimates and {len(gyro_t_us)} gyro samples, expected {_FEWEST_ROWS} and 2")
    origin = int(gyro_t_us[0])
    events_us = np.asarray(t_us, np.float64) - origin
    own_us = (gyro_t_us - origin).astype(np.float64)
    reach = float(config.max_offset_us)
    # Rows that the gyro covers at every offset that is tried, so that all are judged on the same rows.
    covered = (events_us - reach >= own_us[0]) & (events_us + reach <= own_us[-1])
    rows = int(covered.sum())
    if rows < _FEWEST_ROWS:
        return _unknown(
            f"the gyro covers {rows} of {len(t_us)} estimates with {reach * 1e-3:g} ms to spare on each side"
        )
    when, omega = events_us[covered], np.asarray(omega_rad_s, np.float64)[covered]
    inside = (own_us >= when[0] - reach) & (own_us <= when[-1] + reach)
    least = config.least_variation_rad_s
    for name, spread in (("gyro", float(gyro_omega_rad_s[inside].std())), ("event", float(omega.std()))):
        if not spread >= least:
            return _unknown(f"ω of the {name} series varies by {spread:.2g} rad/s, at least {least:g} is needed")

    count = config.max_offset_us // config.step_us
    offsets = np.arange(-count, count + 1).astype(np.float64) * config.step_us
    curve = np.array([_correlation(omega, np.interp(when - offset, own_us, gyro_omega_rad_s)) for offset in offsets])
    best = int(np.argmax(curve))
    offset = _summit(offsets, curve, best)
    sigma, gain, bias = _deviation(omega, when - offset, own_us, gyro_omega_rad_s)
    doubt = _doubt(curve, best, sigma, config)
    return TimeOffset(
        offset_us=offset,
        sigma_us=sigma,
        correlation=float(curve[best]),
        gain=gain,
        bias_rad_s=bias,
        rows=rows,
        confident=not doubt,
        doubt=doubt,
    )


def _unknown(doubt: str) -> TimeOffset:
    return TimeOffset(
        offset_us=0.0,
        sigma_us=math.inf,
        correlation=math.nan,
        gain=math.nan,
        bias_rad_s=math.nan,
        rows=0,
        confident=False,
        doubt=doubt,
    )


def _correlation(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the correlation coefficient, 0 where a series is constant."""
    a, b = one - one.mean(), other - other.mean()
    scale = math.sqrt(float((a * a).sum()) * float((b * b).sum()))
    return float((a * b).sum()) / scale if scale > 0.0 else 0.0


def _summit(offsets: NDArray[np.float64], curve: NDArray[np.float64], best: int) -> float:
    """Return the top of the parabola through the upper tenth of the peak, three to 21 points of it."""
    floor = float(curve[best]) - _TOP * (float(curve[best]) - float(np.median(curve)))
    reach = 1
    while reach < 10 and best - reach >= 1 and best + reach + 1 < len(curve):
        if min(curve[best - reach - 1], curve[best + reach + 1]) < floor:
            break
        reach += 1
    part = slice(max(best - reach, 0), best + reach + 1)
    if len(offsets[part]) < 3:
        return float(offsets[best])
    step = float(offsets[1] - offsets[0])
    bend, slope, _ = np.polyfit((offsets[part] - offsets[best]) / step, curve[part], 2)
    # A parabola that opens upwards, or tops outside its points, is no peak.
    if bend >= 0.0 or abs(slope / (2.0 * bend)) > reach:
        return float(offsets[best])
    return float(offsets[best] - step * slope / (2.0 * bend))


def _deviation(
    omega: NDArray[np.float64],
    when: NDArray[np.float64],
    own_us: NDArray[np.float64],
    gyro: NDArray[np.float64],
) -> tuple[float, float, float]:
    """Return the offset's deviation in µs, the gain and the bias, from ``ω = gain · g(t − offset) − bias``."""
    there = np.interp(when, own_us, gyro)
    design = np.stack([there, np.ones(len(when))], axis=1)
    solution = np.linalg.lstsq(design, omega, rcond=None)[0]
    rest = omega - design @ solution
    variance = float((rest * rest).mean())
    # Two slopes over different spans: the gyro's noise, which differs, drops out of their product.
    slopes = [
        (np.interp(when + span, own_us, gyro) - np.interp(when - span, own_us, gyro)) / (2.0 * span)
        for span in _SLOPE_SPANS_US
    ]
    # What of the slope neither the series itself nor a constant explains: nothing, where ω is a ramp.
    one, other = (slope - design @ np.linalg.lstsq(design, slope, rcond=None)[0] for slope in slopes)
    strength = float(solution[0]) ** 2 * float((one * other).sum())
    together = 1.0
    for lag in range(1, len(rest) // 4):
        correlation = float((rest[lag:] * rest[:-lag]).mean()) / variance if variance > 0.0 else 0.0
        if correlation < 0.05:
            break
        together += 2.0 * correlation
    sigma = math.sqrt(variance * together / strength) if strength > 0.0 else math.inf
    return sigma, float(solution[0]), -float(solution[1])


def _doubt(curve: NDArray[np.float64], best: int, sigma: float, config: OffsetConfig) -> str:
    """Say why the offset should not be used; nothing when it should."""
    peak = float(curve[best])
    lowest = float(curve.min())
    if peak < config.least_correlation:
        if -lowest >= config.least_correlation:
            return f"the series are opposite (correlation {lowest:.2f}): a wrong sign in the axis map?"
        return f"the series do not match: largest correlation {peak:.2f}, expected {config.least_correlation:g}"
    if best in (0, len(curve) - 1):
        return f"the correlation still rises at the bound of the search, ±{config.max_offset_us} µs"
    rival = _rival(curve, best)
    if 1.0 - rival < _RIVAL * (1.0 - peak) + 1e-3:
        return f"two offsets match almost alike (correlation {peak:.3f} and {rival:.3f}): is ω periodic?"
    if sigma > config.max_sigma_us:
        return f"the offset is known to ±{sigma:.0f} µs only, expected ±{config.max_sigma_us:g} µs"
    return ""


def _rival(curve: NDArray[np.float64], best: int) -> float:
    """Return the correlation of the next best peak inside the search; −1 when there is none."""
    inner = curve[1:-1]
    tops = np.flatnonzero((inner >= curve[:-2]) & (inner > curve[2:])) + 1
    # Small bumps on the flank of the peak are not rivals: between a rival and the peak lies a valley.
    rival = -1.0
    for top in tops.tolist():
        if top == best:
            continue
        valley = float(curve[min(top, best) : max(top, best) + 1].min())
        if valley < float(curve[top]) - 0.1 * (1.0 - valley):
            rival = max(rival, float(curve[top]))
    return rival
