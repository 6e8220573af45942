"""Run the canceller and its controls over a stream, chunk by chunk, in constant memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Protocol

from tiegocancel.chunks import rechunk
from tiegocancel.errors import TiegoCancelError
from tiegocancel.events import Events
from tiegocancel.interrupt import deferred_interrupt
from tiegocancel.motion.trajectory import Trajectory
from tiegocancel.study.feed import FixedMotion, MotionFeed, TrackedMotion
from tiegocancel.study.one_pass import OnePass
from tiegocancel.study.prefilter import Prefilter
from tiegocancel.study.result import INTERRUPTED, RunResult
from tiegocancel.study.settings import Settings

__all__ = ["run_stream"]

_HEAD_EVENTS = 1 << 19
"""The disc is told by this many events at the beginning, whatever the chunks."""


class _Sink(Protocol):
    """Take residual events; an ``EventWriter`` does."""

    def write(self, events: Events) -> None: ...


def run_stream(
    chunks: Iterable[Events],
    settings: Settings,
    motion: Trajectory | MotionFeed,
    *,
    sink: _Sink | None = None,
    disc_radius_px: float | None = None,
    expected_us: int | None = None,
    progress: Callable[[Events], None] | None = None,
) -> RunResult | None:
    """Cancel a stream, write what remains to ``sink``, measure it; return ``None`` for a stream without events.

    Events that the filters of the settings remove are counted, and are neither residual nor part of any ratio.
    ``motion`` is known beforehand, or a feed that finds it as the stream passes. ``disc_radius_px`` is used where the
    settings leave it open; pictures are taken half-way through ``expected_us`` of stream, or after the warm-up where
    that is unknown. When ``chunks`` raises a :class:`TiegoCancelError`, what came before counts and the error's line
    stands in ``RunResult.fault``; so it is when the user interrupts, who is heard between chunks.
    """
    feed = FixedMotion(motion) if isinstance(motion, Trajectory) else motion
    if isinstance(feed, TrackedMotion):
        feed.hold_us = settings.motion.hold_us
    prefilter = Prefilter(settings.filter)
    run: OnePass | None = None
    fault: str | None = None
    size = settings.report.chunk_events
    source = iter(rechunk(prefilter.kept(chunks), max(size, _HEAD_EVENTS)))
    with deferred_interrupt() as interrupt:
        while fault is None:
            try:
                block = next(source)
            except StopIteration:
                break
            except (TiegoCancelError, KeyboardInterrupt) as error:
                if run is None:
                    raise
                fault = INTERRUPTED if isinstance(error, KeyboardInterrupt) else str(error)
                break
            if run is None:
                run = OnePass(settings, feed, block[:_HEAD_EVENTS], disc_radius_px, expected_us)
            for first in range(0, len(block), size):
                chunk = block[first : first + size]
                residual = run.process(chunk)
                if sink is not None:
                    sink.write(residual)
                if progress is not None:
                    progress(chunk)
                if interrupt.wanted:
                    fault = INTERRUPTED
                    break
    if run is None:
        prefilter.check_something_left()
        return None
    return replace(run.finish(fault), filtered=prefilter.counters, filter_state=prefilter.state)
