"""Find the bias of a gyroscope while it rests: at once over a recording, or causally along a stream."""

from __future__ import annotations

import itertools
import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.inertial.gyro import GyroSamples, image_omega

__all__ = ["GyroBias", "Rest", "RestConfig", "RestingBias", "Rests", "estimate_bias"]

_PARTS = 4
_LAGS = 200
_LEAST_SIGMA_RAD_S = 0.002


@dataclass(frozen=True, slots=True, kw_only=True)
class RestConfig:
    """Say when a gyroscope rests: for ``window_us`` no axis varies by more than ``max_sigma_rad_s``.

    At a steady turn the rate does not vary either, so a mean beyond ``max_bias_rad_s`` is no rest; a slower steady turn
    cannot be told from a bias by the gyroscope alone. The windows start every quarter of ``window_us`` and need
    ``least_samples``. ``memory_us`` of rest is what the causal variant averages over, so that it can follow a drift.

    The limits fit MEMS gyroscopes: an MPU-6500 at rest varied by 0.0018 rad/s, its bias was 0.013 rad/s, and its
    data sheet allows ±0.09 rad/s at 25 °C.
    """

    window_us: int = 200_000
    max_sigma_rad_s: float = 0.01
    max_bias_rad_s: float = 0.2
    least_samples: int = 12
    memory_us: int = 10_000_000

    def __post_init__(self) -> None:
        if self.window_us < _PARTS:
            raise ValueError(f"window_us must be at least {_PARTS} µs, not {self.window_us}")
        for name in ("max_sigma_rad_s", "max_bias_rad_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, not {getattr(self, name)}")
        if self.least_samples < _PARTS:
            raise ValueError(f"least_samples must be at least {_PARTS}, not {self.least_samples}")
        if self.memory_us < self.window_us:
            raise ValueError(f"memory_us must be at least window_us ({self.window_us} µs), not {self.memory_us}")

    @property
    def part_us(self) -> int:
        """A quarter of the window."""
        return self.window_us // _PARTS


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class GyroBias:
    """Bias per axis, float64[3] in rad/s, with one standard deviation (∞, and a bias of 0, where no rest was found).

    ``noise_rad_s`` float64[3] is the standard deviation of one sample at rest. ``rests_us`` lists start and stop of
    each rest. ``text`` says in one line what was found.
    """

    bias_rad_s: NDArray[np.float64]
    sigma_rad_s: NDArray[np.float64]
    noise_rad_s: NDArray[np.float64]
    rests_us: tuple[tuple[int, int], ...]
    text: str

    @property
    def found(self) -> bool:
        """Tell whether there was a rest."""
        return bool(self.rests_us)


def estimate_bias(samples: GyroSamples, config: RestConfig | None = None) -> GyroBias:
    """Average all rests of a recording; samples beyond 4 σ (a knock) are left out.

    The deviation of the mean allows for samples that hang together: a low-pass filter in the device spreads each
    over several.
    """
    config = config or RestConfig()
    count, mean, square, start = _parts(samples, config)
    resting = np.zeros(len(count), np.bool_)
    calmest, at = math.inf, 0
    for first in range(len(count) - _PARTS + 1):
        part = slice(first, first + _PARTS)
        rest, spread = _at_rest(count[part], mean[part], square[part], config)
        if spread < calmest:
            calmest, at = spread, first
        if rest:
            resting[part] = True
    unknown = np.full(3, math.inf)
    if not resting.any():
        if not math.isfinite(calmest):
            why = f"no {config.window_us * 1e-6:g} s of samples without a gap"
        else:
            away = np.abs(mean[at : at + _PARTS].mean(axis=0)).max()
            why = f"the calmest {config.window_us * 1e-6:g} s vary by {calmest:.2g} rad/s about {away:.2g} rad/s"
        text = f"no rest was found: {why} (limits {config.max_sigma_rad_s:g} and {config.max_bias_rad_s:g} rad/s)"
        return GyroBias(bias_rad_s=np.zeros(3), sigma_rad_s=unknown, noise_rad_s=unknown, rests_us=(), text=text)
    kept = samples.rate_rad_s[np.repeat(resting, count.astype(np.int64))]
    bias, sigma, noise = np.zeros(3), np.zeros(3), np.zeros(3)
    for axis in range(3):
        bias[axis], sigma[axis], noise[axis] = _robust_mean(kept[:, axis])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], resting, [False]])))
    rests = tuple(
        (int(start[first]), int(start[stop - 1]) + config.part_us)
        for first, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    )
    seconds = sum(stop - first for first, stop in rests) * 1e-6
    values = ", ".join(f"{value:+.5f} ± {error:.1g}" for value, error in zip(bias, sigma, strict=True))
    text = f"bias ({values}) rad/s from {len(rests)} rest(s), {seconds:.2f} s together"
    return GyroBias(bias_rad_s=bias, sigma_rad_s=sigma, noise_rad_s=noise, rests_us=rests, text=text)


