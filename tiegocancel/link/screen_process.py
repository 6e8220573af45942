"""Draw a live run in a process of its own: neither a toolkit nor a terminal ever holds up the stream."""

from __future__ import annotations

import contextlib
import os
import pickle
import struct
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tiegocancel.link.live_view import Snapshot

__all__ = ["Picture", "ScreenProcess", "pictures"]

_LENGTH = struct.Struct("<I")

Picture = tuple[NDArray[np.int8], NDArray[np.int8], list[str]]
"""Signed counts before and after, int8[height, width] each, and the lines of text."""


class ScreenProcess:
    """Start ``python -m module`` and send it pictures; a screen that is closed ends the view, not the run."""

    def __init__(self, module: str) -> None:
        environment = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
        self._process = subprocess.Popen([sys.executable, "-m", module], stdin=subprocess.PIPE, env=environment)

    def draw(self, snapshot: Snapshot) -> bool:
        """Send a snapshot; return ``False`` when the screen is gone."""
        before, after = (image.clip(-128, 127).astype(np.int8) for image in snapshot.images())
        data = pickle.dumps((before, after, snapshot.numbers.lines()), protocol=5)
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(_LENGTH.pack(len(data)) + data)
            self._process.stdin.flush()
        except (OSError, ValueError):  # the process has ended, or its pipe was closed
            return False
        return self._process.poll() is None

    def close(self) -> None:
        """Close the screen and wait for its process."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(3.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def pictures() -> Iterator[Picture]:
    """Yield what comes over standard input, in the process of the screen, until the pipe ends."""
    while len(head := sys.stdin.buffer.read(_LENGTH.size)) == _LENGTH.size:
        # What comes is this program's own: the pipe has no other writer.
        picture: Picture = pickle.loads(sys.stdin.buffer.read(_LENGTH.unpack(head)[0]))
        yield picture
