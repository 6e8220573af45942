"""Run the streaming canceller over the stretch that the video shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.settings import WindowSettings
from tiegocancel.study.thesis.study import ThesisResult
from tiegocancel.study.thesis.windows import cut_windows

__all__ = ["Film", "film_of"]

_FEWEST_FRAMES = 4


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """The events that are shown, which of them are suppressed at ``horizon_us``, and how much a frame holds."""

    events: Events
    suppressed: NDArray[np.bool_]
    horizon_us: int
    frame_us: int


def film_of(chunks: Callable[[], Iterable[Events]], result: ThesisResult) -> Film:
    """Return the events from the first window on, as many as the video has frames for.

    At the long horizon; the warm-up comes before, or is left out where nothing comes before. Where that leaves less
    than two frames, the short horizon takes its place; a stretch of less than four frames has shorter ones.
    """
    chosen, video = result.settings.point, result.settings.video
    film = _film(chunks, result, chosen.long_horizon_us)
    if film.events.span_us < 2 * video.frame_us:
        film = max(film, _film(chunks, result, chosen.horizon_us), key=lambda one: one.events.span_us)
    return film


def _film(chunks: Callable[[], Iterable[Events]], result: ThesisResult, horizon_us: int) -> Film:
    video, bench = result.settings.video, result.bench
    config = base_of("stream", result.settings).at(horizon_us=horizon_us).cancel_config()
    windows, _ = cut_windows(
        chunks,
        WindowSettings(length_us=video.frames * video.frame_us, count=1, starts_s=(bench.windows[0].start_us / 1e6,)),
        config.warm_up_us,
    )
    window = windows[0]
    events = window.events
    schedule = bench.motion.schedule(
        config.horizon_us, start_us=int(events.t[0]), stop_us=int(events.t[-1]), step_us=bench.step_us
    )
    canceller = Canceller(config, schedule, width=events.width, height=events.height, track_source=False)
    suppressed = canceller.process(events).suppressed
    shown_us = max(window.start_us, int(events.t[0]) + config.warm_up_us)
    first = int(np.searchsorted(events.t, shown_us, side="left"))
    shown = events[first:]
    frame_us = min(video.frame_us, max(shown.span_us // min(video.frames, _FEWEST_FRAMES), 1)) if len(shown) else 1
    return Film(shown, suppressed[first:], horizon_us, frame_us)
