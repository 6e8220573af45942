"""Events whose motion is known, and an estimator that says what it is told to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.estimation.estimate import MotionEstimate

CENTER = (80.0, 60.0)


class Scripted:
    """Give rows that are known beforehand, each as soon as an event at or after its time has come."""

    def __init__(self, rows: Sequence[MotionEstimate]) -> None:
        self.rows = list(rows)

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the rows that it makes due."""
        due = [row for row in self.rows if len(events) and row.t_us <= int(events.t[-1])]
        self.rows = self.rows[len(due) :]
        return due


@pytest.fixture(scope="session")
def scripted() -> type[Scripted]:
    """Return the estimator's class."""
    return Scripted


@pytest.fixture(scope="session")
def markers() -> Events:
    """Fifty markers that turn about (80, 60) for 90 ms, ever faster: ω = 10 rad/s + 80 rad/s² · t."""
    rng = np.random.default_rng(11)
    t = np.arange(0, 90_000, 100)
    theta = 10.0 * t * 1e-6 + 40.0 * (t * 1e-6) ** 2
    angle = 2 * np.pi * rng.random(50) + theta[:, None]
    radius = 8 + 45 * rng.random(50)
    x = np.floor(CENTER[0] + radius * np.cos(angle) + 0.5).astype(int)
    y = np.floor(CENTER[1] + radius * np.sin(angle) + 0.5).astype(int)
    fresh = np.ones_like(x, bool)
    fresh[1:] = (np.diff(x, axis=0) != 0) | (np.diff(y, axis=0) != 0)
    polarity = np.broadcast_to(np.arange(50) % 2, x.shape)
    return Events(np.repeat(t, 50)[fresh.ravel()], x[fresh], y[fresh], polarity[fresh], 160, 120)


@pytest.fixture(scope="session")
def turning_scene() -> Events:
    """Many points of one polarity or the other that turn about (80, 60) at 13 rad/s for 100 ms, and a little noise."""
    rng = np.random.default_rng(4)
    count = 30_000
    t = np.sort(rng.integers(0, 100_000, count))
    point = rng.integers(0, 150, count)
    radius, angle = 55 * np.sqrt(rng.random(150))[point], (2 * np.pi * rng.random(150))[point] + 13.0 * t * 1e-6
    x = np.floor(CENTER[0] + radius * np.cos(angle) + 0.5).astype(int)
    y = np.floor(CENTER[1] + radius * np.sin(angle) + 0.5).astype(int)
    stray = rng.random(count) < 0.05
    x[stray], y[stray] = rng.integers(0, 160, stray.sum()), rng.integers(0, 120, stray.sum())
    return Events(t, x, y, point % 2, 160, 120)
