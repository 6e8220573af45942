"""``tiegocancel ports``: list serial ports and ask who is there."""

from __future__ import annotations

import argparse
import json
import sys

from tiegocancel.errors import LinkError

__all__ = ["add_parser", "run"]


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    parser = verbs.add_parser(
        "ports",
        help="list serial ports, and ask who is there",
        description="List the serial ports of this machine. With --probe each is opened at several bauds, reset as an "
        "eDVS host resets, and asked for its banner.",
    )
    parser.add_argument("port", nargs="*", metavar="PORT", help="these ports instead of all that the system lists")
    parser.add_argument("--probe", action="store_true", help="open each port and ask for a banner; this resets devices")
    parser.add_argument("--baud", type=int, metavar="B", help="probe at this baud only")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the verb."""
    from tiegocancel.link.ports import PROBE_BAUDS, Port, list_ports, probe

    found = list_ports()
    if args.port:
        known = {port.device: port for port in found}
        nothing = {"description": "", "usb": "", "serial_number": ""}
        found = [known.get(name, Port(device=name, **nothing)) for name in args.port]
    rows = []
    for port in found:
        row = port.to_json()
        if args.probe:
            try:
                row["found"] = probe(port.device, (args.baud,) if args.baud else PROBE_BAUDS)
            except LinkError as error:
                row["fault"] = str(error)
        rows.append(row)
    if args.json:
        sys.stdout.write(json.dumps({"ports": rows}) + "\n")
        return 0
    for row in rows:
        sys.stdout.write(_text(row) + "\n")
    if not rows:
        sys.stderr.write("no serial ports; 'tiegocancel emulate FILE --protocol edvs' makes one without hardware\n")
    return 0


def _text(row: dict[str, object]) -> str:
    """Say a port in a line."""
    names = ("device", "usb", "description", "serial_number")
    parts = [str(row[name]) for name in names if row[name] not in ("", "n/a")]
    if isinstance(row.get("found"), dict):
        parts.append("{protocol} at {baud} baud: {banner}".format(**row["found"]))  # type: ignore[arg-type]
    elif "fault" in row:
        parts.append(str(row["fault"]))
    elif "found" in row:
        parts.append("nobody known answers")
    return "  ".join(parts)
