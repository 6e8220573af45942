"""The filters equal their plain models bit for bit, whatever the stream, the settings and the cuts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tiegocancel import Events
from tiegocancel.filters import FilterChain, FilterConfig
from tiegocancel.filters.oracle import OracleChain

FAR = 1 << 60


@st.composite
def streams(draw: st.DrawFn, max_events: int = 150) -> Events:
    """Draw a stream dense enough that neighbours, repeats and regular alternations are common."""
    width, height = draw(st.sampled_from([(1, 1), (2, 1), (3, 2), (7, 5), (40, 3)]))
    count = draw(st.integers(0, max_events))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    scale = draw(st.sampled_from([0, 1, 40, 1000, 1 << 20, 1 << 25, 1 << 28, 1 << 30]))
    steps = rng.integers(0, scale + 1, count) if draw(st.booleans()) else np.full(count, scale)
    steps[rng.random(count) < 0.05] *= draw(st.sampled_from([1, 2, 70]))
    start = draw(st.sampled_from([0, -5000, 1 << 29, -FAR, FAR - int(steps.sum())]))
    p = rng.integers(0, 2, count) if draw(st.booleans()) else np.arange(count) & 1
    return Events(
        start + np.cumsum(steps), rng.integers(0, width, count), rng.integers(0, height, count), p, width, height
    )


SPANS = [0, 1, 50, 3000, 1 << 22, (1 << 28) - 1]


@st.composite
def configs(draw: st.DrawFn) -> FilterConfig:
    window = draw(st.sampled_from([3, 400, 100_000, (1 << 28) - 1]))
    low = draw(st.sampled_from([1.0, 90.0, 1000.0]))
    radius = draw(st.integers(1, 4))
    return FilterConfig(
        hot_events=draw(st.sampled_from([0, 0, 1, 3, 20]).filter(lambda events: events <= window)),
        hot_window_us=window,
        flicker_periods=draw(st.sampled_from([0, 0, 1, 2, 15])),
        flicker_min_hz=low,
        flicker_max_hz=draw(st.sampled_from([1.0, 130.0, 1000.0, 100_000.0]).filter(lambda high: high >= low)),
        refractory_us=draw(st.sampled_from(SPANS)),
        refractory_by_polarity=draw(st.booleans()),
        background_us=draw(st.sampled_from(SPANS)),
        background_radius_px=radius,
        background_support=draw(st.integers(1, 3)),
    )


@st.composite
def cases(draw: st.DrawFn) -> tuple[Events, FilterConfig, list[int]]:
    events = draw(streams())
    return events, draw(configs()), sorted(draw(st.lists(st.integers(0, len(events)), max_size=4)))


def decide(chain: Any, events: Events, cuts: list[int]) -> NDArray[np.bool_]:
    """Process ``events`` cut at ``cuts``."""
    bounds = zip([0, *cuts], [*cuts, len(events)], strict=True)
    return np.concatenate([chain.process(events[first:last]) for first, last in bounds])


def hold_equal(case: tuple[Events, FilterConfig, list[int]]) -> None:
    events, config, cuts = case
    chain = FilterChain(config, width=events.width, height=events.height)
    oracle = OracleChain(config)
    assert decide(chain, events, cuts).tolist() == oracle.process(events).tolist()
    assert chain.counters == oracle.counters
    counts = dict(chain.counters)
    assert counts.pop("events") == sum(counts.values()) == len(events)


@settings(max_examples=300, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(cases())
def test_chain_equals_oracle_for_any_stream_config_and_chunking(case: tuple[Events, FilterConfig, list[int]]) -> None:
    hold_equal(case)


@pytest.mark.slow
@settings(max_examples=5000, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(cases())
def test_chain_equals_oracle_over_thousands_of_cases(case: tuple[Events, FilterConfig, list[int]]) -> None:
    hold_equal(case)


@pytest.mark.parametrize(
    "config",
    [
        {"hot_events": 4, "hot_window_us": 8000},
        {"flicker_periods": 3, "flicker_min_hz": 200, "flicker_max_hz": 3000},
        {"refractory_us": 700},
        {"refractory_us": 700, "refractory_by_polarity": True},
        {"background_us": 150},
        {"background_us": 150, "background_radius_px": 3, "background_support": 6},
        {"hot_events": 9, "hot_window_us": 8000, "flicker_periods": 3, "flicker_max_hz": 800, "refractory_us": 200,
         "background_us": 300},
    ],
    ids=lambda config: " ".join(config),
)  # fmt: skip
def test_each_filter_removes_some_and_keeps_some_as_its_oracle_does(config: dict[str, Any]) -> None:
    """A long dense stream: random draws seldom reach the states that need many events."""
    rng = np.random.default_rng(3)
    events = Events(np.sort(rng.integers(0, 400_000, 9000)), rng.integers(0, 7, 9000), rng.integers(0, 5, 9000),
                    rng.integers(0, 2, 9000), 7, 5)  # fmt: skip
    hold_equal((events, FilterConfig(**config), [10, 4000]))
    kept = FilterChain(FilterConfig(**config), width=7, height=5).process(events)
    assert 90 < kept.sum() < 8910


def test_all_off_keeps_everything_without_state() -> None:
    chain = FilterChain(FilterConfig(), width=9, height=9)
    assert FilterConfig().active == ()
    chain.prepare()
    assert chain.process(Events(np.arange(5), [1] * 5, [2] * 5, [0] * 5, 9, 9)).all()  # type: ignore[arg-type]
    assert dict(chain.counters)["kept"] == chain.counters.events == 5


def test_what_one_filter_removes_the_next_does_not_see() -> None:
    """A hot pixel beside a quiet one: its muted events support nobody."""
    t = np.concatenate([np.arange(0, 100_000, 100), [99_950]])
    x = np.concatenate([np.full(1000, 3), [4]])
    events = Events(t, x, np.full(1001, 3), np.ones(1001, int), 9, 9)
    alone = FilterChain(FilterConfig(background_us=1000), width=9, height=9).process(events)
    after = FilterChain(FilterConfig(background_us=1000, hot_events=10), width=9, height=9).process(events)
    assert alone[-1]
    assert not after[-1]


def test_preparing_leaves_no_trace() -> None:
    config = FilterConfig(hot_events=1, flicker_periods=1, refractory_us=1000, background_us=1000)
    plain, prepared = (FilterChain(config, width=4, height=4) for _ in range(2))
    prepared.prepare()
    events = Events([0, 0, 5], [0, 1, 0], [0, 0, 0], [1, 1, 0], 4, 4)  # type: ignore[arg-type]
    assert prepared.process(events).tolist() == plain.process(events).tolist()
    assert prepared.counters == plain.counters


def test_chunks_from_the_past_and_from_another_sensor_are_refused() -> None:
    chain = FilterChain(FilterConfig(refractory_us=5), width=32, height=24)
    chain.process(Events([1000], [0], [0], [0], 32, 24))  # type: ignore[arg-type]
    chain.process(Events.empty(32, 24))
    with pytest.raises(ValueError, match="the chunk begins at 500 µs, before the last event at 1000 µs"):
        chain.process(Events([500], [0], [0], [0], 32, 24))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="8×8 px do not fit a filter of 32×24 px"):
        chain.process(Events.empty(8, 8))


def test_counters_name_what_they_do_not_know() -> None:
    with pytest.raises(KeyError, match="hot"):
        FilterChain(FilterConfig(), width=2, height=2).counters["hot"]
