"""What ``replay`` and ``emulate`` share: a recording as a device on a line."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from tiegocancel.cli.link_options import protocol_from
from tiegocancel.cli.options import add_reading_options

if TYPE_CHECKING:
    from tiegocancel.events import Events
    from tiegocancel.files import EventReader
    from tiegocancel.link.emulator import DeviceLine
    from tiegocancel.link.player import Pace

__all__ = ["add_playing_options", "pace_from", "serve"]


def add_playing_options(parser: argparse.ArgumentParser, group: argparse._ArgumentGroup) -> None:
    """Add how a recording is played."""
    group.add_argument("--speed", type=float, default=1.0, metavar="X", help="times real time; 0: as fast as it goes")
    group.add_argument(
        "--when-full",
        choices=("slow", "thin"),
        default="slow",
        help="where the line does not carry the stream: slow the playback down (default) or thin the events out",
    )
    group.add_argument("--no-line-rate", action="store_true", help="send as fast as the other end takes, whatever B is")
    group.add_argument("--repeat", type=int, default=1, metavar="N", help="play it so many times; 0 without end (1)")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    add_reading_options(parser)


def pace_from(args: argparse.Namespace) -> Pace:
    """Return how fast the recording is played."""
    from tiegocancel.link.line_options import LineOptions
    from tiegocancel.link.player import Pace

    rate = 0.0 if args.no_line_rate else LineOptions(baud=args.baud).bytes_per_s
    return Pace(speed=args.speed, bytes_per_s=rate, when_full=args.when_full)


def serve(
    args: argparse.Namespace,
    reader: EventReader,
    line: DeviceLine,
    *,
    at_once: bool,
    once: bool,
    ready: Callable[[], None] = lambda: None,
) -> int:
    """Serve the line with the recording until Ctrl-C, or with ``once`` until it was played; print what was done.

    ``ready`` is called when the device is about to answer.
    """
    from tiegocancel.interrupt import deferred_interrupt
    from tiegocancel.link.emulator import Emulator, repeated
    from tiegocancel.link.protocols import registry

    options = replace(protocol_from(args), width=reader.width, height=reader.height)

    def recording() -> Iterable[Events]:
        reader.close()  # what an earlier play had begun to read
        return reader if args.repeat == 1 else repeated(lambda: reader, args.repeat or None)

    def tell(remark: str) -> None:
        sys.stderr.write(f"note: {remark}\n")

    with deferred_interrupt() as interrupt:
        emulator = Emulator(
            line,
            registry.device(args.protocol, options),
            recording,
            pace=pace_from(args),
            stopped=lambda: interrupt.wanted,
            tell=tell,
            at_once=at_once,
            once=once,
        )
        ready()
        emulator.serve()
    for played in emulator.plays:
        seconds = max(played.seconds, 1e-9)
        sys.stderr.write(
            f"{line.port}: {played.sent:,} events in {played.bytes:,} bytes ({played.bytes / seconds:,.0f} bytes/s), "
            f"{played.thinned:,} thinned out; {played.recording_s:.3f} s of recording in {played.seconds:.3f} s\n"
        )
    if args.json:
        facts = {"port": line.port, "plays": [played.to_json() for played in emulator.plays]}
        sys.stdout.write(json.dumps(facts) + "\n")
    return 130 if interrupt.wanted and once else 0
