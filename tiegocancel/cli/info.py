"""``tiegocancel info FILE``: say what a recording holds."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from tiegocancel.cli.options import add_reading_options, reader_from
from tiegocancel.cli.progress import event_progress
from tiegocancel.units import rate_text

__all__ = ["add_parser", "run"]


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "info",
        help="say what a recording holds",
        description="Read a recording once and say its format, sensor, span, rate and whatever is odd about it.",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    add_reading_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    facts = _facts(args)
    if args.json:
        sys.stdout.write(json.dumps(facts) + "\n")
    else:
        sys.stdout.writelines(f"{name:<12}{value}\n" for name, value in _table(facts))
    return 0


def _facts(args: argparse.Namespace) -> dict[str, Any]:
    """Read the recording and collect what is said about it."""
    from tiegocancel.files.summary import RecordingSummary

    summary = RecordingSummary()
    with reader_from(args, args.file) as reader, event_progress("reading", None) as advance:
        for chunk in reader:
            summary.add(chunk)
            advance(chunk)
        return {
            "file": str(args.file),
            "format": reader.format,
            "width": reader.width,
            "height": reader.height,
            "events": summary.events,
            "first_us": summary.first_us,
            "last_us": summary.last_us,
            "span_us": summary.span_us,
            "mean_rate_hz": summary.mean_hz,
            "peak_rate_hz": summary.peak_hz,
            "on_share": summary.on_share,
            "time_unit": reader.time_unit,
            "labelled": reader.labelled,
            "faults": reader.faults,
            "notes": list(reader.notes),
        }


def _table(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """Arrange the facts for people."""
    rows = [
        ("file", facts["file"]),
        ("format", facts["format"]),
        ("sensor", f"{facts['width']}x{facts['height']} px"),
        ("events", f"{facts['events']:,}"),
    ]
    if facts["events"]:
        rows += [
            ("first", f"{facts['first_us']:,} µs"),
            ("last", f"{facts['last_us']:,} µs"),
            ("span", f"{facts['span_us'] / 1e6:.6f} s"),
            ("mean rate", "-" if facts["mean_rate_hz"] is None else rate_text(facts["mean_rate_hz"])),
            ("peak rate", f"{rate_text(facts['peak_rate_hz'])} (in 1 ms)"),
            ("ON share", f"{facts['on_share']:.3f}"),
        ]
    rows += [("time unit", facts["time_unit"]), ("labels", "yes" if facts["labelled"] else "no")]
    return rows + [("note", note) for note in facts["notes"]]
