"""``tiegocancel convert IN OUT``: write a recording in another format."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from pathlib import Path

from tiegocancel.cli.options import add_reading_options, reader_from
from tiegocancel.cli.progress import event_progress
from tiegocancel.errors import ConfigError

__all__ = ["add_parser", "run"]


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "convert",
        help="write a recording in another format",
        description="Read a recording and write it as NPZ, NPY, CSV or Prophesee RAW EVT2, chunk by chunk.",
    )
    parser.add_argument("source", type=Path, metavar="IN", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    parser.add_argument("target", type=Path, metavar="OUT", help="new file: .npz, .npy, .csv, .txt or .raw (EVT2)")
    parser.add_argument("--sort", action="store_true", help="read the file whole and sort it by time, stably")
    parser.add_argument(
        "--to-format", metavar="NAME", help="npz, npy, csv or evt2, where the suffix of OUT says nothing"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    add_reading_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from tiegocancel.events import Events
    from tiegocancel.files import open_writer

    if args.target.exists() and args.source.exists() and args.target.samefile(args.source):
        raise ConfigError(f"{args.target} is the recording itself: write to another file")
    notes: list[str] = []
    with reader_from(args, args.source) as reader:
        chunks: Iterable[Events] = [reader.read()] if args.sort else reader
        try:
            with (
                open_writer(
                    args.target,
                    width=reader.width,
                    height=reader.height,
                    labelled=reader.labelled,
                    format=args.to_format,
                ) as writer,
                event_progress("converting", None) as advance,
            ):
                notes += writer.notes
                for chunk in chunks:
                    if len(chunk):
                        writer.write(chunk)
                        advance(chunk)
        finally:
            notes = [*reader.notes, *notes]
            sys.stderr.writelines(f"note: {note}\n" for note in notes)
    sys.stderr.write(f"{writer.count:,} events written to {args.target} ({writer.format})\n")
    if args.json:
        facts = {"out": str(args.target), "format": writer.format, "events": writer.count, "notes": notes}
        sys.stdout.write(json.dumps(facts) + "\n")
    return 0
