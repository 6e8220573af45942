"""Run with a device in the loop: what ``run SOURCE --to PORT`` does, and the software device that tests it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiegocancel.cli.settings import settings_from
from tiegocancel.errors import ConfigError

if TYPE_CHECKING:
    from tiegocancel.events import Events
    from tiegocancel.link.decider import Decide
    from tiegocancel.study.feed import MotionFeed
    from tiegocancel.study.settings import Settings

__all__ = ["RecordedSource", "fresh_canceller", "run_to_device"]

_PIECE_EVENTS = 4096


class RecordedSource:
    """Give a recording as a live source does, in small pieces."""

    def __init__(self, chunks: Any) -> None:
        self._chunks = chunks
        self._stopped = False

    def __iter__(self) -> Iterator[Events]:
        for chunk in self._chunks:
            for first in range(0, len(chunk), _PIECE_EVENTS):
                if self._stopped:
                    return
                yield chunk[first : first + _PIECE_EVENTS]

    def decided(self) -> None:
        """Measure nothing: a recording waits for nobody."""

    def stop(self) -> None:
        """End after the current piece."""
        self._stopped = True


def run_to_device(args: argparse.Namespace) -> int:
    """Run over a recording, with a device deciding the same events; 1 where it decides one of them otherwise."""
    settings = settings_from(args, {"motion": {"source": "fit"}})
    from tiegocancel.cli.progress import event_progress
    from tiegocancel.cli.run import sample_of
    from tiegocancel.cli.session import Session
    from tiegocancel.files import open_events
    from tiegocancel.link.device_loop import DeviceLoop
    from tiegocancel.link.line_options import LineOptions
    from tiegocancel.link.opening import open_line
    from tiegocancel.link.protocols.options import ProtocolOptions
    from tiegocancel.study.motion_source import motion_inputs, open_motion

    source = Path(args.source)
    line = LineOptions(baud=args.to_baud or args.baud, rtscts=bool(args.rtscts), exclusive=not args.shared)
    with open_events(source, **asdict(settings.read)) as reader:
        with event_progress("finding the motion", None) as advance:
            found = open_motion(
                settings, sample=lambda: sample_of(reader, settings, advance), width=reader.width, height=reader.height
            )
        if found.feed.changes:
            raise ConfigError(f"--to {args.to}: the device's motion must be known beforehand, not {found.feed.source}")
        _check(settings)
        options = ProtocolOptions(width=reader.width, height=reader.height)
        with DeviceLoop(open_line(args.to, line), options) as loop:
            sys.stderr.write(f"note: {args.to}: {loop.banner}\n")
            session = Session(args, settings, title=source.name, inputs=[source, *motion_inputs(settings)])
            code = session.run_with_device(
                RecordedSource(reader), found, loop, width=reader.width, height=reader.height, notes=reader.notes
            )
    if loop.first is not None:
        sys.stderr.write(f"tiegocancel: {loop.first.text()}; {loop.different:,} of {loop.compared:,} events differ\n")
        return 1
    sys.stderr.write(f"note: {args.to}: all {loop.compared:,} decisions equal the golden model's\n")
    return code


def fresh_canceller(args: argparse.Namespace, *, width: int, height: int) -> Callable[[], Decide]:
    """Return a function that makes a canceller as the flags say: the kernel's, or the plain model."""
    settings = settings_from(args, {"motion": {"source": "none"}})
    from tiegocancel.study.motion_source import open_motion

    if settings.motion.source == "none":
        raise ConfigError("--canceller: say the motion that it cancels with --motion")
    _check(settings)
    feed = open_motion(settings, sample=_no_sample, width=width, height=height).feed
    if feed.changes:
        raise ConfigError(f"--canceller: its motion must be known beforehand, not {feed.source}")
    return lambda: _Deciding(settings, feed, args.canceller, width, height)


class _Deciding:
    """Decide chunk by chunk; the schedule begins with the first event, as that of a run does."""

    def __init__(self, settings: Settings, feed: MotionFeed, kind: str, width: int, height: int) -> None:
        self._settings, self._feed, self._kind, self._size = settings, feed, kind, (width, height)
        self._canceller: Any = None

    def __call__(self, events: Events) -> Any:
        if self._canceller is None:
            self._canceller = self._made(int(events.t[0]))
        return self._canceller.process(events).suppressed

    def _made(self, first_us: int) -> Any:
        from tiegocancel.matching.canceller import Canceller
        from tiegocancel.matching.oracle import OracleCanceller

        config, step_us = self._settings.cancel, self._settings.motion.schedule_step_us
        motion = tuple(
            self._feed.schedule(horizon_us, start_us=first_us, stop_us=first_us, step_us=step_us)
            for horizon_us in config.horizons_us
        )
        width, height = self._size
        if self._kind == "oracle":
            return OracleCanceller(config, motion, width=width, height=height)
        return Canceller(config, motion, width=width, height=height)


def _check(settings: Settings) -> None:
    """Refuse what a device does not do."""
    if settings.guard.enabled or settings.filter.active:
        raise ConfigError("a device in the loop decides by the canceller alone: leave out --guard and the filters")
    if settings.motion.path == "float":
        raise ConfigError("--motion-path float: a device has the integer path")


def _no_sample() -> Events:
    raise ConfigError("--canceller: --motion fit looks at a recording, and a device has none")
