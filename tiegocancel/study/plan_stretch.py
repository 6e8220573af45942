"""Choose the stretch of a recording on which operating points are tried, and tell its pace."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import ConfigError
from tiegocancel.events import EGO, MOVER, NOISE, Events
from tiegocancel.metrics import estimate_radius_px
from tiegocancel.motion.schedule import FRACTION_BITS, MAX_COEFFICIENT
from tiegocancel.motion.schedule_file import is_schedule_file
from tiegocancel.study.feed import MotionFeed, TrackedMotion
from tiegocancel.study.injection import inject_mover
from tiegocancel.study.motion_source import open_motion
from tiegocancel.study.plan_candidates import Pace
from tiegocancel.study.plan_trial import Course
from tiegocancel.study.settings import Settings
from tiegocancel.study.stretch import Densest

__all__ = ["MOST_EVENTS", "Ground", "lay_out", "rim_speed_px_s"]

MOST_EVENTS = 1_200_000
"""Events that a search looks at: each of its trials runs them up to three times."""

_SPAN_US, _LONGEST_US, _ENOUGH = 250_000, 4_000_000, 150_000
_WARM_PX, _WARM_SHARE, _LATEST_SHARE = 52.0, 0.4, 0.8
"""Travel that four rounds of 12 px and their gate take; the share of a stretch that is for it; at most so much."""
_INJECTED_SHARE_OF_RIM = 0.75
_SPEED_US = 1000
_FEWEST = 50


@dataclass(frozen=True, slots=True)
class Ground:
    """What a search runs over."""

    course: Course
    pace: Pace
    injected: bool
    notes: tuple[str, ...]


def lay_out(chunks: Callable[[], Iterable[Events]], settings: Settings, *, width: int, height: int) -> Ground | None:
    """Return the densest stretch of a stream with its motion, ``None`` for a stream without events.

    ``chunks`` begins the stream anew whenever it is called. The stretch is longer where the motion is slow. Raise
    ``ConfigError`` for a motion that serves one horizon only, that is unknown there, or that is rest.
    """
    if is_schedule_file(settings.motion.source.strip()):
        raise ConfigError(f"--motion {settings.motion.source}: a schedule serves one horizon, a plan tries many")
    events = _densest(chunks(), _SPAN_US)
    if events is None:
        return None
    feed = _motion(chunks, events, settings, width, height)
    speed_px_s = _speed(events, feed, settings)
    wanted_us = round(_WARM_PX / speed_px_s * 1e6 / _WARM_SHARE)
    if wanted_us > events.span_us and wanted_us > _SPAN_US:
        longer = _densest(chunks(), min(wanted_us, _LONGEST_US))
        if longer is not None and longer.span_us > events.span_us:
            events = longer
            feed = _motion(chunks, events, settings, width, height)
            speed_px_s = _speed(events, feed, settings)
    us_per_px = 1e6 / speed_px_s
    pace = Pace(us_per_px=us_per_px, rate_hz=len(events) / max(events.span_us, 1) * 1e6)
    notes = [
        f"tried on {len(events):,} events, {events.span_us / 1000:.0f} ms from {int(events.t[0]) / 1e6:.3f} s on; "
        f"fast edges run at {speed_px_s:.0f} px/s"
    ]
    counted_from_us = int(events.t[0]) + round(
        max(_WARM_SHARE * events.span_us, min(_WARM_PX * us_per_px, _LATEST_SHARE * events.span_us))
    )
    late = events.between(counted_from_us, int(events.t[-1]) + 1)
    injected = late.label is None or int(np.count_nonzero(late.label == MOVER)) < _FEWEST
    if injected:
        if events.label is None:
            inside = _turning(events, feed, settings)
            if not inside.all():
                notes.append(
                    f"{int(np.count_nonzero(~inside)):,} events lie beyond the disc that turns and do not count"
                )
            label = np.where(inside, EGO, NOISE).astype(np.int8)
            events = Events(events.t, events.x, events.y, events.p, width, height, label)
        put = inject_mover(events, speed_px_s=_INJECTED_SHARE_OF_RIM * speed_px_s, seed=0)
        events = put.events
        notes.append(put.note)
    course = Course(events, feed, counted_from_us=counted_from_us, step_us=settings.motion.schedule_step_us)
    if course.counted(MOVER) < _FEWEST:
        notes.append(f"only {course.counted(MOVER)} events of the mover count: its loss says little")
    return Ground(course, pace, injected, tuple(notes))


def rim_speed_px_s(events: Events, feed: MotionFeed, *, step_us: int) -> float:
    """Return the speed that 5 % of the events' places exceed, in px/s; 0 where the motion is rest or unknown."""
    schedule = feed.schedule(_SPEED_US, start_us=int(events.t[0]), stop_us=int(events.t[-1]), step_us=step_us)
    some = slice(None, None, max(len(events) // 100_000, 1))
    x, y = events.x[some].astype(np.float64), events.y[some].astype(np.float64)
    a, b, c, d, e, f = schedule.coefficients[schedule.entry_at(events.t[some])].T
    known = np.abs(c) < MAX_COEFFICIENT
    if not known.any():
        return 0.0
    moved = np.hypot(a * x + b * y + c, d * x + e * y + f)[known] / float(1 << FRACTION_BITS)
    return float(np.quantile(moved, 0.95)) * 1e6 / _SPEED_US


def _densest(chunks: Iterable[Events], span_us: int) -> Events | None:
    """Return the densest stretch of a stream, of those that begin 0, 1, 3, 7, … s after its first event."""
    found: Densest | None = None
    for chunk in chunks:
        if not len(chunk):
            continue
        if found is None:
            longest_us = max(_LONGEST_US, span_us)
            found = Densest(int(chunk.t[0]), span_us=span_us, longest_us=longest_us, enough=_ENOUGH, most=MOST_EVENTS)
        found.add(chunk, np.zeros(len(chunk), np.bool_))
    return None if found is None else found.events()


def _motion(
    chunks: Callable[[], Iterable[Events]], events: Events, settings: Settings, width: int, height: int
) -> MotionFeed:
    """Return the motion, followed to the end of the stretch where it is found on the way."""
    feed = open_motion(settings, sample=lambda: events, width=width, height=height).feed
    if feed.changes:
        if isinstance(feed, TrackedMotion):
            feed.hold_us = settings.motion.hold_us
        for chunk in chunks():
            feed.advance(chunk)
            if len(chunk) and int(chunk.t[-1]) > int(events.t[-1]):
                break
    return feed


def _speed(events: Events, feed: MotionFeed, settings: Settings) -> float:
    """Return the speed of the rim; refuse rest."""
    turning = events.select(_turning(events, feed, settings))
    speed_px_s = rim_speed_px_s(turning, feed, step_us=settings.motion.schedule_step_us)
    if speed_px_s * _LONGEST_US < 1e6 * _WARM_PX * 0.25:
        raise ConfigError(
            f"--motion {settings.motion.source}: edges move at {speed_px_s:.1f} px/s where the events are: too slow, "
            "or unknown there, to plan for"
        )
    return speed_px_s


def _turning(events: Events, feed: MotionFeed, settings: Settings) -> NDArray[np.bool_]:
    """Return which events lie on the disc that turns, bool[n]; all where no disc is declared or seen."""
    everything = np.ones(len(events), np.bool_)
    trajectory = feed.trajectory
    if trajectory is None:
        return everything
    center_px = trajectory.mean(start_us=int(events.t[0]), stop_us=int(events.t[-1]))[0]
    if center_px is None:
        return everything
    radius_px, seen = settings.report.disc_radius_px, True
    if radius_px is None:
        radius_px, seen = estimate_radius_px(events, center_px)
    inside: NDArray[np.bool_] = np.hypot(events.x - center_px[0], events.y - center_px[1]) <= radius_px
    return inside if seen and inside.any() else everything
