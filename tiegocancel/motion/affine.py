"""Hold an affine motion that varies with time: pan, roll, zoom and shear as six rates of a velocity field."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiegocancel.motion.generator import displacement, fixed_point_of, rates_of_displacement
from tiegocancel.motion.rotation import MAX_CENTER_PX, MAX_OMEGA_DOT_RAD_S2, MAX_OMEGA_RAD_S
from tiegocancel.motion.rows import blended, carried, checked_rows, time_mean
from tiegocancel.motion.schedule import FRACTION_BITS, MAX_COEFFICIENT, MotionSchedule, fixed_point
from tiegocancel.motion.times import checked_times, schedule_times

__all__ = ["RATE_BOUNDS", "RATE_DOT_BOUNDS", "AffineInterpolation", "AffineParts", "AffineTrajectory"]

AffineInterpolation = Literal["linear", "causal"]
"""Between rows: straight lines, or the last row alone, carried on with its own slope."""

_PAN = MAX_CENTER_PX * MAX_OMEGA_RAD_S
RATE_BOUNDS = np.array([MAX_OMEGA_RAD_S, MAX_OMEGA_RAD_S, _PAN] * 2)
"""Bounds of ``a b c d e f``: those of the fastest rotation about the farthest centre."""
RATE_DOT_BOUNDS = RATE_BOUNDS * (MAX_OMEGA_DOT_RAD_S2 / MAX_OMEGA_RAD_S)
"""Bounds of their slopes per second."""
_FARTHEST = float(1 << 62)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AffineParts:
    """Split the rates about an anchor: ``pan_px_s`` float64[K, 2] is the anchor's own velocity.

    ``roll_rad_s`` float64[K], positive turns x towards y; ``zoom_1_s`` float64[K], positive spreads the image;
    ``shear_1_s`` float64[K, 2]: stretch along x with shrink along y, and the same along the diagonals.
    """

    pan_px_s: NDArray[np.float64]
    roll_rad_s: NDArray[np.float64]
    zoom_1_s: NDArray[np.float64]
    shear_1_s: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AffineTrajectory:
    """Velocity field ``v_x = a·x + b·y + c``, ``v_y = d·x + e·y + f`` at instants, interpolated in between.

    ``t_us`` int64[K], strictly increasing, K ≥ 1, ``|t| ≤ 2^60``; ``rates`` float64[K, 6] are ``a b c d e f`` with
    ``a b d e`` in 1/s within ±1e6 and ``c f`` in px/s within ±1.7e13; ``rates_dot`` float64[K, 6] their slopes per
    second, zeros unless given, serve ``causal`` alone. ``interpolation`` is that of ``RotationTrajectory``: ``linear``
    between rows and held beyond the ends, or ``causal``, the last row carried on along ``rates_dot``. Over a horizon
    the field is frozen at its mean over it, and a point moves by the matrix exponential: exact for constant rates.
    Raise ``ValueError`` naming column, row and value when a check fails.
    """

    t_us: NDArray[np.int64]
    rates: NDArray[np.float64]
    rates_dot: NDArray[np.float64] | None = None
    interpolation: AffineInterpolation = "linear"
    source: str = "constant"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.interpolation not in get_args(AffineInterpolation):
            raise ValueError(f"interpolation must be linear or causal, not {self.interpolation!r}")
        times = checked_times(self.t_us)
        times.flags.writeable = False
        shape = (len(times), 6)
        slopes = np.zeros(shape) if self.rates_dot is None else self.rates_dot
        object.__setattr__(self, "t_us", times)
        object.__setattr__(self, "rates", checked_rows("rates", self.rates, shape, RATE_BOUNDS))
        object.__setattr__(self, "rates_dot", checked_rows("rates_dot", slopes, shape, RATE_DOT_BOUNDS))
        object.__setattr__(self, "notes", tuple(self.notes))

    @classmethod
    def constant(cls, rates: ArrayLike, *, t_us: int = 0, source: str = "constant") -> AffineTrajectory:
        """Return one field, ``a b c d e f``, for all time."""
        table = np.asarray(rates, np.float64)
        return cls(t_us=np.array([t_us], np.int64), rates=table[None, :] if table.ndim == 1 else table, source=source)

    @classmethod
    def from_schedule(cls, schedule: MotionSchedule, horizon_us: int, *, source: str = "schedule") -> AffineTrajectory:
        """Return the fields whose displacements over ``horizon_us`` are a schedule's, each held until the next.

        Entries that predict beyond every sensor, and a horizon of 0, count as rest.
        """
        last = np.append(schedule.t_us[1:] != schedule.t_us[:-1], True)
        table = schedule.coefficients[last] / float(1 << FRACTION_BITS)
        known = (np.abs(schedule.coefficients[last]) < MAX_COEFFICIENT).all(axis=1) & (horizon_us > 0)
        rates = np.zeros(table.shape)
        rates[known] = rates_of_displacement(table[known], max(horizon_us, 1) * 1e-6)
        return cls(t_us=schedule.t_us[last], rates=rates, interpolation="causal", source=source)

    @classmethod
    def from_parts(
        cls,
        anchor_px: tuple[float, float],
        *,
        pan_px_s: ArrayLike = (0.0, 0.0),
        roll_rad_s: ArrayLike = 0.0,
        zoom_1_s: ArrayLike = 0.0,
        shear_1_s: ArrayLike = (0.0, 0.0),
        t_us: ArrayLike = (0,),
        interpolation: AffineInterpolation = "linear",
        source: str = "constant",
    ) -> AffineTrajectory:
        """Return the motion made of parts about ``anchor_px``; see :class:`AffineParts`.

        Each part is one value for all rows or K of them for ``t_us`` int64[K].
        """
        times = np.asarray(t_us)
        pan, shear = (np.broadcast_to(np.asarray(v, np.float64), (len(times), 2)) for v in (pan_px_s, shear_1_s))
        roll, zoom = (np.broadcast_to(np.asarray(v, np.float64), (len(times),)) for v in (roll_rad_s, zoom_1_s))
        a, e = zoom + shear[:, 0], zoom - shear[:, 0]
        b, d = shear[:, 1] - roll, shear[:, 1] + roll
        x, y = anchor_px
        rates = np.column_stack([a, b, pan[:, 0] - a * x - b * y, d, e, pan[:, 1] - d * x - e * y])
        return cls(t_us=times, rates=rates, interpolation=interpolation, source=source)

    @classmethod
    def from_csv(cls, path: str | Path) -> AffineTrajectory:
        """Read ``timestamp, rate_a … rate_f``; see :mod:`tiegocancel.motion.trajectory_csv`."""
        from tiegocancel.motion.trajectory_csv import read_affine

        return read_affine(path)

    def to_csv(self, path: str | Path) -> None:
        """Write ``timestamp, rate_a … rate_f``, and their slopes where they count; reads back the same numbers."""
        from tiegocancel.motion.trajectory_csv import write_affine

        write_affine(self, path)

    def __len__(self) -> int:
        return len(self.t_us)

    def parts(self, anchor_px: tuple[float, float]) -> AffineParts:
        """Split the rows' rates about ``anchor_px``: the inverse of :meth:`from_parts`."""
        a, b, c, d, e, f = self.rates.T
        x, y = anchor_px
        return AffineParts(
            pan_px_s=np.column_stack([a * x + b * y + c, d * x + e * y + f]),
            roll_rad_s=0.5 * (d - b),
            zoom_1_s=0.5 * (a + e),
            shear_1_s=np.column_stack([0.5 * (a - e), 0.5 * (b + d)]),
        )

    def at(self, t_us: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return ``a b c d e f`` float64[n, 6] at times int64[n] in µs; any chunking gives the same bits."""
        return self._at(np.asarray(t_us, np.int64))[0]

    def displacements(self, t_us: NDArray[np.int64], horizon_us: int) -> NDArray[np.float64]:
        """Return ``a b c d e f`` float64[n, 6] (1 and px) of the displacement within ``horizon_us`` of each time.

        Raise ``ValueError`` when the image would grow without bounds: rates with a wrong unit.
        """
        rates, slopes = self._at(np.asarray(t_us, np.int64))
        horizon_s = horizon_us * 1e-6
        return displacement(rates + slopes * (0.5 * horizon_s), horizon_s)

    def predict(
        self, t_us: NDArray[np.int64], x: NDArray[np.uint16], y: NDArray[np.uint16], horizon_us: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where events are expected ``horizon_us`` later, int64[n] each; may lie outside, at most ±2^62.

        The float path: displace in float64 by the motion at the event's own time, round with ``floor(v + 0.5)``. Any
        chunking of the events gives the same numbers.
        """
        # A steady field is raised to its exponential once, not for each event.
        steady = len(self) == 1 and self.interpolation == "linear"
        a, b, c, d, e, f = self.displacements(self.t_us if steady else t_us, horizon_us).T
        right, down = x.astype(np.float64), y.astype(np.float64)
        return _rounded(right + (a * right + b * down + c)), _rounded(down + (d * right + e * down + f))

    def schedule(
        self, horizon_us: int, *, start_us: int | None = None, stop_us: int | None = None, step_us: int = 1000
    ) -> MotionSchedule:
        """Return the fixed-point schedule for one horizon, an entry every ``step_us`` from start to stop inclusive.

        Start and stop are clipped as those of ``RotationTrajectory.schedule`` are.
        """
        times = schedule_times(self.t_us, horizon_us, start_us, stop_us, step_us, causal=self.interpolation == "causal")
        return MotionSchedule(times, fixed_point(self.displacements(times, horizon_us)), horizon_us)

    def reversed(self) -> AffineTrajectory:
        """Return the same path run the other way: a control."""
        return self._times(-1.0, "reversed")

    def stopped(self) -> AffineTrajectory:
        """Return the same path at rest: the control that predicts "same place"."""
        return self._times(0.0, "stopped")

    def noted(self, *notes: str) -> AffineTrajectory:
        """Return the same motion with more remarks."""
        return replace(self, notes=(*self.notes, *notes))

    def mean(
        self, *, start_us: int | None = None, stop_us: int | None = None
    ) -> tuple[tuple[float, float] | None, float]:
        """Return the point at rest in the mean field, ``None`` where nothing rests, and the mean roll in rad/s."""
        rates = time_mean(self.t_us, self.at, start_us, stop_us)
        return fixed_point_of(rates, MAX_CENTER_PX), float(0.5 * (rates[3] - rates[1]))

    def described(self, *, start_us: int, stop_us: int) -> str:
        """Say the mean motion in words and numbers."""
        mean = AffineTrajectory.constant(time_mean(self.t_us, self.at, start_us, stop_us))
        center, roll = mean.mean()
        parts = mean.parts((0.0, 0.0))
        pan, shear, zoom = parts.pan_px_s[0], parts.shear_1_s[0], float(parts.zoom_1_s[0])
        place = (
            f"pan ({pan[0]:+.1f}, {pan[1]:+.1f}) px/s at (0, 0)"
            if center is None
            else f"at rest in ({center[0]:.1f}, {center[1]:.1f}) px"
        )
        return f"{place}, ω {roll:+.4f} rad/s, zoom {zoom:+.4f} 1/s, shear ({shear[0]:+.4f}, {shear[1]:+.4f}) 1/s"

    def _times(self, factor: float, word: str) -> AffineTrajectory:
        """Return the same path at ``factor`` times the speed."""
        assert self.rates_dot is not None  # filled in __post_init__
        # Added to zero, so that a motion at rest holds no −0.
        return replace(
            self,
            rates=factor * self.rates + 0.0,
            rates_dot=factor * self.rates_dot + 0.0,
            source=f"{self.source}, {word}",
        )

    def _at(self, times: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the rates and the slopes that a horizon is extrapolated with, float64[n, 6] each."""
        if self.interpolation == "causal":
            assert self.rates_dot is not None  # filled in __post_init__
            return carried(self.t_us, self.rates, self.rates_dot, times)
        return blended(self.t_us, self.rates, times), np.zeros((1, 6))


def _rounded(place_px: NDArray[np.float64]) -> NDArray[np.int64]:
    """Round half up, staying inside 64 bits."""
    return np.floor(np.clip(place_px, -_FARTHEST, _FARTHEST) + 0.5).astype(np.int64)
