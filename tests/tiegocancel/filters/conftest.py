"""One pixel's events through one filter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tiegocancel import Events
from tiegocancel.filters import FilterChain, FilterConfig

Pixel = Callable[..., list[bool]]


@pytest.fixture(params=[0, -(1 << 60), 1 << 59], ids=["from 0", "from -2^60", "from 2^59"])
def kept(request: pytest.FixtureRequest) -> Pixel:
    """Return ``kept(t, p=1, x=2, y=1, **config)``: which events at pixel ``(x, y)`` of 6×4 are kept."""

    def run(t: ArrayLike, p: ArrayLike = 1, x: ArrayLike = 2, y: ArrayLike = 1, **config: Any) -> list[bool]:
        times = np.asarray(t, np.int64) + request.param
        columns = [np.broadcast_to(np.asarray(column, np.int64), times.shape) for column in (x, y, p)]
        chain = FilterChain(FilterConfig(**config), width=6, height=4)
        return list(chain.process(Events(times, *columns, 6, 4)).tolist())

    return run
