"""The video shows the long horizon where a recording has room for it, and says what it shows instead where not."""

from __future__ import annotations

from dataclasses import replace

from tiegocancel.study.thesis.film import film_of
from tiegocancel.study.thesis.probe import Bench
from tiegocancel.study.thesis.results import Results
from tiegocancel.study.thesis.settings import ThesisSettings
from tiegocancel.study.thesis.study import ThesisResult


def result_of(bench: Bench, settings: ThesisSettings) -> ThesisResult:
    return ThesisResult(
        bench=bench, settings=settings, results=Results({}, 2), agreement=(), resumed=0, run=0, interrupted=False
    )


def test_a_recording_with_a_lead_shows_the_long_horizon_from_the_window_on(
    small_bench: Bench, small_settings: ThesisSettings
) -> None:
    window = small_bench.windows[1]
    film = film_of(lambda: [window.events], result_of(replace(small_bench, windows=(window,)), small_settings))
    assert film.horizon_us == small_settings.point.long_horizon_us
    assert film.frame_us <= small_settings.video.frame_us
    assert window.start_us <= int(film.events.t[0])
    assert len(film.events) == len(window.isolated)
    assert 0.3 < film.suppressed.mean() < 1.0


def test_ten_milliseconds_show_the_short_horizon_in_shorter_frames(
    small_bench: Bench, small_settings: ThesisSettings
) -> None:
    chosen, whole = small_settings.point, small_bench.windows[0].isolated
    window = replace(small_bench.windows[0], events=whole, start_us=int(whole.t[0]))
    film = film_of(lambda: [whole], result_of(replace(small_bench, windows=(window,)), small_settings))
    assert film.horizon_us == chosen.horizon_us
    assert int(film.events.t[0]) >= int(whole.t[0]) + chosen.horizon_us + chosen.tolerance_us
    assert film.events.span_us >= min(small_settings.video.frames, 3) * film.frame_us
    assert film.frame_us < small_settings.video.frame_us
