"""Run the streaming canceller over the stretch that the video shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.settings import WindowSettings
from tiegocancel.study.thesis.study import ThesisResult
from tiegocancel.study.thesis.windows import cut_windows

__all__ = ["film_of"]


def film_of(chunks: Callable[[], Iterable[Events]], result: ThesisResult) -> tuple[Events, NDArray[np.bool_]]:
    """Return the events from the first window on, as many as the video has frames for, and which are suppressed.

    At the long horizon; the warm-up comes before, or is left out where nothing comes before.
    """
    video, bench = result.settings.video, result.bench
    point = base_of("stream", result.settings).at(horizon_us=result.settings.point.long_horizon_us)
    config = point.cancel_config()
    length_us = video.frames * video.frame_us
    windows, _ = cut_windows(
        chunks,
        WindowSettings(length_us=length_us, count=1, starts_s=(bench.windows[0].start_us / 1e6,)),
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
    return events[first:], suppressed[first:]
