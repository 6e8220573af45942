"""Talk to an eDVS as libcaer does: reset, read the banner, choose the format, start; never the boot loader."""

from __future__ import annotations

import re
import time
from itertools import pairwise

from tiegocancel.errors import LinkError
from tiegocancel.link.protocols.edvs.layout import event_bytes
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.protocol import Line

__all__ = ["EdvsHost", "bytes_an_event"]

_BANNER = re.compile(rb"e?DVS", re.IGNORECASE)
_FORMAT = re.compile(r"!E(\d+)\s+-\s+(\d+)(\.\.\d+)? bytes per event")
_LEAST_ROWS = 24


class EdvsHost:
    """Start and stop a stream of ``options.edvs_format``.

    Firmware differs in what ``!E1`` to ``!E3`` mean. The host asks ``??E`` and takes the command that the device says
    gives the wanted size. A device that lists none is started and the size of its events measured; if it is another,
    the commands of firmware before delta stamps are tried (``!E1`` 16, ``!E2`` 24, ``!E3`` 32 bits).
    """

    def __init__(self, options: ProtocolOptions) -> None:
        self.options = options

    def start(self, line: Line) -> str:
        """Make the device stream; return its banner. Raise :class:`LinkError` when it is none or refuses."""
        line.write(b"\n")
        _listen(line, 0.05)
        line.drop_input()
        line.write(b"E-\nR\n")
        banner = _listen(line, 0.5, until=_BANNER)
        if not _BANNER.search(banner):
            found = repr(banner[:40])[1:] if banner else "nothing"
            raise LinkError("", f"is no eDVS at this baud: expected a banner with EDVS after R, got {found}")
        line.write(b"!U0\n")
        _listen(line, 0.05)
        line.drop_input()
        line.write(b"??E\n")
        formats = _listen(line, 0.15).decode("ascii", "replace")
        command, told = self._command(formats)
        line.drop_input()
        line.write(command + b"\n!ET0\n")
        if self.options.sensor_bitmap:
            line.write(b"!S+%d,%d\n" % (self.options.sensor_bitmap, self.options.sensor_period_ms))
        _listen(line, 0.02)
        line.drop_input()
        line.write(b"E+\n")
        if not told:
            self._verify(line)
        text = [part.strip() for part in banner.decode("ascii", "replace").splitlines()]
        return "\n".join(part for part in text if _printable(part))

    def stop(self, line: Line) -> None:
        """Make the device stop and forget what was under way."""
        line.write(b"E-\n")
        if self.options.sensor_bitmap:
            line.write(b"!S-\n")
        _listen(line, 0.05)
        line.drop_input()

    def _command(self, formats: str) -> tuple[bytes, bool]:
        """Return the command for the wanted format, and whether the device's own list named it."""
        wanted = self.options.edvs_format
        listed = [(int(number), int(size), bool(more)) for number, size, more in _FORMAT.findall(formats)]
        if not listed:
            return f"!{wanted}".encode(), wanted == "E1"
        for number, size, varies in listed:
            if varies == (wanted == "E1") and (varies or size == event_bytes(wanted)):
                return b"!E%d" % number, True
        offers = ", ".join(f"!E{number} of {size} bytes" for number, size, _ in listed)
        raise LinkError("", f"has no event format like {wanted}: it offers {offers}")

    def _verify(self, line: Line) -> None:
        """Measure the size of the events that come, and choose another command where it is not the wanted one."""
        wanted = event_bytes(self.options.edvs_format)
        older = {4: b"!E1", 5: b"!E2", 6: b"!E3"}.get(wanted)
        found = bytes_an_event(_listen(line, 0.2, most=4096))
        if found in (0, wanted):
            return
        if older is not None:
            line.write(b"E-\n" + older + b"\n")
            _listen(line, 0.05)
            line.drop_input()
            line.write(b"E+\n")
            if (found := bytes_an_event(_listen(line, 0.2, most=4096))) in (0, wanted):
                return
        raise LinkError("", f"sends events of {found} bytes, not the {wanted} of {self.options.edvs_format}")


def bytes_an_event(data: bytes) -> int:
    """Return the size of the events in ``data``, told by bit 7 of their first bytes and by times that rise; 0: unknown.

    A size is found where all boundaries of some offset bear bit 7, and the stamps step by less than a quarter of
    their range nearly always. Of several the smallest is meant: every multiple of a size fits too.
    """
    for size in (4, 5, 6, 2):
        for offset in range(size):
            rows = [data[at : at + size] for at in range(offset, len(data) - size + 1, size)]
            if len(rows) < _LEAST_ROWS or not all(row[0] & 0x80 for row in rows):
                continue
            if size == 2:
                return 2
            period = 1 << 8 * (size - 2)
            stamps = [int.from_bytes(row[2:], "big") for row in rows]
            steps = [(later - earlier) % period for earlier, later in pairwise(stamps)]
            if sum(step < period // 4 for step in steps) >= 0.95 * len(steps):
                return size
    return 0


def _listen(line: Line, seconds: float, *, until: re.Pattern[bytes] | None = None, most: int = 65_536) -> bytes:
    """Read for ``seconds``; with ``until`` only a little longer once it was seen."""
    heard, end = b"", time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0 and len(heard) < most:
        heard += line.read(4096, left)
        if until is not None and until.search(heard):
            end, until = min(end, time.monotonic() + 0.1), None
    return heard


def _printable(text: str) -> bool:
    return bool(text) and text.isascii() and text.isprintable()
