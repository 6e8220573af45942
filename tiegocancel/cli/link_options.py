"""Flags of everything that talks over a link, shared by every verb that does."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tiegocancel.link.event_queue import QueueOptions
    from tiegocancel.link.line_options import LineOptions
    from tiegocancel.link.protocols.options import ProtocolOptions
    from tiegocancel.link.source import Limits

__all__ = [
    "add_line_options",
    "add_protocol_options",
    "add_queue_options",
    "limits_from",
    "line_from",
    "protocol_from",
    "queue_from",
]

PROTOCOLS = "edvs, evt2, evt3, openmv, framed"
DEFAULT_BAUD = 4_000_000


def add_protocol_options(parser: argparse.ArgumentParser, *, required: bool = False) -> argparse._ArgumentGroup:
    """Add what both ends must agree on; return the group, for more of a verb's own."""
    group = parser.add_argument_group("link")
    group.add_argument("--protocol", metavar="P", required=required, help=f"wire protocol: {PROTOCOLS}")
    group.add_argument(
        "--edvs-format", choices=("E0", "E1", "E2", "E3", "E4"), default="E3", help="event format of an eDVS (E3)"
    )
    group.add_argument("--swap-xy", action="store_true", help="exchange the device's axes")
    group.add_argument("--flip-x", action="store_true", help="mirror the device's columns")
    group.add_argument("--flip-y", action="store_true", help="mirror the device's rows")
    group.add_argument("--on-bit", action="store_true", help="a set polarity bit of an eDVS means ON, not OFF")
    group.add_argument("--baud", type=int, default=DEFAULT_BAUD, metavar="B", help="bits/s of the line (4000000)")
    return group


def add_line_options(group: argparse._ArgumentGroup) -> None:
    """Add how a port is opened."""
    group.add_argument(
        "--rtscts", action=argparse.BooleanOptionalAction, help="hardware flow control (on for edvs, else off)"
    )
    group.add_argument("--shared", action="store_true", help="do not lock the port")
    group.add_argument("--reconnect", type=float, default=10.0, metavar="S", help="retry a lost port so long (10)")
    group.add_argument("--silence", type=float, default=30.0, metavar="S", help="stop after so long of nothing (30)")


def add_queue_options(group: argparse._ArgumentGroup) -> None:
    """Add what waits between line and canceller, and when to stop."""
    group.add_argument("--max-events", type=int, dest="stop_events", metavar="N", help="stop after so many events")
    group.add_argument("--duration", type=float, dest="stop_s", metavar="S", help="stop after so many seconds")
    group.add_argument("--queue", type=int, default=1 << 20, metavar="N", help="events that may wait (1048576)")
    group.add_argument(
        "--policy",
        choices=("block", "drop-oldest", "thin"),
        default="block",
        help="when processing falls behind (block: the line waits)",
    )
    group.add_argument("--hold-ms", type=float, default=5.0, metavar="MS", help="longest an event waits for others (5)")


def protocol_from(args: argparse.Namespace, *, sensor_bitmap: int = 0) -> ProtocolOptions:
    """Return the options of the protocol; ``--width`` and ``--height`` are taken where the verb has them."""
    from tiegocancel.link.protocols.options import ProtocolOptions

    return ProtocolOptions(
        width=getattr(args, "width", None) or 0,
        height=getattr(args, "height", None) or 0,
        edvs_format=args.edvs_format,
        swap_xy=args.swap_xy,
        flip_x=args.flip_x,
        flip_y=args.flip_y,
        off_bit=not args.on_bit,
        sensor_bitmap=sensor_bitmap,
    )


def line_from(args: argparse.Namespace) -> LineOptions:
    """Return how the line is opened."""
    from tiegocancel.link.line_options import LineOptions

    return LineOptions(
        baud=args.baud,
        rtscts=args.protocol == "edvs" if args.rtscts is None else args.rtscts,
        exclusive=not args.shared,
        reconnect_s=args.reconnect,
        silence_s=args.silence,
    )


def queue_from(args: argparse.Namespace) -> QueueOptions:
    """Return what waits between the two threads."""
    from tiegocancel.link.event_queue import QueueOptions

    return QueueOptions(
        capacity_events=args.queue,
        policy=args.policy,
        hold_s=args.hold_ms * 1e-3,
        chunk_events=min(QueueOptions().chunk_events, max(args.queue, 1)),
    )


def limits_from(args: argparse.Namespace) -> Limits:
    """Return when to stop."""
    from tiegocancel.link.source import Limits

    return Limits(max_events=args.stop_events, duration_s=args.stop_s)
