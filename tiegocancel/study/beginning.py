"""Take the stretch of a stream that a device is tested with: from its first event on, with a motion known so far."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tiegocancel.chunks import rechunk
from tiegocancel.events import Events
from tiegocancel.firmware_sim.export.vectors import last_asked_us
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules
from tiegocancel.study.feed import MotionFeed

__all__ = ["BEYOND_WARM_UP", "MOST_EVENTS", "motion_of", "take_beginning"]

BEYOND_WARM_UP = 4096
"""Events beyond the warm-up that a stretch has unless it is told how many it shall have."""

MOST_EVENTS = 1 << 18
"""Most events of a stretch that is not told how many it shall have."""

_CHUNK_EVENTS = 1 << 16


def take_beginning(
    chunks: Iterable[Events],
    feed: MotionFeed,
    config: CancelConfig,
    *,
    from_us: int | None = None,
    max_events: int | None = None,
) -> Events | None:
    """Return the first ``max_events`` events at ``from_us`` or later, ``None`` where there are none.

    Without ``max_events`` the stretch is the warm-up of ``config`` and ``BEYOND_WARM_UP`` events after it, at most
    ``MOST_EVENTS``. ``feed`` looks at every event up to the end of the stretch, and at none beyond it.
    """
    parts: list[Events] = []
    have = 0
    for chunk in rechunk(chunks, _CHUNK_EVENTS):
        first = 0 if from_us is None else int(np.searchsorted(chunk.t, from_us, side="left"))
        part = chunk[first:]
        parts.append(part)
        stop = MOST_EVENTS if max_events is None else max_events
        if max_events is None and have + len(part):
            start_us = int(next(one.t[0] for one in parts if len(one)))
            warm = sum(int(np.searchsorted(one.t, start_us + config.warm_up_us)) for one in parts)
            if warm < have + len(part):
                stop = min(warm + BEYOND_WARM_UP, MOST_EVENTS)
        if have + len(part) >= stop:
            feed.advance(chunk[: first + stop - have])
            return Events.concatenate(parts)[:stop]
        have += len(part)
        feed.advance(chunk)
    return Events.concatenate(parts) if have else None


def motion_of(feed: MotionFeed, config: CancelConfig, events: Events, *, step_us: int) -> Schedules:
    """Return the schedule of each horizon for a stretch that the feed has looked at."""
    start_us, stop_us = int(events.t[0]), last_asked_us(events, config)
    return tuple(
        feed.schedule(horizon_us, start_us=start_us, stop_us=stop_us, step_us=step_us)
        for horizon_us in config.horizons_us
    )
