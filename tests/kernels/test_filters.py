"""The filter kernels leave alone what was removed before and what lies outside their launch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tiegocancel.kernels import filters

WIDTH, HEIGHT, COUNT = 5, 4, 60

KERNELS: dict[str, dict[str, Any]] = {
    "hot_pixel": {"leak_us": 500, "limit_us": 500, "width": WIDTH},
    "flicker": {"periods": 1, "shortest_us": 10, "longest_us": 9000, "silence_us": 90_000, "width": WIDTH},
    "refractory": {"by_polarity": False, "period_us": 900, "width": WIDTH},
    "background": {"radius_px": 1, "delay_us": 300, "support": 1, "stride": WIDTH + 1},
}


def launch(name: str, kept: np.ndarray[Any, Any], *, first: int, count: int) -> np.ndarray[Any, Any]:
    """Run one kernel over the same stream; return its cells."""
    rng = np.random.default_rng(5)
    columns: dict[str, Any] = {
        "t": np.sort(rng.integers(0, 9000, COUNT)),
        "x": rng.integers(0, WIDTH, COUNT).astype(np.uint16),
        "y": rng.integers(0, HEIGHT, COUNT).astype(np.uint16),
        "p": rng.integers(0, 2, COUNT).astype(np.uint8),
    }
    if name in ("hot_pixel", "background"):
        del columns["p"]
    cells = np.zeros((HEIGHT + 2) * (WIDTH + 1) + 1, np.uint32)
    span = 1 << 25 if name == "flicker" else 1 << 30
    getattr(filters, name)(count=count, first=first, base_us=-span, cells=cells, kept=kept, **columns, **KERNELS[name])
    return cells


@pytest.mark.parametrize("name", KERNELS)
def test_removed_events_leave_no_trace_and_stay_removed(name: str) -> None:
    none = np.zeros(COUNT, np.uint8)
    assert not launch(name, none, first=0, count=COUNT).any()
    assert not none.any()


@pytest.mark.parametrize("name", KERNELS)
def test_rows_outside_the_launch_are_not_touched(name: str) -> None:
    kept = np.full(COUNT, 7, np.uint8)
    kept[20:50] = 1
    launch(name, kept, first=20, count=30)
    assert (kept[:20] == 7).all()
    assert (kept[50:] == 7).all()
    assert 0 < kept[20:50].sum() < 30


def test_the_unrolled_window_and_the_loop_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    unrolled, looped = np.ones(COUNT, np.uint8), np.ones(COUNT, np.uint8)
    cells = launch("background", unrolled, first=0, count=COUNT)
    monkeypatch.setattr(filters, "MAX_UNROLLED_RADIUS_PX", 0)
    monkeypatch.setattr(filters, "_background", filters._background.__wrapped__)
    assert launch("background", looped, first=0, count=COUNT).tolist() == cells.tolist()
    assert looped.tolist() == unrolled.tolist()
