"""``tiegocancel record PORT FILE``: write what comes over a link into a recording."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from tiegocancel.cli.link_options import (
    add_line_options,
    add_protocol_options,
    add_queue_options,
    limits_from,
    line_from,
    protocol_from,
    queue_from,
)

__all__ = ["add_parser", "run"]


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "record",
        help="write what comes over a link into a recording",
        description="Record the events of a device. Whatever ends it, all but the last few ms are on disk: a killed "
        "recording is read from FILE.spool.npy (npz) or from the file itself (npy, csv, raw).",
    )
    parser.add_argument("port", metavar="PORT", help="/dev/tty…, COM3, socket://HOST:PORT, - (standard input), a file")
    parser.add_argument("target", type=Path, metavar="FILE", help="new recording: .npz, .npy, .csv or .raw (EVT2)")
    group = add_protocol_options(parser, required=True)
    add_line_options(group)
    add_queue_options(group)
    group.add_argument("--width", type=int, metavar="PX", help="sensor width, where the protocol does not say it")
    group.add_argument("--height", type=int, metavar="PX", help="sensor height, where the protocol does not say it")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb; 1 when the link failed, 130 when the user ended it, with what came before on disk."""
    from tiegocancel.cli.progress import event_progress
    from tiegocancel.errors import TiegoCancelError
    from tiegocancel.files import open_writer
    from tiegocancel.interrupt import deferred_interrupt
    from tiegocancel.link.source import LinkSource

    fault: str | None = None
    code = 0
    with LinkSource(
        args.port,
        args.protocol,
        line=line_from(args),
        queue=queue_from(args),
        options=protocol_from(args),
        limits=limits_from(args),
    ) as link:
        width, height = link.wait_for_size()
        with (
            open_writer(args.target, width=width, height=height) as writer,
            event_progress("recording", None) as advance,
            deferred_interrupt() as interrupt,
        ):
            try:
                for chunk in link:
                    if len(chunk):
                        writer.write(chunk)
                        advance(chunk)
                    link.decided()
                    if interrupt.wanted and not code:
                        code = 130
                        link.stop()
            except TiegoCancelError as error:
                fault, code = str(error), 1
        notes = [*link.notes(), *writer.notes]
    for note in notes:
        sys.stderr.write(f"note: {note}\n")
    sys.stderr.write(
        f"{writer.count:,} events of {width}×{height} px written to {args.target} ({writer.format}); "
        f"byte to disk {link.latency.text()}\n"
    )
    if fault is not None:
        sys.stderr.write(f"tiegocancel: {fault}\n")
    if args.json:
        facts = {"out": str(args.target), "format": writer.format, "fault": fault, "notes": notes, **link.to_json()}
        sys.stdout.write(json.dumps({**facts, "events": writer.count}) + "\n")
    return code
