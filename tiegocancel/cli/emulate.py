"""``tiegocancel emulate FILE``: be a device on a pseudo-terminal, for trying and testing without hardware."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from tiegocancel.cli.link_options import add_protocol_options
from tiegocancel.cli.options import reader_from
from tiegocancel.cli.playing import add_playing_options, serve

__all__ = ["add_parser", "run"]

_LAST_BYTES_S = 5.0


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "emulate",
        help="be a device on a pseudo-terminal that plays a recording",
        description="Make a pseudo-terminal, print its path, answer the host's commands as the device would, and play "
        "the recording, from its beginning, whenever the host starts the stream. Linux and macOS.",
    )
    parser.add_argument("source", type=Path, metavar="FILE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    group = add_protocol_options(parser, required=True)
    group.add_argument("--symlink", type=Path, metavar="PATH", help="a second name for the port, removed at the end")
    group.add_argument("--at-once", action="store_true", help="stream without waiting for a command")
    group.add_argument("--once", action="store_true", help="end once the recording was played and read")
    add_playing_options(parser, group)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb until Ctrl-C, or with ``--once`` until the recording was played."""
    from tiegocancel.link.pseudo_terminal import PseudoTerminal

    with reader_from(args, args.source) as reader, PseudoTerminal(symlink=args.symlink) as line:
        port = line.port if args.symlink is None else f"{args.symlink} ({line.port})"
        sys.stderr.write(f"{args.protocol} device with {args.source.name} at {port}; Ctrl-C ends it\n")
        if not args.json:
            sys.stdout.write(f"{line.port}\n")
            sys.stdout.flush()
        code = serve(args, reader, line, at_once=args.at_once, once=args.once)
        deadline_s = time.monotonic() + _LAST_BYTES_S
        while args.once and not code and line.unread and time.monotonic() < deadline_s:
            time.sleep(0.01)
        return code
