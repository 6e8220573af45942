"""The summary of a stream does not depend on how it is cut."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import Events
from tiegocancel.files.summary import RecordingSummary


@given(seed=st.integers(0, 2**32), chunk=st.integers(1, 100), step_us=st.sampled_from([0, 40, 900]))
def test_chunks_of_any_size_sum_up_the_same(seed: int, chunk: int, step_us: int, stream: Callable[..., Events]) -> None:
    events = stream(seed, 200, step_us=step_us)
    summary = RecordingSummary()
    for start in range(0, len(events), chunk):
        summary.add(events[start : start + chunk])
    assert (summary.events, summary.span_us) == (200, events.span_us)
    assert summary.on_share == events.p.mean()
    assert summary.peak_events_ms == np.bincount((events.t - events.t[0]) // 1000).max()


def test_nothing_has_no_rate() -> None:
    summary = RecordingSummary()
    summary.add(Events.empty(4, 4))
    assert (summary.events, summary.mean_hz, summary.on_share, summary.peak_hz) == (0, None, None, 0)
