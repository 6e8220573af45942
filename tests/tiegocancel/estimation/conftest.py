"""Events of points that turn about a centre, for tests of the fit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tiegocancel.events import Events


@pytest.fixture(scope="session")
def turning() -> Callable[..., Events]:
    """Return a maker of events: points of either polarity that turn at ω about a centre, and noise.

    They start anywhere on the sensor, widened by ``reach`` of its size on each side.
    """

    def make(
        center_px: tuple[float, float] = (150.0, 110.0),
        omega_rad_s: float = 5.0,
        *,
        span_us: int = 50_000,
        count: int = 20_000,
        points: int = 250,
        reach: float = 0.4,
        noise: float = 0.1,
        start_us: int = 0,
        width: int = 320,
        height: int = 240,
        seed: int = 7,
    ) -> Events:
        rng = np.random.default_rng(seed)
        t = np.sort(rng.integers(0, span_us, count))
        point = rng.integers(0, points, count)
        right = rng.uniform(-reach * width, (1 + reach) * width, points)[point] - center_px[0]
        down = rng.uniform(-reach * height, (1 + reach) * height, points)[point] - center_px[1]
        theta = omega_rad_s * t * 1e-6
        x = center_px[0] + np.cos(theta) * right - np.sin(theta) * down
        y = center_px[1] + np.sin(theta) * right + np.cos(theta) * down
        p = point % 2
        stray = rng.random(count) < noise
        x[stray], y[stray] = rng.uniform(0, width, stray.sum()), rng.uniform(0, height, stray.sum())
        p[stray] = rng.integers(0, 2, stray.sum())
        x, y = np.floor(x + 0.5).astype(np.int64), np.floor(y + 0.5).astype(np.int64)
        seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        return Events(t[seen] + start_us, x[seen], y[seen], p[seen], width, height)

    return make
