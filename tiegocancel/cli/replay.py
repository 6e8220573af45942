"""``tiegocancel replay FILE PORT``: play a recording into a port as a device would."""

from __future__ import annotations

import argparse
from pathlib import Path

from tiegocancel.cli.link_options import add_line_options, add_protocol_options, line_from
from tiegocancel.cli.options import reader_from
from tiegocancel.cli.playing import add_playing_options, serve

__all__ = ["add_parser", "run"]


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "replay",
        help="play a recording into a port as a device would",
        description="Play a recording over a line at its own times, no byte faster than the baud carries. A line that "
        "does not carry the stream is told with the rate that it does carry, and the playback slows down or thins out.",
    )
    parser.add_argument("source", type=Path, metavar="FILE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    parser.add_argument("port", metavar="PORT", help="/dev/tty…, COM3, socket://HOST:PORT, a new file, - for stdout")
    group = add_protocol_options(parser, required=True)
    add_line_options(group)
    group.add_argument("--wait", action="store_true", help="stream only while the host's commands say so")
    add_playing_options(parser, group)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from tiegocancel.errors import ConfigError
    from tiegocancel.link.opening import open_output

    if args.port == "-" and args.json:
        raise ConfigError("PORT -: standard output takes either the events or --json")
    if args.wait and args.port == "-":
        raise ConfigError("--wait: nobody sends commands to standard output")
    with reader_from(args, args.source) as reader, open_output(args.port, line_from(args)) as line:
        return serve(args, reader, line, at_once=not args.wait, once=True)
