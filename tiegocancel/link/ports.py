"""Find serial ports, and ask what is behind them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from tiegocancel.errors import LinkError
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.serial_line import SerialLine

__all__ = ["PROBE_BAUDS", "Port", "list_ports", "probe"]

PROBE_BAUDS = (12_000_000, 8_000_000, 6_000_000, 4_000_000, 2_000_000, 921_600, 115_200)
"""Tried in this order: the bauds of the eDVS family that libcaer tries, then what microcontrollers use."""

_LISTEN_S = 0.15
_MOST_BYTES = 1024
_BANNERS = ((b"edvs", "edvs"), (b"dvs128", "edvs"), (b"openmv", "openmv"), (b"micropython", "openmv"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Port:
    """A serial port of this machine; ``usb`` is ``vendor:product`` in hex, empty where it is no USB port."""

    device: str
    description: str
    usb: str
    serial_number: str

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)


def list_ports() -> list[Port]:
    """Return the serial ports that the system lists, in the order of their names."""
    from serial.tools import list_ports as system

    return [
        Port(
            device=found.device,
            description=found.description or "",
            usb="" if found.vid is None else f"{found.vid:04x}:{found.pid:04x}",
            serial_number=found.serial_number or "",
        )
        for found in sorted(system.comports(), key=lambda found: str(found.device))
    ]


def probe(port: str, bauds: tuple[int, ...] = PROBE_BAUDS) -> dict[str, Any] | None:
    """Ask a port for a banner at several bauds; return protocol, baud and banner, ``None`` where nobody is known.

    What is sent: an empty line, ``E-`` and ``R``, as hosts of an eDVS begin; never ``P``, which starts its boot loader.
    Raise :class:`LinkError` when the port does not open.
    """
    for baud, line in _lines(port, bauds):
        with line:
            line.write(b"\n")
            _heard(line)
            line.write(b"E-\nR\n")
            banner = _heard(line)
        for mark, protocol in _BANNERS:
            if mark in banner.lower():
                text = " ".join(banner.decode("ascii", "replace").split())
                return {"protocol": protocol, "baud": baud, "banner": text[:200]}
    return None


def _lines(port: str, bauds: tuple[int, ...]) -> Iterator[tuple[int, SerialLine]]:
    """Open a port at each baud that it can do; raise when it can do none."""
    fault: LinkError | None = None
    opened = False
    for baud in bauds:
        try:
            line = SerialLine(port, LineOptions(baud=baud, write_timeout_s=1.0))
        except LinkError as error:
            fault = error
            continue
        opened = True
        yield baud, line
    if fault is not None and not opened:
        raise fault


def _heard(line: SerialLine) -> bytes:
    """Read until nothing comes for a moment."""
    heard = b""
    while len(heard) < _MOST_BYTES and (more := line.read(_MOST_BYTES, _LISTEN_S)):
        heard += more
    return heard