@dataclass(frozen=True, slots=True)
class Rest:
    """What rests up to ``t_us`` tell of the bias of the image's ω (:func:`image_omega`), and one standard deviation."""

    t_us: int
    image_bias_rad_s: float
    image_sigma_rad_s: float


class Rests:
    """Tell a filter what rests say of the bias, causally; borders of chunks change nothing."""

    def __init__(self, config: RestConfig | None = None) -> None:
        self._follower = RestingBias(config)

    def process(self, t_us: NDArray[np.int64], rate_rad_s: NDArray[np.float64]) -> dict[int, Rest]:
        """Take samples int64[n], float64[n, 3]; return what is told at each that completes a rest, by time.

        At most one a quarter of ``window_us``, each of samples before its time. They repeat what those before them
        told, so none is taken as better than 0.002 rad/s.
        """
        follower = self._follower
        index = np.asarray(t_us, np.int64) // follower.config.part_us
        firsts = np.flatnonzero(np.diff(index, prepend=index[:1] - 1)).tolist()
        rests: dict[int, Rest] = {}
        for first, stop in itertools.pairwise([*firsts, len(index)]):
            before = follower.bias_rad_s
            follower.process(t_us[first:stop], rate_rad_s[first:stop])
            if follower.found and not np.array_equal(before, follower.bias_rad_s):
                at_us = int(t_us[first])
                sigma = max(float(follower.sigma_rad_s[2]), _LEAST_SIGMA_RAD_S)
                rests[at_us] = Rest(at_us, float(image_omega(follower.bias_rad_s[None])[0]), sigma)
        return rests


