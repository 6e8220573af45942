"""The budget of a line equals what a queue, served event by event, would show."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import Events
from tiegocancel.link.budget import LinkMeter, WireMeter, link_budget
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions

steps = st.lists(st.tuples(st.integers(0, 400), st.integers(1, 9)), min_size=1, max_size=200)


def served(t: np.ndarray, sizes: np.ndarray, per_us: float, fifo: int | None) -> tuple[float, int]:
    """Serve a queue in plain words; return its highest level and what was lost."""
    level, highest, lost, last = 0.0, 0.0, 0, int(t[0])
    for now, size in zip(t.tolist(), sizes.tolist(), strict=True):
        level = max(level - (now - last) * per_us, 0.0)
        last = now
        if fifo is not None and level + size > fifo + 1e-9:
            lost += 1
            continue
        level += size
        highest = max(highest, level)
    return highest, lost


@given(steps, st.floats(1e3, 1e6), st.integers(4, 64), st.integers(1, 7))
def test_queue_and_loss_equal_a_queue_served_event_by_event(
    steps: list[tuple[int, int]], rate: float, fifo: int, pieces: int
) -> None:
    t = 1000 + np.cumsum([step for step, _ in steps])
    sizes = np.array([size for _, size in steps], np.float64)
    highest, _ = served(t, sizes, rate * 1e-6, None)
    _, lost = served(t, sizes, rate * 1e-6, fifo)
    meter = LinkMeter(rate, fifo)
    for part in np.array_split(np.arange(len(t)), pieces):
        meter.add(t[part], sizes[part])
    found = meter.budget()
    assert found.queue_bytes == pytest.approx(highest, abs=1.0)
    assert found.queue_bytes >= highest - 1e-6
    assert found.lost_events == lost
    assert found.bytes == sizes.sum()
    assert found.delay_s == pytest.approx(highest / rate)


def test_a_steady_stream_at_half_the_rate_half_fills_the_line() -> None:
    t = np.arange(0, 1_000_000, 100)
    found = link_budget(t, np.full(len(t), 4.0), line_bytes_per_s=80_000, span_us=1_000_000)
    assert found.bytes_per_s == 40_000
    assert found.utilisation == found.peak_1ms == found.peak_10ms == 0.5
    assert (found.queue_bytes, found.lost_events) == (4, 0)
    assert found.to_json()["bits_per_s"] == 320_000


def test_a_burst_shows_in_short_windows_only() -> None:
    t = np.concatenate([np.full(1000, 500_000), [1_000_000]])
    found = link_budget(t, np.full(len(t), 4.0), line_bytes_per_s=92_160, fifo_bytes=512)
    assert found.utilisation < 0.1
    assert found.peak_1ms == pytest.approx(4000 / 92.16)
    assert found.peak_10ms == pytest.approx(4000 / 921.6)
    assert found.queue_bytes == 4000
    assert found.lost_events == 1000 - 512 // 4


def test_an_overloaded_line_loses_what_it_cannot_carry() -> None:
    t = np.arange(0, 1_000_000, 10)
    found = link_budget(t, np.full(len(t), 5.0), line_bytes_per_s=100_000, fifo_bytes=1000)
    assert found.lost_share == pytest.approx(0.8, abs=0.01)
    assert found.queue_bytes == pytest.approx(400_000, rel=0.01)


def test_nothing_asks_for_nothing() -> None:
    found = LinkMeter(1000.0).budget()
    assert (found.events, found.bytes, found.queue_bytes, found.utilisation) == (0, 0, 0, 0.0)
    with pytest.raises(ValueError, match="line_bytes_per_s"):
        LinkMeter(0.0)
    with pytest.raises(ValueError, match="fifo_bytes"):
        LinkMeter(1.0, 0)


@pytest.mark.parametrize(("form", "size"), [("E2", 4), ("E3", 5), ("E4", 6)])
def test_bytes_are_those_of_the_protocol(form: str, size: int) -> None:
    t = np.arange(0, 50_000, 37)
    events = Events(t, t % 128, t % 90, t % 2, 128, 128)
    meter = WireMeter(registry.encoder("edvs", ProtocolOptions(edvs_format=form)), 92_160)
    for part in (events[:500], events[500:501], events[501:]):
        meter.write(part)
    found = meter.meter.budget()
    assert found.bytes == size * len(events)
    assert found.bytes_per_event == size
    assert meter.meter.profile().sum() == pytest.approx(size * len(events))
