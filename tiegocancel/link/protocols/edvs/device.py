"""Answer commands as the firmware of an eDVS-4337 does, for emulation."""

from __future__ import annotations

import re
from dataclasses import replace

from tiegocancel.link.protocols.edvs.encoder import EdvsClock, EdvsEncoder, Sensors
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["EdvsDevice"]

_BANNER = b"\nEDVS-4337, emulated by tiegocancel\nSystem Clock: 192MHz; 1us event time resolution\n"
_FORMATS = (
    b"List of available event data formats:\n"
    b" !E0   - 2 bytes per event, binary: 1yyyyyyy.pxxxxxxx (default)\n"
    b" !E1   - 3..6 bytes per event, 1..4 bytes delta-timestamp (7bits each)\n"
    b" !E2   - 4 bytes per event (as !E0 followed by 16bit timestamp)\n"
    b" !E3   - 5 bytes per event (as !E0 followed by 24bit timestamp)\n"
    b" !E4   - 6 bytes per event (as !E0 followed by 32bit timestamp)\n\n"
    b" Every timestamp has 1us resolution\n\n"
)
_HELP = (
    b"\nSupported Commands:\n\n"
    b" E+/-                  - enable/disable event sending\n"
    b" !Ex                   - specify event data format, ??E to show options\n"
    b" !ETx                  - set current timestamp to x (default: 0)\n"
    b" !U[0,1,2]             - UART echo mode (none, cmd-reply, all)\n"
    b" !S+b,p                - enable sensors streaming\n"
    b" !S-[b]                - disable sensors streaming\n"
    b" R                     - reset board\n"
    b" ?V                    - display firmware version\n"
    b" ??                    - display (this) help menu\n\n"
)
_LONGEST = 128
_SET_ERROR, _GET_ERROR, _UNKNOWN = b"Set: parsing error\n", b"Get: parsing error\n", b"?\n"


class EdvsDevice:
    """Hold the state that commands change: format, echo, clock, sensors, and whether events are sent.

    ``streaming`` tells whether events go out now. After ``R`` all is as at power-on: E0, echo of every character, no
    events. What is not understood is answered as the firmware answers it. Commands of the Mini-eDVS (``+``, ``-``,
    ``?V``) are taken too. ``P`` and ``pRog``, the boot loader, are refused.
    """

    def __init__(self, options: ProtocolOptions) -> None:
        self._options = options
        self._format = options.edvs_format
        self._clock = EdvsClock()
        self._sensors = Sensors()
        self._command = b""
        self._echo = 0
        self.streaming = False

    def receive(self, data: bytes) -> bytes:
        """Take bytes from the host; return the reply."""
        reply = b""
        for byte in data:
            quiet = self.streaming or not self._echo
            if byte in b"\r\n":
                reply += b"" if quiet else b"\n"
                command, self._command = self._command, b""
                reply += self._obey(command.decode("ascii")) if command else b""
            elif byte < 0x80:
                reply += b"" if quiet else bytes([byte])
                self._command = (self._command if len(self._command) < _LONGEST - 1 else b"") + bytes([byte])
        return reply

    def encoder(self) -> EdvsEncoder:
        """Return an encoder of the format that the host has chosen, on the device's clock."""
        options = replace(self._options, edvs_format=self._format)
        return EdvsEncoder(options, clock=self._clock, sensors=self._sensors)

    def _obey(self, command: str) -> bytes:
        if command in ("E+", "+", "E-", "-", "e+", "e-"):
            self.streaming = command.endswith("+")
            return b""
        if command in ("R", "r"):
            return self._reset()
        if command.startswith("!"):
            return self._set(command[1:].upper())
        if command.startswith("?"):
            return self._get(command[1:].upper())
        if command[0] in "Pp":
            return b"the boot loader is not emulated\n"
        return _UNKNOWN

    def _reset(self) -> bytes:
        self._format, self._echo, self.streaming = "E0", 2, False
        self._sensors.bitmap = 0
        self._clock.set(0)
        return _BANNER

    def _get(self, what: str) -> bytes:
        if what == "E":
            return f"-{self._format}\n".encode()
        if what == "V":
            return _BANNER
        return {"?E": _FORMATS, "?": _BANNER + _HELP}.get(what, _GET_ERROR)

    def _set(self, what: str) -> bytes:
        if what in ("E0", "E1", "E2", "E3", "E4"):
            self._format = what
            return f"-{what}\n".encode() if self._echo > 1 and not self.streaming else b""
        if what in ("U0", "U1", "U2"):
            self._echo = int(what[1])
            return b""
        if clock := re.fullmatch(r"ET=?(\d*)", what):
            self._clock.set(int(clock[1] or 0))
            return b""
        if on := re.fullmatch(r"S\+(\d+),(\d+)", what):
            self._sensors.bitmap |= int(on[1])
            self._sensors.period_ms = max(int(on[2]), 1)
            return b""
        if off := re.fullmatch(r"S-(\d*)", what):
            self._sensors.bitmap &= ~int(off[1]) if off[1] else 0
            return b""
        if re.fullmatch(r"B(\d+=\d+|F|D\d)|L\d|U=\d+|EF[+-]|EP[+\-A]|ED=\d+|ETM[0+]|ETS|ETI", what):
            # Understood by the device and without effect on a recording.
            return b""
        return _SET_ERROR
