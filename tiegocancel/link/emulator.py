"""Be a device on a line: answer its commands, and play a recording while the host lets it stream."""

from __future__ import annotations

import itertools
import re
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

from tiegocancel.errors import LinkError
from tiegocancel.events import Events
from tiegocancel.link.player import Pace, Played, Player
from tiegocancel.link.protocols.protocol import Device

__all__ = ["DeviceLine", "Emulator", "repeated"]

_IDLE_S = 0.01
_CREDIT_S = 0.001
_PAUSE_US = 1000
_COMMANDS = re.compile(rb"[^\n\0]*[\n\0]?", re.DOTALL)
"""Commands end with a line or, in a framed protocol, with a zero byte."""


class DeviceLine(Protocol):
    """A line that a device can serve without ever being stuck in it."""

    port: str
    ended: bool

    def read(self, most: int, timeout_s: float) -> bytes: ...

    def write(self, data: bytes) -> None: ...

    def write_some(self, data: bytes, timeout_s: float) -> int: ...


class Emulator:
    """Serve one line. The recording begins anew whenever the host starts the stream.

    ``stopped`` is asked often and ends it; ``tell`` takes remarks for the user; with ``at_once`` the device streams
    without being told to, as one without commands does. ``once``: end after the recording was played to its end.
    """

    def __init__(
        self,
        line: DeviceLine,
        device: Device,
        recording: Callable[[], Iterable[Events]],
        *,
        pace: Pace,
        stopped: Callable[[], bool] = lambda: False,
        tell: Callable[[str], None] = lambda remark: None,
        at_once: bool = False,
        once: bool = False,
    ) -> None:
        self.line, self.device, self.recording, self.pace = line, device, recording, pace
        self._stopped, self._tell = stopped, tell
        self._at_once, self._once = at_once, once
        self.plays: list[Played] = []
        self._restart = False
        self._replies = b""

    def serve(self) -> None:
        """Serve until stopped, or with ``once`` until the recording was played; raise :class:`LinkError`."""
        finished = False  # the recording was played, and the host has not stopped the stream since
        while not self._stopped():
            self._listen(_IDLE_S)
            self._answer()
            if not self._streams() or self._restart:
                finished = False
            if self._streams() and not finished:
                finished = self._play()
                if finished and self._once:
                    return

    def _streams(self) -> bool:
        return self._at_once or self.device.streaming

    def _play(self) -> bool:
        """Play the recording; return whether it came to its end."""
        self._restart = False
        player = Player(self.pace, self._send, self._tell)
        self.plays.append(player.played)
        return player.play(self.recording(), self.device.encoder()).ended

    def _send(self, data: bytes) -> bool:
        """Send bytes as the host takes them, and listen to it meanwhile; return whether it still lets us stream."""
        rest = memoryview(data)
        going = True
        while True:
            self._listen(0.0)
            going &= not self._stopped() and self._streams() and (self._at_once or not self._restart)
            if not rest:
                self._answer()
                if not going or self._has_credit():
                    return going
                time.sleep(_CREDIT_S)
                continue
            taken = self.line.write_some(bytes(rest), _IDLE_S)
            rest = rest[taken:]
            if not going and not taken:
                # The host reads no more. Otherwise the event under way is finished, as a device does.
                return False

    def _has_credit(self) -> bool:
        """Tell whether the host still takes frames, of a protocol with credits (see ``FramedDevice.allowance``)."""
        allowance: int | None = getattr(self.device, "allowance", None)
        return allowance is None or allowance > 0

    def _listen(self, timeout_s: float) -> None:
        """Take commands; the replies wait for a place between events."""
        data = self.line.read(4096, timeout_s)
        for command in _COMMANDS.findall(data):
            self._replies += self.device.receive(command)
            # Stopped and started within one read: the stream must begin anew all the same.
            self._restart |= not self.device.streaming
        if not data and timeout_s and self.line.ended:
            time.sleep(timeout_s)

    def _answer(self) -> None:
        """Send the replies that wait."""
        if self._replies:
            replies, self._replies = self._replies, b""
            self.line.write(replies)


def repeated(recording: Callable[[], Iterable[Events]], times: int | None) -> Iterator[Events]:
    """Yield a recording so many times (``None``: without end), one after the other in time."""
    shift_us = 0
    for _ in itertools.count() if times is None else range(times):
        first_us: int | None = None
        last_us = 0
        for chunk in recording():
            if not len(chunk):
                continue
            first_us = int(chunk.t[0]) if first_us is None else first_us
            last_us = int(chunk.t[-1])
            yield chunk if not shift_us else _shifted(chunk, shift_us)
        if first_us is None:
            raise LinkError("", "the recording holds no events to play")
        shift_us += last_us - first_us + _PAUSE_US


def _shifted(chunk: Events, shift_us: int) -> Events:
    return Events(chunk.t + shift_us, chunk.x, chunk.y, chunk.p, chunk.width, chunk.height, chunk.label)
