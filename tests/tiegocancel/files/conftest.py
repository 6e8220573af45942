"""Make random streams and files for the readers and writers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiegocancel import Events


@pytest.fixture(scope="session")
def stream() -> Callable[..., Events]:
    """Return a maker of random streams."""

    def make(
        seed: int = 0,
        n: int = 500,
        *,
        width: int = 64,
        height: int = 48,
        start_us: int = 1000,
        step_us: int = 40,
        labelled: bool = False,
    ) -> Events:
        rng = np.random.default_rng(seed)
        t = start_us + np.cumsum(rng.integers(0, step_us + 1, n))
        x, y = rng.integers(0, width, n), rng.integers(0, height, n)
        if n:
            # The last pixel is hit, so that a size derived from the coordinates is the true one.
            x[0], y[0] = width - 1, height - 1
        label = rng.integers(0, 3, n) if labelled else None
        return Events(t, x, y, rng.integers(0, 2, n), width, height, label)

    return make


@pytest.fixture(scope="session")
def same() -> Callable[[Any, Any], bool]:
    """Return a comparison of two streams, column by column."""

    def compare(one: Events, other: Events) -> bool:
        if (one.label is None) != (other.label is None):
            return False
        names = ("t", "x", "y", "p") if one.label is None else ("t", "x", "y", "p", "label")
        return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)

    return compare


@pytest.fixture
def saved(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes text or bytes to a new file."""

    def save(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return save
