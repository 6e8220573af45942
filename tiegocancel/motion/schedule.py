"""Carry the motion as affine coefficients in fixed point: what kernel, simulator, RTL and firmware share."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "FRACTION_BITS",
    "MAX_COEFFICIENT",
    "MotionSchedule",
    "fixed_point",
    "rotation_coefficients",
    "turn_coefficients",
]

FRACTION_BITS = 16
MAX_COEFFICIENT = 1 << 44
"""Bound of a coefficient: products with a 16-bit coordinate and their sum stay inside 64 bits."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionSchedule:
    """Displacement over one horizon, as six integers for each time.

    ``t_us`` int64[K], never decreasing, K ≥ 1; ``coefficients`` int64[K, 6] are ``a b c d e f`` with
    16 fractional bits: ``x' = ((x << 16) + a·x + b·y + c + 32768) >> 16``, ``y'`` the same with ``d e f``
    (arithmetic shift). An event at ``t`` uses the last entry with ``t_us ≤ t``, the first one before that.
    ``horizon_us`` is the horizon that the displacements are for; ``None`` serves any, as zero motion does.
    Raise ``ValueError`` when shapes, order or the bound ``|value| ≤ 2^44`` are broken.
    """

    t_us: NDArray[np.int64]
    coefficients: NDArray[np.int64]
    horizon_us: int | None = None

    def __post_init__(self) -> None:
        times = _integers("t_us", self.t_us)
        table = _integers("coefficients", self.coefficients)
        if times.ndim != 1 or len(times) == 0:
            raise ValueError(f"t_us must be int64[K] with K ≥ 1, not of shape {times.shape}")
        if table.shape != (len(times), 6):
            raise ValueError(f"coefficients must be int64[{len(times)}, 6] (a b c d e f), not of shape {table.shape}")
        if (times[1:] < times[:-1]).any():
            row = int(np.argmax(times[1:] < times[:-1])) + 1
            raise ValueError(f"t_us must not decrease: row {row} has {times[row]} µs after {times[row - 1]} µs")
        beyond = ((table > MAX_COEFFICIENT) | (table < -MAX_COEFFICIENT)).any(axis=1)
        if beyond.any():
            row = int(np.argmax(beyond))
            raise ValueError(f"coefficients must lie within ±2^44: row {row} has {table[row].tolist()}")
        if self.horizon_us is not None and self.horizon_us < 0:
            raise ValueError(f"horizon_us must not be negative, not {self.horizon_us}")
        for name, column in (("t_us", times), ("coefficients", table)):
            column.flags.writeable = False
            object.__setattr__(self, name, column)

    @classmethod
    def rotation(
        cls, *, center_px: tuple[float, float], omega_rad_s: float, horizon_us: int, t_us: int = 0
    ) -> MotionSchedule:
        """Return a constant rotation about ``center_px`` = (cx, cy); a positive ω turns x towards y."""
        if horizon_us < 0:
            raise ValueError(f"horizon_us must not be negative, not {horizon_us}")
        row = rotation_coefficients(center_px[0], center_px[1], omega_rad_s, horizon_us)
        return cls(np.array([t_us], np.int64), row[None, :], horizon_us)

    @classmethod
    def still(cls) -> MotionSchedule:
        """Return the schedule that predicts "same place": the control of zero motion."""
        return cls(np.zeros(1, np.int64), np.zeros((1, 6), np.int64))

    @classmethod
    def unknown(cls, t_us: int = 0) -> MotionSchedule:
        """Return the schedule of an unknown motion: it predicts beyond every sensor, so nothing is suppressed."""
        return cls(np.array([t_us], np.int64), np.array([[0, 0, MAX_COEFFICIENT, 0, 0, MAX_COEFFICIENT]], np.int64))

    def __len__(self) -> int:
        return len(self.t_us)

    def entry_at(self, t_us: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the row int64[n] that each time int64[n] uses."""
        return np.maximum(np.searchsorted(self.t_us, t_us, side="right") - 1, 0)

    def serve(self, horizon_us: int) -> None:
        """Raise ``ValueError`` when the displacements were made for another horizon."""
        if self.horizon_us not in (None, horizon_us):
            raise ValueError(f"the schedule was made for a horizon of {self.horizon_us} µs, not of {horizon_us} µs")

    def predict(
        self, t_us: NDArray[np.int64], x: NDArray[np.uint16], y: NDArray[np.uint16], horizon_us: int | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where events at ``(x, y)`` are expected one horizon later, int64[n] each; may lie outside.

        Raise ``ValueError`` when ``horizon_us`` is given and the schedule was made for another.
        """
        if horizon_us is not None:
            self.serve(horizon_us)
        a, b, c, d, e, f = self.coefficients[self.entry_at(t_us)].T
        column, row = x.astype(np.int64), y.astype(np.int64)
        half = 1 << (FRACTION_BITS - 1)
        ahead_x = ((column << FRACTION_BITS) + a * column + b * row + c + half) >> FRACTION_BITS
        ahead_y = ((row << FRACTION_BITS) + d * column + e * row + f + half) >> FRACTION_BITS
        return ahead_x, ahead_y


def rotation_coefficients(
    center_x_px: ArrayLike, center_y_px: ArrayLike, omega_rad_s: ArrayLike, horizon_us: int
) -> NDArray[np.int64]:
    """Return ``a b c d e f`` int64[..., 6] of a rotation by ``ω·Δt``, each rounded to the nearest of 2^-16.

    ``a = e = cosθ − 1``, ``b = −sinθ``, ``d = sinθ``, ``c = cx(1 − cosθ) + cy·sinθ``,
    ``f = cy(1 − cosθ) − cx·sinθ``.
    """
    cx, cy, omega = np.broadcast_arrays(
        np.asarray(center_x_px, np.float64),
        np.asarray(center_y_px, np.float64),
        np.asarray(omega_rad_s, np.float64),
    )
    if not (np.isfinite(cx).all() and np.isfinite(cy).all() and np.isfinite(omega).all()):
        raise ValueError("centre and angular velocity must be finite")
    return turn_coefficients(cx, cy, omega * (horizon_us * 1e-6))


def turn_coefficients(center_x_px: ArrayLike, center_y_px: ArrayLike, theta_rad: ArrayLike) -> NDArray[np.int64]:
    """Return ``a b c d e f`` int64[..., 6] of a rotation by ``theta_rad``; see :func:`rotation_coefficients`."""
    cx, cy, theta = (np.asarray(value, np.float64) for value in (center_x_px, center_y_px, theta_rad))
    shrink, sine = np.cos(theta) - 1.0, np.sin(theta)
    shift_x = -cx * shrink + cy * sine
    shift_y = -cy * shrink - cx * sine
    exact = np.stack(np.broadcast_arrays(shrink, -sine, shift_x, sine, shrink, shift_y), axis=-1)
    return fixed_point(exact)


def fixed_point(displacement: NDArray[np.float64]) -> NDArray[np.int64]:
    """Round displacements ``a b c d e f`` float64[..., 6] (1 and px) to the nearest multiple of 2^-16."""
    scaled = displacement * float(1 << FRACTION_BITS)
    if scaled.size and not float(np.abs(scaled).max()) <= MAX_COEFFICIENT:
        row = displacement.reshape(-1, 6)[int(np.argmax(np.abs(scaled).reshape(-1, 6).max(axis=-1)))]
        raise ValueError(f"a motion is too far away for 44-bit coefficients: displacement {row.tolist()}")
    return np.floor(scaled + 0.5).astype(np.int64)


def _integers(name: str, values: ArrayLike) -> NDArray[np.int64]:
    """Copy to int64, refusing floats that are not whole."""
    given = np.asarray(values)
    if given.dtype.kind == "f":
        if not (
            np.isfinite(given).all() and (given == np.floor(given)).all() and (np.abs(given) < math.ldexp(1, 62)).all()
        ):
            raise ValueError(f"{name} must be whole numbers; floats are rounded by rotation_coefficients, not here")
    elif given.dtype.kind not in "biu":
        raise ValueError(f"{name} must be integers, not {given.dtype}")
    elif given.dtype.kind == "u" and given.size and int(given.max()) > np.iinfo(np.int64).max:
        raise ValueError(f"{name} must fit 64 bits with a sign, not {given.max()}")
    return np.array(given, np.int64)
