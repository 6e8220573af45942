"""``tiegocancel run SOURCE``: cancel a recording or a live link, with controls, figures and a report."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from tiegocancel.cli.link_options import add_line_options, add_protocol_options, add_queue_options
from tiegocancel.cli.options import add_reading_options
from tiegocancel.cli.progress import event_progress
from tiegocancel.cli.settings import (
    add_cancel_options,
    add_estimate_options,
    add_filter_options,
    add_output_options,
    settings_from,
)
from tiegocancel.errors import ConfigError

if TYPE_CHECKING:
    from tiegocancel.events import Events
    from tiegocancel.files import EventReader
    from tiegocancel.study.settings import Settings

__all__ = ["add_parser", "run", "sample_of"]

SAMPLE_EVENTS = 1 << 22
"""``--motion fit`` looks at this many events from the beginning of the recording."""


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "run",
        help="cancel the ego-motion of a recording or a live link",
        description="Cancel the ego-motion events of a recording, or of a device on a port as they come; write what "
        "remains, a report and a manifest.",
    )
    parser.add_argument(
        "source",
        metavar="SOURCE",
        help="recording (npz, npy, csv, txt, raw, dat, aedat, …); or, with --protocol, a port: /dev/tty…, COM3, "
        "socket://HOST:PORT, - for standard input, a file of bytes",
    )
    parser.add_argument(
        "--motion",
        metavar="M",
        help="fit (default of a recording: one rotation), track (default of a port: estimated on the way from past "
        "events), gyro, CX,CY,OMEGA in px and rad/s, a CSV of a tracker or of the verb motion, or a schedule file",
    )
    add_cancel_options(parser)
    add_filter_options(parser)
    add_estimate_options(parser)
    add_reading_options(parser)
    add_output_options(parser)
    group = add_protocol_options(parser)
    add_line_options(group)
    add_queue_options(group)
    group.add_argument("--live", action="store_true", help="show before and after, rates, ratios and latency meanwhile")
    group.add_argument(
        "--view", choices=("auto", "terminal", "window"), help="where --live shows it (auto: a window on a display)"
    )
    group.add_argument("--residual-to", metavar="PORT", help="send what remains onward: a port, a file, - for stdout")
    group.add_argument("--residual-baud", type=int, metavar="B", help="bits/s of that port (as --baud)")
    group.add_argument(
        "--to", metavar="PORT", help="send the recording to a device that cancels, and compare its every decision"
    )
    group.add_argument("--to-baud", type=int, metavar="B", help="bits/s of that port (as --baud)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from tiegocancel.link.opening import is_port

    if args.protocol is not None or is_port(args.source):
        from tiegocancel.cli.live import run_link

        return run_link(args)
    if args.live or args.view is not None:
        raise ConfigError("--live: shows a live link; a recording has its report")
    if args.to is not None:
        from tiegocancel.cli.device_loop import run_to_device

        return run_to_device(args)
    if args.residual_to is not None:
        raise ConfigError("--residual-to: needs --protocol, the protocol to speak there")
    settings = settings_from(args)
    source = Path(args.source)
    from tiegocancel.cli.session import Session
    from tiegocancel.files import open_events
    from tiegocancel.study.motion_source import motion_inputs, open_motion

    with open_events(source, **asdict(settings.read)) as reader:
        with event_progress("finding the motion", None) as advance:
            found = open_motion(
                settings, sample=lambda: sample_of(reader, settings, advance), width=reader.width, height=reader.height
            )
        session = Session(args, settings, title=source.name, inputs=[source, *motion_inputs(settings)])
        return session.run(
            reader,
            found,
            width=reader.width,
            height=reader.height,
            labelled=reader.labelled,
            notes=reader.notes,
        )


def sample_of(reader: EventReader, settings: Settings, advance: Callable[[Events], None]) -> Events:
    """Read the events that the fit may look at; a fault further on is left to the run itself."""
    from tiegocancel.errors import TiegoCancelError
    from tiegocancel.events import Events
    from tiegocancel.study.prefilter import Prefilter

    parts = [Events.empty(reader.width, reader.height)]
    count = 0
    try:
        for chunk in Prefilter(settings.filter).kept(reader):
            parts.append(chunk)
            advance(chunk)
            count += len(chunk)
            if count > SAMPLE_EVENTS:
                break
    except TiegoCancelError:
        if not count:
            raise
    if count > SAMPLE_EVENTS:
        reader.notes.append(f"the fit looks at the first {SAMPLE_EVENTS:,} events only")
    return Events.concatenate(parts)[:SAMPLE_EVENTS]
