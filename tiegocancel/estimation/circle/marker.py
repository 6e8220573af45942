"""Measure ω by differencing the bearing of a marker about a known centre (thesis eq. 3.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["Differencing", "MarkerTurn", "NoTurn", "turn_of_events", "turn_of_marker"]

Differencing = Literal["marker", "events"]
"""What consecutive bearings belong to: a marker's, slot by slot, or single events as (3.4) is printed."""

_FEWEST_ANGLES = 4
_SLOT_EVENTS = 3
_LARGEST_STEP_RAD = 0.5 * math.pi


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerTurn:
    """ω of one window with one standard deviation, from the scatter of the differences themselves."""

    omega_rad_s: float
    omega_sigma_rad_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NoTurn:
    """The window tells no ω; ``reason`` says why in a few words."""

    reason: str


def turn_of_marker(
    t_us: NDArray[np.int64],
    bearing_rad: NDArray[np.float64],
    *,
    slot_us: int,
    least_resultant: float,
    max_omega_rad_s: float,
) -> MarkerTurn | NoTurn:
    """Difference the circular mean of the bearings from slot to slot, unwrapped.

    ``t_us`` int64[n] never decreasing, n ≥ 1; ``bearing_rad`` float64[n] about the centre. A slot of ``slot_us`` shows
    the marker when it has at least three events whose mean direction is at least ``least_resultant`` long (0: spread
    over the circle, 1: one direction). ω is the least-squares slope of the unwrapped angles, that is the mean of all
    their difference quotients (3.4), weighted with the square of their distance in time. Steps of more than a quarter
    of a turn, or a gap in which ``max_omega_rad_s`` could make half a turn, leave the unwrapping in doubt: refused, as
    is a faster turn than that.
    """
    slot = (t_us - t_us[0]) // slot_us
    count = np.bincount(slot)
    shown = count >= _SLOT_EVENTS
    cosine, sine, moment = (
        np.bincount(slot, weights)[shown] / count[shown]
        for weights in (np.cos(bearing_rad), np.sin(bearing_rad), (t_us - t_us[0]) * 1e-6)
    )
    clear = np.hypot(cosine, sine) >= least_resultant
    if int(shown.sum()) < _FEWEST_ANGLES:
        return NoTurn(reason=f"too few events for a marker: {int(shown.sum())} slots of {slot_us} µs have three")
    if 2 * int(clear.sum()) < len(clear):
        length = float(np.median(np.hypot(cosine, sine)))
        return NoTurn(reason=f"no marker: bearings spread over the circle (resultant {length:.2f})")
    angle, moment = np.arctan2(sine, cosine)[clear], moment[clear]
    if len(angle) < _FEWEST_ANGLES:
        return NoTurn(reason=f"too few events for a marker: it shows in {len(angle)} slots of {slot_us} µs")
    if float(np.diff(moment).max()) * max_omega_rad_s >= math.pi:
        return NoTurn(reason="marker seen too rarely to unwrap its angle")
    steps = _wrapped(np.diff(angle))
    if float(np.abs(steps).max()) > _LARGEST_STEP_RAD:
        return NoTurn(reason="marker leaps by more than a quarter of a turn: several markers, or too long slots")
    found = _slope(moment, np.append(0.0, np.cumsum(steps)))
    if abs(found.omega_rad_s) > max_omega_rad_s:
        return NoTurn(reason=f"marker turns at {found.omega_rad_s:.4g} rad/s, beyond {max_omega_rad_s:g}")
    return found


def turn_of_events(
    t_us: NDArray[np.int64], bearing_rad: NDArray[np.float64], *, max_omega_rad_s: float
) -> MarkerTurn | NoTurn:
    """Difference the bearings of consecutive events as (3.4) is printed, and take the mean.

    Pairs at the same microsecond have no quotient and are left out. Consecutive events lie anywhere on the marker, so
    each quotient errs by the marker's width over a microsecond or so: a marker of 0.2 rad at 1 Mev/s gives ±10^5 rad/s
    each. The mean is worth something only for a marker of about one pixel at a low rate; its deviation says so.
    """
    interval_s = np.diff(t_us) * 1e-6
    apart = interval_s > 0.0
    if int(apart.sum()) < _FEWEST_ANGLES:
        return NoTurn(reason=f"{int(apart.sum())} pairs of events differ in time")
    quotient = _wrapped(np.diff(bearing_rad))[apart] / interval_s[apart]
    omega = float(quotient.mean())
    sigma = float(quotient.std(ddof=1)) / math.sqrt(len(quotient))
    if abs(omega) > max_omega_rad_s:
        return NoTurn(reason=f"differences of consecutive events give {omega:.3g} ± {sigma:.2g} rad/s")
    return MarkerTurn(omega_rad_s=omega, omega_sigma_rad_s=sigma)


def _wrapped(angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angles in [−π, π)."""
    wrapped: NDArray[np.float64] = (angle_rad + math.pi) % (2.0 * math.pi) - math.pi
    return wrapped


def _slope(moment_s: NDArray[np.float64], angle_rad: NDArray[np.float64]) -> MarkerTurn:
    centred = moment_s - moment_s.mean()
    reach = float(centred @ centred)
    omega = float(centred @ angle_rad) / reach
    residual = angle_rad - angle_rad.mean() - omega * centred
    sigma = math.sqrt(float(residual @ residual) / (len(residual) - 2) / reach)
    return MarkerTurn(omega_rad_s=omega, omega_sigma_rad_s=sigma)
