"""Windows lie where the thesis has them, and say what they are too short for."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.study.thesis.settings import ThesisSettings, WindowSettings
from tiegocancel.study.thesis.windows import cut_windows, place_windows


def stream(span_us: int, start_us: int = 0, step_us: int = 10) -> list[Events]:
    t = start_us + np.arange(0, span_us, step_us)
    zeros = np.zeros(len(t), np.int64)
    whole = Events(t, zeros, zeros, zeros, 4, 4)
    return [whole[first : first + 700] for first in range(0, len(whole), 700)]


def test_a_recording_of_ten_seconds_has_the_windows_of_the_thesis() -> None:
    starts, length_us = place_windows(0, 10_000_000, WindowSettings(), 22_500)
    assert [start / 1e6 for start in starts] == [5.0, 5.01, 8.2, 8.21, 9.0, 9.01]
    assert length_us == 10_000


@pytest.mark.parametrize("start_us", [0, -50_000, 8_392_000])
def test_each_window_holds_its_events_and_those_before_it(start_us: int) -> None:
    chunks = stream(1_000_000, start_us)
    windows, notes = cut_windows(lambda: chunks, WindowSettings(), 22_500)
    assert len(windows) == 6
    for window in windows:
        assert len(window.isolated) == 1000
        assert window.stop_us - window.start_us == 10_000
        assert int(window.events.t[0]) >= window.start_us - 22_500
        assert len(window.events) == 3250
    assert len(notes) == 1


def test_a_recording_of_ten_milliseconds_is_one_window_and_says_so() -> None:
    windows, notes = cut_windows(lambda: stream(10_000, 77), WindowSettings(), 22_500)
    assert [(window.start_us, len(window.events)) for window in windows] == [(77, 1000)]
    assert any("too little comes before W1" in note for note in notes)


def test_given_starts_are_taken_and_those_beyond_are_refused() -> None:
    chunks = stream(1_000_000)
    windows, _ = cut_windows(lambda: chunks, WindowSettings(starts_s=(0.3, 0.1)), 5000)
    assert [window.start_us for window in windows] == [100_000, 300_000]
    with pytest.raises(ConfigError, match="starts_s: 2 s lies beyond"):
        cut_windows(lambda: chunks, WindowSettings(starts_s=(2.0,)), 5000)


def test_an_empty_stream_has_no_windows() -> None:
    assert cut_windows(lambda: [Events.empty(4, 4)], WindowSettings(), 100) == ((), [])


def test_the_default_grid_is_that_of_the_thesis_and_quick_is_a_part_of_it() -> None:
    grid, quick = ThesisSettings().grid, ThesisSettings().quick().grid
    assert len(grid.horizons_us) * len(grid.tolerances_px) * len(grid.tolerances_us) == 525
    for name in ("horizons_us", "tolerances_px", "tolerances_us"):
        assert set(getattr(quick, name)) < set(getattr(grid, name))
    assert set(quick.heatmaps_us) <= set(quick.horizons_us)
