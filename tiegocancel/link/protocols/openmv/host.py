"""Run the script that streams events in the raw REPL of an OpenMV camera."""

from __future__ import annotations

import time

from tiegocancel.errors import LinkError
from tiegocancel.link.protocols.openmv.encoder import BEGUN, END
from tiegocancel.link.protocols.protocol import Line

__all__ = ["OpenMvHost"]

_SCRIPT = """\
import sys, time, binascii, csi
from ulab import numpy as np
events = np.zeros((2048, 6), dtype=np.uint16)
camera = csi.CSI(cid=csi.GENX320)
camera.reset()
camera.ioctl(csi.IOCTL_GENX320_SET_MODE, csi.GENX320_MODE_EVENT, 2048)
sys.stdout.write("<<<HEADER>>>\\nwidth=320\\nheight=320\\n<<<STREAM>>>\\n")
try:
    while True:
        n = camera.ioctl(csi.IOCTL_GENX320_READ_EVENTS, events)
        if n > 0:
            data = binascii.b2a_base64(events[:n].tobytes(), newline=False).decode()
            sys.stdout.write("C %d %s\\n" % (n, data))
except KeyboardInterrupt:
    pass
sys.stdout.write("<<<FOOTER>>>\\n<<<END>>>\\n")
"""


class OpenMvHost:
    """Run the script that streams in the raw REPL of the camera; stop it with Ctrl-C and leave with Ctrl-B."""

    def start(self, line: Line) -> str:
        """Start the stream; return what the camera says of itself. Raise :class:`LinkError` when it does not stream."""
        line.write(b"\r\x03\x03")
        _listen(line, 0.3, until=b"\0")
        line.drop_input()
        line.write(b"\x01")
        banner = _listen(line, 2.0, until=b"raw REPL")
        if b"raw REPL" not in banner:
            raise LinkError("", "no MicroPython answers: expected 'raw REPL' after Ctrl-A")
        line.drop_input()
        line.write(_SCRIPT.encode() + b"\x04")
        heard = _listen(line, 10.0, until=BEGUN)
        if BEGUN not in heard:
            told = heard.decode("ascii", "replace").strip().splitlines()
            raise LinkError("", f"the camera did not begin to stream: {told[-1] if told else 'no answer'}")
        text = banner.split(b"raw REPL")[0].decode("ascii", "replace").split()
        return " ".join(["OpenMV", *(word for word in text if word.isprintable() and word.isalnum())])

    def stop(self, line: Line) -> None:
        """Interrupt the script and leave the raw REPL."""
        line.write(b"\x03")
        _listen(line, 0.3, until=END)
        line.write(b"\x02")
        line.drop_input()


def _listen(line: Line, seconds: float, *, until: bytes) -> bytes:
    """Read for ``seconds``, or until ``until`` came; no more than that is read when it comes at the end."""
    heard, end = b"", time.monotonic() + seconds
    while until not in heard and (left := end - time.monotonic()) > 0:
        # One byte at a time near the marker: what comes behind it belongs to the stream.
        heard += line.read(1, left)
    return heard
