"""Flags that say how a recording is to be read, shared by every verb that reads one."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tiegocancel.files import EventReader

__all__ = ["add_reading_options", "reader_from"]


def add_reading_options(parser: argparse.ArgumentParser) -> None:
    """Add the flags; one that is not given stays ``None``, and the file decides."""
    group = parser.add_argument_group("reading")
    group.add_argument("--width", type=int, metavar="PX", help="sensor width, where the file does not say it")
    group.add_argument("--height", type=int, metavar="PX", help="sensor height, where the file does not say it")
    group.add_argument("--time-unit", choices=("s", "ms", "us", "ns"), help="unit of time in text and plain arrays")
    group.add_argument(
        "--columns", metavar="ORDER", help="order of plain columns, as letters t x y p, - for one to skip: txyp, xypt-"
    )
    group.add_argument(
        "--format", metavar="NAME", help="format, where the header does not tell: text, evt2, evt3, dat, …"
    )
    group.add_argument("--undistort", metavar="CALIB", help="calibration file (TOML, calib.txt, YAML) of the lens")
    group.add_argument("--keep-going", action="store_true", help="keep the events before a fault, and say so")
    group.add_argument("--chunk-events", type=int, metavar="N", help="events read at a time (1048576)")


def reader_from(args: argparse.Namespace, path: Path) -> EventReader:
    """Open ``path`` as the flags of :func:`add_reading_options` say."""
    from tiegocancel.files import ReadOptions, open_events

    default = ReadOptions().chunk_events
    return open_events(
        path,
        width=args.width,
        height=args.height,
        time_unit=args.time_unit,
        columns=args.columns,
        chunk_events=default if args.chunk_events is None else args.chunk_events,
        keep_going=args.keep_going,
        undistort=args.undistort,
        format=args.format,
    )
