"""Hold what a gyroscope measured, in the camera's frame, and say how the image turns under it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiegocancel.motion.rotation import MAX_OMEGA_RAD_S
from tiegocancel.motion.times import checked_times

__all__ = ["GyroSamples", "axes_matrix", "image_omega"]

_ROUNDING = 1e-6


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class GyroSamples:
    """Angular velocity of the camera at instants.

    ``t_us`` int64[N] in µs, strictly increasing, N ≥ 1; ``rate_rad_s`` float64[N, 3] within ±1e6 rad/s about x
    (right), y (down) and z (along the optical axis, forward) by the right-hand rule: about z, positive turns the camera
    from x towards y, clockwise seen from behind. ``source`` names the origin in reports, ``notes`` are remarks for the
    user. Between samples the rate is a straight line, and beyond the ends it is held. Columns are read-only. Raise
    ``ValueError`` naming column, row and value when a check fails.
    """

    t_us: NDArray[np.int64]
    rate_rad_s: NDArray[np.float64]
    source: str = "gyro"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        times = checked_times(self.t_us)
        rates = np.array(self.rate_rad_s, np.float64)
        if rates.shape != (len(times), 3):
            raise ValueError(f"rate_rad_s must be float64[{len(times)}, 3], not of shape {rates.shape}")
        # Written with "not", because a comparison with NaN is false.
        wrong = ~(np.abs(rates) <= MAX_OMEGA_RAD_S)
        if wrong.any():
            row, axis = (int(index) for index in np.argwhere(wrong)[0])
            raise ValueError(
                f"rate_rad_s must be finite and within ±{MAX_OMEGA_RAD_S:g}: row {row} has {rates[row, axis]} about "
                f"{'xyz'[axis]}"
            )
        for name, column in (("t_us", times), ("rate_rad_s", rates)):
            column.flags.writeable = False
            object.__setattr__(self, name, column)
        object.__setattr__(self, "notes", tuple(self.notes))

    @classmethod
    def from_unsorted(
        cls, t_us: ArrayLike, rate_rad_s: ArrayLike, *, source: str, notes: Iterable[str] = ()
    ) -> GyroSamples:
        """Sort rows by time, stably, average those of one µs, and note how many of each there were."""
        times, rates = np.asarray(t_us, np.int64), np.asarray(rate_rad_s, np.float64)
        remarks = list(notes)
        late = int(np.count_nonzero(times < np.maximum.accumulate(times))) if len(times) else 0
        if late:
            order = np.argsort(times, kind="stable")
            times, rates = times[order], rates[order]
            remarks.append(f"rows were not in the order of time: {late} of {len(times)} moved")
        firsts = np.flatnonzero(np.diff(times, prepend=times[0] - 1)) if len(times) else np.zeros(0, np.int64)
        if len(firsts) < len(times):
            remarks.append(f"{len(times)} rows at {len(firsts)} instants: the mean of each was taken")
            counts = np.diff(np.append(firsts, len(times)))
            times, rates = times[firsts], np.add.reduceat(rates, firsts) / counts[:, None]
        return cls(t_us=times, rate_rad_s=rates, source=source, notes=tuple(remarks))

    def __len__(self) -> int:
        return len(self.t_us)

    @property
    def period_us(self) -> float:
        """Median time between samples in µs; NaN for a single one."""
        return float(np.median(np.diff(self.t_us))) if len(self) > 1 else float("nan")

    def at(self, t_us: ArrayLike) -> NDArray[np.float64]:
        """Return the rate float64[n, 3] in rad/s at times in µs (fractions count), interpolated and held."""
        # Relative to the first sample, because µs since 1970 leave a float64 only a quarter of a µs.
        origin = self.t_us[0]
        when = np.asarray(t_us)
        when = when - origin if when.dtype.kind in "iu" else when - float(origin)
        own = (self.t_us - origin).astype(np.float64)
        rates = np.empty((*when.shape, 3))
        for axis in range(3):
            rates[..., axis] = np.interp(when, own, self.rate_rad_s[:, axis])
        return rates

    def resampled(self, t_us: ArrayLike) -> GyroSamples:
        """Return the rates at other times int64[M] in µs, strictly increasing."""
        times = checked_times(t_us)
        return replace(self, t_us=times, rate_rad_s=self.at(times))

    def between(self, start_us: int, stop_us: int) -> GyroSamples:
        """Return the samples with ``start_us ≤ t < stop_us``; raise ``ValueError`` when there are none."""
        first, last = np.searchsorted(self.t_us, [start_us, stop_us], side="left")
        if first >= last:
            raise ValueError(
                f"no gyro sample from {start_us} to {stop_us} µs: they span {self.t_us[0]}…{self.t_us[-1]}"
            )
        return replace(self, t_us=self.t_us[first:last], rate_rad_s=self.rate_rad_s[first:last])

    def mean(self, start_us: int, stop_us: int) -> NDArray[np.float64]:
        """Return the rate float64[3] in rad/s averaged over the time from start to stop; of an instant, its rate."""
        if stop_us < start_us:
            raise ValueError(f"stop_us must not lie before start_us: {stop_us} µs after {start_us} µs")
        if stop_us == start_us:
            return self.at(np.array([start_us])).reshape(3)
        inner = self.t_us[(self.t_us > start_us) & (self.t_us < stop_us)]
        knots = np.concatenate([[start_us], inner, [stop_us]]).astype(np.int64)
        rates = self.at(knots)
        steps = np.diff(knots).astype(np.float64)[:, None]
        mean: NDArray[np.float64] = (0.5 * (rates[1:] + rates[:-1]) * steps).sum(axis=0) / steps.sum()
        return mean

    def minus(self, bias_rad_s: ArrayLike) -> GyroSamples:
        """Return the samples less a bias: float[3] in rad/s, or float[N, 3], a bias for each sample."""
        return replace(self, rate_rad_s=self.rate_rad_s - np.asarray(bias_rad_s, np.float64))

    def shifted(self, offset_us: float) -> GyroSamples:
        """Return the samples stamped ``offset_us`` later, rounded to whole µs."""
        return replace(self, t_us=self.t_us + round(offset_us))

    def rotated(self, axes: str | ArrayLike) -> GyroSamples:
        """Return the samples in other axes: a map such as ``"-x,y,-z"`` (see :func:`axes_matrix`) or a matrix [3, 3].

        A matrix takes a rate of the device to the camera's frame and must be orthonormal. A determinant of −1 is
        allowed: some devices count turns against the right-hand rule.
        """
        matrix = axes_matrix(axes) if isinstance(axes, str) else np.asarray(axes, np.float64)
        if matrix.shape != (3, 3) or not np.abs(matrix @ matrix.T - np.eye(3)).max() <= _ROUNDING:
            raise ValueError(f"axes must be an orthonormal matrix [3, 3], not {matrix.tolist()}")
        return replace(self, rate_rad_s=self.rate_rad_s @ matrix.T)

    def noted(self, *notes: str) -> GyroSamples:
        """Return the same samples with more remarks."""
        return replace(self, notes=(*self.notes, *notes))

    @staticmethod
    def concatenate(parts: Iterable[GyroSamples]) -> GyroSamples:
        """Join consecutive stretches of one gyroscope; source and notes are those of the first."""
        joined = list(parts)
        if not joined:
            raise ValueError("concatenate needs at least one stretch of samples")
        return replace(
            joined[0],
            t_us=np.concatenate([part.t_us for part in joined]),
            rate_rad_s=np.concatenate([part.rate_rad_s for part in joined]),
        )


def axes_matrix(text: str) -> NDArray[np.float64]:
    """Return the matrix [3, 3] of an axis map: which axis of the device each axis of the camera reads.

    ``"x,y,z"`` changes nothing; ``"y,-x,z"`` says that the camera's x is the device's y and the camera's y its −x.
    Raise ``ValueError`` for anything but each of x, y, z once, each with an optional sign.
    """
    matrix = np.zeros((3, 3))
    cells = [cell.strip().lower() for cell in text.split(",")]
    if sorted(cell.removeprefix("-").removeprefix("+") for cell in cells) != ["x", "y", "z"]:
        raise ValueError(f"axes must name each of x, y, z once, such as x,-y,z, not {text!r}")
    for row, cell in enumerate(cells):
        matrix[row, "xyz".index(cell[-1])] = -1.0 if cell.startswith("-") else 1.0
    return matrix


def image_omega(gyro: GyroSamples | NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the in-plane ω of the image in rad/s, float64[N]; positive turns image x towards y.

    A static point at ``X`` moves in the camera's frame with ``−Ω × X``. For a camera that turns about its optical axis
    alone, ``Ω = (0, 0, Ω_z)``, that is ``(Ω_z·Y, −Ω_z·X, 0)``: a point on the x axis moves towards −y. So the image
    turns by ``ω = −Ω_z`` about the principal point. Turns about x and y shift and shear the image, outside of ω.
    """
    rates = gyro.rate_rad_s if isinstance(gyro, GyroSamples) else np.asarray(gyro, np.float64)
    omega: NDArray[np.float64] = 0.0 - rates[:, 2]
    return omega
