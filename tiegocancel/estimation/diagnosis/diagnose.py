"""Tell a wrong centre from a wrong angular velocity by where real events lie beside their predictions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.diagnosis.coincidence import Coincidence, find_coincidence, rings_of
from tiegocancel.estimation.diagnosis.diagnosis import Diagnosis, Kind
from tiegocancel.estimation.diagnosis.offsets import LEAST_MOTION_PX, Predictions, predictions_of
from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.rotation import RotationTrajectory

__all__ = ["Diagnosis", "diagnose_rotation", "refine_rotation"]

_FEWEST_PREDICTIONS = 200
_LEAST_KEPT = 1.0 / 3.0
_LEAST_CONTRAST = 2.0
_LEAST_MET = 0.12
"""Wrong motions reach 0.11 of the predictions where a texture resembles itself, right ones 0.14 or more."""
_SURE_ONE, _SURE_TWO, _SURE_THREE = 9.0, 11.83, 14.16
"""Squared distances from 0, in standard deviations, that chance exceeds once in 370: of one, two and three numbers."""
_WEAK_CENTER_PX = 5.0
_MOST_CHANGE_PX = 4.0
_LEAST_WAY_PX = 2.0


def diagnose_rotation(
    events: Events,
    trajectory: RotationTrajectory,
    cancel_config: CancelConfig,
    *,
    max_events: int = 100_000,
    seed: int = 0,
) -> Diagnosis:
    """Find the biases of ``ω`` and of the centre that move predictions away from real events (§3.6 (5), eq. 4.7, 4.8).

    To first order an event lies beside its prediction by ``−δω·Δt·J(x − c) − (I − R(θ))·δc`` with ``θ = ωΔt``: a wrong
    ω turns, and grows with the radius; a wrong centre moves everything alike, by ``2|sin(θ/2)|·|δc|``. Matches within
    the gates would show little of it, cut off and mixed with chance as they are: here ``max_events`` predictions from
    stretches over the recording meet all real events of their polarity within 10 px, and the rigid shift is sought at
    which they coincide; at most about 7 px of it can be found. The horizon is that of ``cancel_config``; a longer one
    shows both biases better. The same events and seed give the same answer. Raise ``ValueError`` for ``max_events``
    below 1000.
    """
    if max_events < 1_000:
        raise ValueError(f"max_events must be at least 1000, not {max_events}")
    horizon_us = cancel_config.horizon_us
    span_us = (int(events.t[0]), int(events.t[-1])) if len(events) else (int(trajectory.t_us[0]),) * 2
    center, omega = trajectory.mean(start_us=span_us[0], stop_us=span_us[1])
    gate_us = max(cancel_config.tolerance_us, 1)
    predictions = predictions_of(events, trajectory, horizon_us, gate_us, max_events=max_events, seed=seed)
    made = 0 if predictions is None else predictions.count
    judged: dict[str, Any] = {"center_px": center, "omega_rad_s": omega, "horizon_us": horizon_us, "predictions": made}
    if predictions is None or made < _FEWEST_PREDICTIONS:
        reason = (
            f"only {made} events move {LEAST_MOTION_PX:g} px or more within {horizon_us / 1000:g} ms of the recording"
        )
        return Diagnosis(kind="unknown", text=f"the bias is unknown: {reason}", **judged)
    doubt = _unsteadiness(trajectory, span_us, horizon_us, center)
    if doubt:
        return Diagnosis(kind="unknown", text=f"the bias is unknown: {doubt}", **judged)
    found = find_coincidence(predictions)
    judged["share_explained"] = found.met_share
    doubt = _doubt(found)
    if doubt:
        return Diagnosis(kind="unknown", text=f"the bias is unknown: {doubt}", **judged)
    bias, covariance = _biases(predictions, found, horizon_us)
    doubt = _stillness(predictions, found, bias, horizon_us)
    if doubt:
        return Diagnosis(kind="unknown", text=f"the bias is unknown: {doubt}", **judged)
    kind, correction = _verdict(bias, covariance)
    sigma = np.sqrt(np.diag(covariance)).tolist()
    return Diagnosis(
        kind=kind,
        text=_sentence(kind, bias.tolist(), correction, sigma, center, omega, varies=len(trajectory) > 1),
        center_bias_px=(float(bias[0]), float(bias[1])),
        omega_bias_rad_s=float(bias[2]),
        center_sigma_px=(sigma[0], sigma[1]),
        omega_sigma_rad_s=sigma[2],
        correction=correction,
        rings=rings_of(found, predictions),
        **judged,
    )


def refine_rotation(
    events: Events,
    trajectory: RotationTrajectory,
    cancel_config: CancelConfig,
    rounds: int = 3,
    *,
    max_events: int = 100_000,
    seed: int = 0,
) -> tuple[RotationTrajectory, list[Diagnosis]]:
    """Diagnose and correct until no bias stands out, ``rounds`` times at most; return the motion and every diagnosis.

    Each round looks at other events where there are more than ``max_events``. Where a corrected motion cannot be
    diagnosed any more, the one before it is returned.
    """
    if rounds < 1:
        raise ValueError(f"rounds must be at least 1, not {rounds}")
    best, history = trajectory, [diagnose_rotation(events, trajectory, cancel_config, max_events=max_events, seed=seed)]
    for number in range(1, rounds + 1):
        if history[-1].kind in ("none", "unknown"):
            break
        better = history[-1].corrected(best)
        history.append(diagnose_rotation(events, better, cancel_config, max_events=max_events, seed=seed + number))
        if history[-1].kind == "unknown":
            break
        best = better
    return best, history


def _unsteadiness(
    trajectory: RotationTrajectory, span_us: tuple[int, int], horizon_us: int, center_px: tuple[float, float]
) -> str:
    """Return the doubt that the motion itself changes by more than a bias that could be found, if it does."""
    cx, cy, omega = trajectory.at(np.linspace(*span_us, 64).astype(np.int64))
    # Where a pixel at the mean centre, and one 100 px beside it, would be carried within the horizon.
    horizon_s = horizon_us * 1e-6
    away = [omega * horizon_s * np.hypot(center_px[0] + right - cx, center_px[1] - cy) for right in (0.0, 100.0)]
    spread_px = max(float(np.percentile(way, 90) - np.percentile(way, 10)) for way in away)
    if spread_px <= _MOST_CHANGE_PX:
        return ""
    return f"the motion itself changes by {spread_px:.0f} px within {horizon_us / 1000:g} ms from time to time"


def _doubt(found: Coincidence) -> str:
    """Return why no bias can be told, nothing where it can."""
    if not found.is_peak:
        return "predictions and real events coincide nowhere within 7 px, or alike in many places"
    if found.kept_share < _LEAST_KEPT or found.contrast < _LEAST_CONTRAST or found.met_share < _LEAST_MET:
        return (
            f"matches do not stand above chance: {found.met_share:.0%} of the predictions meet a real event beyond it, "
            f"{found.kept_share:.0%} lie where others do, at {found.contrast:.1f} times the density around "
            f"(expected at least {_LEAST_MET:.0%}, {_LEAST_KEPT:.0%} and {_LEAST_CONTRAST:g})"
        )
    return ""


def _stillness(predictions: Predictions, found: Coincidence, bias: NDArray[np.float64], horizon_us: int) -> str:
    """Return the doubt that events really move so little that they meet what they leave behind, if they do."""
    center = np.subtract(predictions.center_px, predictions.anchor_px) - bias[:2]
    chord = 2.0 * abs(math.sin(0.5 * (predictions.turn_rad + found.shift.turn_rad)))
    way_px = chord * float(np.median(np.hypot(found.pairs.right - center[0], found.pairs.down - center[1])))
    if way_px >= _LEAST_WAY_PX:
        return ""
    return f"events really seem to move {way_px:.1f} px only within {horizon_us / 1000:g} ms"


def _biases(
    predictions: Predictions, found: Coincidence, horizon_us: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the biases (x, y, ω) float64[3] and their covariance.

    Motion and shift together turn by ``θ`` about the point that stays in place: ``(I − R(θ))·(c − ĉ)`` is where the
    shift takes ``ĉ``. A small ``θ`` makes that ill-conditioned, and the covariance says so.
    """
    cosine, sine = (f(predictions.turn_rad + found.shift.turn_rad) for f in (math.cos, math.sin))
    center = np.subtract(predictions.center_px, predictions.anchor_px)
    moved = np.subtract(found.shift.applied(*center), center)
    solve = np.linalg.pinv(np.array([[1.0 - cosine, sine], [-sine, 1.0 - cosine]]))
    horizon_s = horizon_us * 1e-6
    bias = np.array([*(-solve @ moved), -found.shift.turn_rad / horizon_s])
    slope = np.zeros((3, 3))
    slope[:2] = -solve @ np.array([[-center[1], 1.0, 0.0], [center[0], 0.0, 1.0]])
    slope[2, 0] = -1.0 / horizon_s
    return bias, slope @ found.covariance @ slope.T


