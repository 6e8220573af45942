"""Run the canceller over a stream that comes now: decide at once, count and compare a little later."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Protocol

import numpy as np

from tiegocancel.errors import TiegoCancelError
from tiegocancel.events import Events
from tiegocancel.interrupt import deferred_interrupt
from tiegocancel.matching.canceller import Decisions
from tiegocancel.motion.trajectory import Trajectory
from tiegocancel.study.feed import FixedMotion, MotionFeed, TrackedMotion
from tiegocancel.study.one_pass import OnePass
from tiegocancel.study.prefilter import Prefilter
from tiegocancel.study.result import INTERRUPTED, RunResult
from tiegocancel.study.settings import Settings

__all__ = ["LiveSource", "Watcher", "run_live", "warm_up"]

_SETTLE_EVENTS = 1 << 16
_SETTLE_S = 0.1
_MOST_ROWS = 60_000
"""Ten minutes of tracked motion, a row every 10 ms, are kept for the report; the file of the rows has them all."""


class LiveSource(Protocol):
    """Give chunks as they come, empty ones when nothing comes, until it is stopped."""

    def __iter__(self) -> Iterator[Events]: ...

    def decided(self) -> None:
        """Learn that the last chunk is decided and its residual handed on."""
        ...

    def stop(self) -> None:
        """End soon, after what was received already."""
        ...


class Watcher(Protocol):
    """Look on: every chunk with its decisions, and the pass so far; it must be quick."""

    def __call__(self, events: Events, decisions: Decisions | None, run: OnePass | None) -> None: ...


def warm_up(settings: Settings, motion: Trajectory | MotionFeed, *, width: int, height: int) -> None:
    """Compile and import what a run on a sensor of this size needs, so that the first events do not wait for it.

    ``motion`` is one of the kind that the run will have; it is used up.
    """
    rng = np.random.default_rng(0)
    radius, angle = 0.45 * min(width, height) * rng.random(40), 2 * np.pi * rng.random(40)
    t = np.arange(0, 80_000, 400)
    turned = angle + 8.0 * t[:, None] * 1e-6
    x, y = (
        np.floor(side / 2 + radius * wave(turned)).astype(int).ravel()
        for side, wave in ((width, np.cos), (height, np.sin))
    )
    few = Events(np.repeat(t, 40), x, y, np.tile(np.arange(40) % 2, len(t)), width, height)
    feed = FixedMotion(motion) if isinstance(motion, Trajectory) else motion
    for events in Prefilter(settings.filter).kept([few]):
        run = OnePass(settings, feed, events[:1], None, None, live=True) if len(events) else None
        for chunk in (events[:4000], events[4000:]):
            if run is not None and len(chunk):
                run.process(chunk)
        for control in run.controls.values() if run is not None else ():
            control.finish()


def run_live(
    source: LiveSource,
    settings: Settings,
    motion: Trajectory | MotionFeed,
    *,
    sink: Callable[[Events], None] | None = None,
    watch: Watcher | None = None,
    disc_radius_px: float | None = None,
) -> RunResult | None:
    """Cancel a live stream; hand what remains of each chunk to ``sink`` at once; ``None`` when no event came.

    As :func:`run_stream`, but chunks are decided as they come. Counting, pictures and controls follow every 0.1 s or
    65,536 events, and change no number. When the user interrupts, the source is stopped and what it still gives is
    decided; a :class:`TiegoCancelError` of the source ends the run as its fault.
    """
    feed = FixedMotion(motion) if isinstance(motion, Trajectory) else motion
    if isinstance(feed, TrackedMotion):
        feed.hold_us, feed.most_rows = settings.motion.hold_us, _MOST_ROWS
    prefilter = Prefilter(settings.filter)
    run: OnePass | None = None
    fault: str | None = None
    settled_s = time.monotonic()
    with deferred_interrupt() as interrupt:
        try:
            for chunk in source:
                decisions: Decisions | None = None
                for events in prefilter.kept([chunk] if len(chunk) else []):
                    if not len(events):
                        continue
                    if run is None:
                        run = OnePass(settings, feed, events, disc_radius_px, None, live=True)
                    decisions = run.decide(events)
                    if sink is not None:
                        sink(events.select(~decisions.suppressed))
                    chunk = events
                source.decided()
                if watch is not None:
                    watch(chunk, decisions, run)
                if run is not None and _due(run, settled_s):
                    run.settle()
                    settled_s = time.monotonic()
                if interrupt.wanted and fault is None:
                    fault = INTERRUPTED
                    source.stop()
        except TiegoCancelError as error:
            if run is None:
                raise
            fault = str(error)
        except KeyboardInterrupt:
            fault = INTERRUPTED
    if run is None:
        prefilter.check_something_left()
        return None
    return replace(run.finish(fault), filtered=prefilter.counters, filter_state=prefilter.state)


def _due(run: OnePass, settled_s: float) -> bool:
    """Tell whether enough was decided, or long enough ago, to count it."""
    waiting = sum(len(events) for events, _ in run.pending)
    return waiting >= _SETTLE_EVENTS or (waiting > 0 and time.monotonic() - settled_s >= _SETTLE_S)