class RestingBias:
    """Follow the bias causally: each row uses samples up to its own time alone; borders of chunks change nothing.

    State: four parts of a window and one running mean, whatever the length of the stream.
    """

    def __init__(self, config: RestConfig | None = None) -> None:
        self.config = config or RestConfig()
        self._window: deque[tuple[int, int, NDArray[np.float64], NDArray[np.float64], bool]] = deque(maxlen=_PARTS)
        self._index: int | None = None
        self._count = 0
        self._sum = np.zeros(3)
        self._square = np.zeros(3)
        self._weight = 0.0
        self._mean = np.zeros(3)
        self._noise = np.full(3, math.inf)

    @property
    def found(self) -> bool:
        """Tell whether a rest has been seen."""
        return self._weight > 0.0

    @property
    def bias_rad_s(self) -> NDArray[np.float64]:
        """The bias as known now, float64[3] in rad/s; zeros before the first rest."""
        return self._mean.copy()

    @property
    def sigma_rad_s(self) -> NDArray[np.float64]:
        """One standard deviation of it, float64[3]; ∞ before the first rest.

        Counted as if three samples were worth one, because devices filter.
        """
        return self._noise * math.sqrt(3.0 / self._weight) if self.found else np.full(3, math.inf)

    def process(self, t_us: NDArray[np.int64], rate_rad_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take samples int64[n], float64[n, 3]; return the bias float64[n, 3] known at each."""
        known = np.empty((len(t_us), 3))
        indices = np.asarray(t_us, np.int64) // self.config.part_us
        for row, (index, rate) in enumerate(zip(indices.tolist(), rate_rad_s, strict=True)):
            if index != self._index:
                self._close()
                self._index = index
            self._count += 1
            self._sum += rate
            self._square += rate * rate
            known[row] = self._mean
        return known

    def _close(self) -> None:
        """Finish the part that is open: where it completes a window at rest, take what was not yet taken."""
        if self._index is None:
            return
        mean = self._sum / self._count
        square = np.maximum(self._square / self._count - mean * mean, 0.0)
        if self._window and self._window[-1][0] != self._index - 1:
            self._window.clear()
        self._window.append((self._index, self._count, mean, square, False))
        self._count, self._sum, self._square = 0, np.zeros(3), np.zeros(3)
        if len(self._window) < _PARTS:
            return
        count = np.array([part[1] for part in self._window], np.float64)
        means = np.array([part[2] for part in self._window])
        squares = np.array([part[3] for part in self._window])
        if not _at_rest(count, means, squares, self.config)[0]:
            return
        for place, part in enumerate(self._window):
            if not part[4]:
                self._take(*part[1:4])
                self._window[place] = (*part[:4], True)

    def _take(self, count: int, mean: NDArray[np.float64], square: NDArray[np.float64]) -> None:
        limit = count * self.config.memory_us / self.config.part_us
        self._weight = min(self._weight + count, limit)
        share = min(count / self._weight, 1.0)
        self._mean = self._mean + share * (mean - self._mean)
        noise = np.sqrt(square)
        self._noise = noise if not np.isfinite(self._noise).all() else self._noise + share * (noise - self._noise)


def _parts(
    samples: GyroSamples, config: RestConfig
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Cut a recording into quarters of windows; those without samples break the chain with a count of 0.

    Return per part the count, mean [3], variance [3] and the start in µs.
    """
    index = samples.t_us // config.part_us
    firsts = np.flatnonzero(np.diff(index, prepend=index[0] - 1))
    count = np.diff(np.append(firsts, len(index))).astype(np.float64)
    mean = np.add.reduceat(samples.rate_rad_s, firsts) / count[:, None]
    away = samples.rate_rad_s - np.repeat(mean, count.astype(np.int64), axis=0)
    square = np.add.reduceat(away * away, firsts) / count[:, None]
    own = index[firsts]
    # A gap is one part without samples between its neighbours: a window across it never has enough of them.
    gaps = np.flatnonzero(np.diff(own) > 1) + 1
    return (
        np.insert(count, gaps, 0.0),
        np.insert(mean, gaps, math.nan, axis=0),
        np.insert(square, gaps, math.nan, axis=0),
        np.insert(own, gaps, own[gaps] - 1) * config.part_us,
    )


def _at_rest(
    count: NDArray[np.float64], mean: NDArray[np.float64], square: NDArray[np.float64], config: RestConfig
) -> tuple[bool, float]:
    """Tell whether the parts of one window rest, and the largest standard deviation of an axis (∞ across a gap)."""
    total = float(count.sum())
    if total < config.least_samples or not (count > 0).all():
        return False, math.inf
    share = (count / total)[:, None]
    middle = (share * mean).sum(axis=0)
    variance = (share * (square + (mean - middle) ** 2)).sum(axis=0)
    spread = float(np.sqrt(variance).max())
    return spread <= config.max_sigma_rad_s and float(np.abs(middle).max()) <= config.max_bias_rad_s, spread


def _robust_mean(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the mean without outliers, its standard deviation, and that of one value."""
    middle = float(np.median(values))
    scale = 1.4826 * float(np.median(np.abs(values - middle)))
    # Where half of the values are equal (a coarse converter) their deviation says nothing of the rest.
    near = np.abs(values - middle) <= (4.0 * scale if scale > 0.0 else math.inf)
    kept = values[near]
    mean = float(kept.mean())
    away = kept - mean
    variance = float((away * away).mean())
    together = 1.0
    for lag in range(1, min(_LAGS, len(away) // 4)):
        correlation = float((away[lag:] * away[:-lag]).mean()) / variance if variance > 0.0 else 0.0
        if correlation < 0.05:
            break
        together += 2.0 * correlation
    return mean, math.sqrt(variance * together / len(kept)), math.sqrt(variance)
