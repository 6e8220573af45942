"""``tiegocancel emulate FILE``: be a device on a pseudo-terminal, for trying and testing without hardware."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from pathlib import Path

from tiegocancel.cli.link_options import add_protocol_options
from tiegocancel.cli.options import reader_from
from tiegocancel.cli.playing import add_playing_options, serve
from tiegocancel.cli.settings import add_cancel_options

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
    parser.add_argument(
        "source", nargs="?", type=Path, metavar="FILE", help="recording: npz, npy, csv, txt, raw, dat, aedat, …"
    )
    group = add_protocol_options(parser, required=True)
    group.add_argument("--symlink", type=Path, metavar="PATH", help="a second name for the port, removed at the end")
    group.add_argument("--at-once", action="store_true", help="stream without waiting for a command")
    group.add_argument("--once", action="store_true", help="end once the recording was played and read")
    add_playing_options(parser, group)
    group.add_argument(
        "--canceller",
        choices=("kernel", "oracle"),
        help="be a device that cancels, for 'run --to': no FILE, the framed protocol, --width, --height, --motion",
    )
    group.add_argument("--motion", metavar="M", help="motion that the canceller knows: CX,CY,OMEGA or a file")
    add_cancel_options(parser)
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML file with the canceller's settings")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb until Ctrl-C, or with ``--once`` until the recording was played."""
    from tiegocancel.errors import ConfigError
    from tiegocancel.link.pseudo_terminal import PseudoTerminal

    signal.signal(signal.SIGTERM, _leave)
    if args.canceller is not None:
        return _cancel(args)
    if args.source is None:
        raise ConfigError("FILE is missing: the recording that the device plays")
    with reader_from(args, args.source) as reader, PseudoTerminal() as line:

        def ready() -> None:
            if args.symlink is not None:
                line.name(args.symlink)
            port = line.port if args.symlink is None else f"{args.symlink} ({line.port})"
            sys.stderr.write(f"{args.protocol} device with {args.source.name} at {port}; Ctrl-C ends it\n")
            if not args.json:
                sys.stdout.write(f"{line.port}\n")
                sys.stdout.flush()

        code = serve(args, reader, line, at_once=args.at_once, once=args.once, ready=ready)
        deadline_s = time.monotonic() + _LAST_BYTES_S
        while args.once and not code and line.unread and time.monotonic() < deadline_s:
            time.sleep(0.01)
        return code


def _leave(number: int, frame: object) -> None:
    """Go the orderly way when terminated, so that no second name of a port is left behind."""
    raise SystemExit(128 + number)


def _cancel(args: argparse.Namespace) -> int:
    """Be a device that decides what it is sent."""
    from tiegocancel.cli.device_loop import fresh_canceller
    from tiegocancel.errors import ConfigError
    from tiegocancel.interrupt import deferred_interrupt
    from tiegocancel.link.decider import DeciderDevice
    from tiegocancel.link.emulator import Emulator
    from tiegocancel.link.player import Pace
    from tiegocancel.link.protocols.options import ProtocolOptions
    from tiegocancel.link.pseudo_terminal import PseudoTerminal

    if args.protocol != "framed" or args.source is not None:
        raise ConfigError("--canceller: speaks the framed protocol (--protocol framed) and plays no FILE")
    if args.width is None or args.height is None:
        raise ConfigError("--canceller: say the sensor with --width and --height")
    fresh = fresh_canceller(args, width=args.width, height=args.height)
    device = DeciderDevice(ProtocolOptions(width=args.width, height=args.height), fresh)
    with PseudoTerminal() as line, deferred_interrupt() as interrupt:
        if args.symlink is not None:
            line.name(args.symlink)
        sys.stderr.write(f"device that cancels at {args.symlink or line.port}; Ctrl-C ends it\n")
        sys.stdout.write(f"{line.port}\n")
        sys.stdout.flush()
        Emulator(line, device, list, pace=Pace(), stopped=lambda: interrupt.wanted).serve()
    return 0
