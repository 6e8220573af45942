"""An estimator that is too slow for a live stream sees fewer stretches of it, and the stream does not lag."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.estimation.paced import PacedEstimator


class Costly:
    """Take ``cost_s`` of a clock for every chunk, and remember which it saw."""

    def __init__(self, cost_s: float) -> None:
        self.clock, self.seen, self._cost_s = 0.0, [], cost_s  # type: ignore[var-annotated]

    def process(self, events: Events) -> list[MotionEstimate]:
        self.clock += self._cost_s
        self.seen += events.t.tolist()
        return [MotionEstimate(t_us=int(events.t[-1]), center_px=(1.0, 1.0), omega_rad_s=1.0)]


def chunk(start_us: int) -> Events:
    t = np.arange(start_us, start_us + 5000, 100)
    zeros = np.zeros(len(t), int)
    return Events(t, zeros, zeros, zeros, 4, 4)


def passed(cost_s: float, *, share: float = 0.5) -> tuple[Costly, PacedEstimator, int]:
    inner = Costly(cost_s)
    paced = PacedEstimator(inner, share=share, stretch_us=50_000, now_s=lambda: inner.clock)
    rows = sum(len(paced.process(chunk(start))) for start in range(0, 10_000_000, 5000))
    return inner, paced, rows


def test_one_that_is_fast_enough_sees_everything() -> None:
    inner, paced, rows = passed(0.0024)
    assert (paced.skipped, paced.notes(), rows) == (0, [], 2000)
    assert len(inner.seen) == paced.events == 100_000


@pytest.mark.parametrize("cost_s", [0.004, 0.02, 0.3])
@pytest.mark.parametrize("share", [0.25, 1.0])
def test_one_that_is_too_slow_takes_its_share_and_sees_whole_stretches(cost_s: float, share: float) -> None:
    inner, paced, rows = passed(cost_s, share=share)
    slack_s = 12 * cost_s + 0.1  # a stretch, once begun, is finished
    assert inner.clock <= share * 10.0 + slack_s
    if cost_s > 0.005 * share:
        assert inner.clock >= share * 10.0 - slack_s
        assert paced.skipped > 0
        assert "looked for in" in paced.notes()[0]
    assert paced.skipped + len(inner.seen) == paced.events
    assert rows == len(inner.seen) // 50
    gaps = np.flatnonzero(np.diff(inner.seen) > 100)
    stretches = np.diff([0, *(gaps + 1).tolist(), len(inner.seen)])
    assert (stretches[:-1] >= 500).all()  # 50 ms


def test_nothing_is_made_of_nothing() -> None:
    paced = PacedEstimator(Costly(1.0))
    assert paced.process(chunk(0)[:0]) == []
    with pytest.raises(ValueError, match="share"):
        PacedEstimator(Costly(1.0), share=0.0)
