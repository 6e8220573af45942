"""Describe the sensor: thresholds, their mismatch, dead time, jitter and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import NOISE
from tiegocancel.scene.check import check_number, check_whole

__all__ = ["NOISE_STREAM", "THRESHOLD_STREAM", "SensorConfig", "noise_keys", "thresholds"]

THRESHOLD_STREAM, NOISE_STREAM, HOT_STREAM = 1, 2, 3
"""Second words of the random seeds, so that each use draws numbers of its own."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorConfig:
    """Set the pixel model; thresholds are steps of the natural logarithm of intensity.

    ``mismatch`` is the deviation of each pixel's thresholds as a share of them; ``refractory_us`` holds a pixel in
    reset after an event: about the time that an edge needs to pass, which leaves one event an edge, as in the
    thesis's recording. ``jitter_us`` is the deviation of time stamps, bounded by 2·√3 times as much; it is added last.
    ``noise_hz`` the background activity of one pixel, ``noise_on_share`` the share of ON in it; ``hot_pixels`` of
    the sensor's pixels fire at ``hot_hz`` besides.
    """

    threshold_on: float = 0.21
    threshold_off: float = 0.23
    mismatch: float = 0.03
    refractory_us: float = 2000.0
    jitter_us: float = 30.0
    noise_hz: float = 0.08
    noise_on_share: float = 0.6
    hot_pixels: int = 0
    hot_hz: float = 500.0

    def __post_init__(self) -> None:
        for name in ("threshold_on", "threshold_off"):
            check_number(self, name, 0.01, 10.0)
        check_number(self, "mismatch", 0.0, 0.3)
        check_number(self, "refractory_us", 0.0, 1e6)
        check_number(self, "jitter_us", 0.0, 1e4)
        for name in ("noise_hz", "hot_hz"):
            check_number(self, name, 0.0, 1e5)
        check_number(self, "noise_on_share", 0.0, 1.0)
        check_whole(self, "hot_pixels", 0, 2**20)


def thresholds(
    config: SensorConfig, size: int, seed: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Return ON and OFF thresholds and the first memory's offset from the signal, float32[size] each.

    Mismatch is normal, cut at three deviations. The offset is uniform between the thresholds, as in a pixel that
    has been watching for a while.
    """
    rng = np.random.default_rng([seed, THRESHOLD_STREAM])
    spread = config.mismatch * np.clip(rng.standard_normal((2, size), np.float32), -3.0, 3.0)
    on = np.float32(config.threshold_on) * (1.0 + spread[0])
    off = np.float32(config.threshold_off) * (1.0 + spread[1])
    share = rng.random(size, np.float32)
    offset = share * off - (1.0 - share) * on
    return on.astype(np.float32), off.astype(np.float32), (0.5 * offset).astype(np.float32)


def noise_keys(
    config: SensorConfig, width: int, height: int, block_us: int, block: int, seed: int
) -> NDArray[np.int64]:
    """Return background activity and hot pixels of one block as packed events (see ``kernels.sensor``), unsorted.

    Counts are Poisson; noise leaves the pixel's memory alone. The random seed holds the block's number, so that a
    block is the same whatever ran before it.
    """
    from tiegocancel.kernels.sensor import pack

    rng = np.random.default_rng([seed, NOISE_STREAM, block])
    pixels = rng.integers(0, width * height, rng.poisson(config.noise_hz * width * height * block_us * 1e-6))
    if config.hot_pixels:
        places = np.random.default_rng([seed, HOT_STREAM]).integers(0, width * height, config.hot_pixels)
        hot = np.repeat(places, rng.poisson(config.hot_hz * block_us * 1e-6, config.hot_pixels))
        pixels = np.concatenate([pixels, hot])
    t_us = rng.integers(0, block_us, len(pixels))
    p = rng.random(len(pixels)) < config.noise_on_share
    keys: NDArray[np.int64] = pack(t_us, pixels % width, pixels // width, p, np.full(len(pixels), NOISE))
    return keys
