"""Answer as the raw REPL of an OpenMV camera does, for emulation."""

from __future__ import annotations

from tiegocancel.link.protocols.openmv.encoder import OpenMvEncoder
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["OpenMvDevice"]


class OpenMvDevice:
    """Answer as MicroPython's raw REPL does; any script that asks the GENX320 for events makes it stream."""

    def __init__(self, options: ProtocolOptions) -> None:
        self._options = options
        self._script = b""
        self._raw = False
        self.streaming = False

    def receive(self, data: bytes) -> bytes:
        """Take bytes from the host; return the reply."""
        reply = b""
        for byte in data:
            if byte == 0x03:
                reply += OpenMvEncoder(self._options).end() + b"\x04\x04>" if self.streaming else b""
                self.streaming, self._script = False, b""
            elif byte == 0x01:
                self._raw, self._script = True, b""
                reply += b"raw REPL; CTRL-B to exit\r\n>"
            elif byte == 0x02:
                self._raw = False
                reply += b"\r\nMicroPython, emulated by tiegocancel\r\n>>> "
            elif byte == 0x04 and self._raw:
                reply += self._run()
            elif self._raw:
                self._script += bytes([byte])
        return reply

    def encoder(self) -> OpenMvEncoder:
        """Return an encoder; its header is what the script prints first."""
        return OpenMvEncoder(self._options)

    def _run(self) -> bytes:
        script, self._script = self._script, b""
        if b"GENX320_READ_EVENTS" in script:
            self.streaming = True
            return b"OK"
        return b"OK\x04the emulated camera runs no other script\r\n\x04>"