def _verdict(bias: NDArray[np.float64], covariance: NDArray[np.float64]) -> tuple[Kind, tuple[float, float, float]]:
    """Say which bias stands out of its spread, and what to take off: with one bias, as if the other were 0."""
    inverse = np.linalg.inv(covariance[:2, :2])
    center_off = float(bias[:2] @ inverse @ bias[:2]) > _SURE_TWO
    omega_off = float(bias[2] ** 2 / covariance[2, 2]) > _SURE_ONE
    if center_off and not omega_off:
        x, y = bias[:2] - covariance[:2, 2] * (bias[2] / covariance[2, 2])
        return "centre", (float(x), float(y), 0.0)
    if omega_off and not center_off:
        return "omega", (0.0, 0.0, float(bias[2] - covariance[2, :2] @ inverse @ bias[:2]))
    if center_off or float(bias @ np.linalg.solve(covariance, bias)) > _SURE_THREE:
        return "both", (float(bias[0]), float(bias[1]), float(bias[2]))
    return "none", (0.0, 0.0, 0.0)


def _sentence(
    kind: Kind,
    bias: list[float],
    correction: tuple[float, float, float],
    sigma: list[float],
    center: tuple[float, float],
    omega: float,
    *,
    varies: bool,
) -> str:
    """Say which bias there is, how sure, and what to use instead."""
    off_x, off_y, off_omega = correction
    true = omega - off_omega
    unit = max(abs(true), 1e-12)
    center_sigma = max(sigma[:2])
    parts = []
    if kind in ("omega", "both"):
        if omega * true < 0.0:
            parts.append(f"ω turns the wrong way (by {off_omega:+.3g} ± {sigma[2]:.2g} rad/s)")
        else:
            word = "high" if abs(omega) > abs(true) else "low"
            parts.append(f"ω is {abs(off_omega) / unit:.1%} (± {100 * sigma[2] / unit:.2g}%) too {word}")
    if kind in ("centre", "both"):
        ways = ((off_x, "left", "right"), (off_y, "up", "down"))
        least = 0.3 * math.hypot(off_x, off_y)
        words = [
            f"{abs(off):.1f} px too far {more if off > 0 else less}" for off, less, more in ways if abs(off) >= least
        ]
        parts.append(f"the centre is {' and '.join(words)} (± {center_sigma:.2g} px)")
    if not parts:
        weak = "; a longer horizon would tell more of the centre" if center_sigma > _WEAK_CENTER_PX else ""
        within = abs(bias[2]) + 2.0 * sigma[2], math.hypot(bias[0], bias[1]) + 2.0 * center_sigma
        omega_text = f"ω is right within {100 * within[0] / unit:.2g}%"
        return f"no bias is seen: {omega_text} and the centre within {within[1]:.2g} px{weak}"
    use = f"{center[0] - off_x:.1f},{center[1] - off_y:.1f},{true:.4g}"
    return f"{' and '.join(parts)}: use {use}{' on average' if varies else ''}"
