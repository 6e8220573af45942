"""Talk over whatever ``serial.serial_for_url`` opens: real ports, ``socket://``, ``loop://``, ``rfc2217://``."""

from __future__ import annotations

import contextlib
import os
import struct
import sys
import time
from types import TracebackType
from typing import Any, Self

from tiegocancel.errors import LinkError
from tiegocancel.link.descriptor import read_some, write_all, write_some
from tiegocancel.link.line_options import LineOptions

__all__ = ["SerialLine"]

_SLICE_BYTES = 1024
_TIOCGICOUNT = 0x545D
_POLL_S = 0.02
_EMPTY_READS, _EMPTY_WAIT_S = 20, 0.001


class SerialLine:
    """One open port, a :class:`~tiegocancel.link.protocols.protocol.Line`; raise :class:`LinkError` for its faults.

    Where the system gives a descriptor (POSIX ports and sockets) it is waited on directly, because pyserial's own
    ``read`` waits for a full buffer or its timeout. ``ended`` is never true: a port may come back; ``answers``: there
    is a device to talk to.
    """

    ended = False
    answers = True

    def __init__(self, port: str, options: LineOptions) -> None:
        import serial

        self.port, self.options = port, options
        try:
            self._serial: Any = serial.serial_for_url(
                port,
                baudrate=options.baud,
                rtscts=options.rtscts,
                exclusive=options.exclusive or None,
                timeout=_POLL_S,
                # RFC 2217 in pyserial knows none, and refuses the attempt.
                write_timeout=None if port.lower().startswith("rfc2217:") else options.write_timeout_s,
            )
        except (OSError, ValueError, NotImplementedError) as error:
            raise LinkError(port, f"cannot be opened: {_reason(port, error)}") from None
        self._descriptor = _descriptor_of(self._serial)
        self._empty_reads = 0
        self._losses_before = _driver_losses(self._descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def read(self, most: int, timeout_s: float) -> bytes:
        """Return up to ``most`` bytes, as soon as there are any, nothing after ``timeout_s``."""
        if self._descriptor is not None:
            data = read_some(self._descriptor, most, timeout_s, port=self.port)
            # A terminal may seem ready once and hold nothing; one that is gone does so for ever.
            self._empty_reads = self._empty_reads + 1 if data is None else 0
            if self._empty_reads > _EMPTY_READS:
                raise LinkError(self.port, "the line is gone: the other end has closed it")
            if data is None:
                time.sleep(_EMPTY_WAIT_S)
            return data or b""
        # The timeout stays as it is: a new one makes pyserial set up a port of another machine again.
        deadline_s = time.monotonic() + timeout_s
        try:
            while not (waiting := int(self._serial.in_waiting)):
                if time.monotonic() >= deadline_s:
                    return b""
                if first := bytes(self._serial.read(1)):
                    return first + bytes(self._serial.read(min(most - 1, int(self._serial.in_waiting))))
            return bytes(self._serial.read(min(most, waiting)))
        except (OSError, ValueError) as error:
            raise LinkError(self.port, f"the line is gone: {error}") from None

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        if self._descriptor is not None:
            write_all(self._descriptor, data, self.options.write_timeout_s, port=self.port)
            return
        try:
            for first in range(0, len(data), _SLICE_BYTES):
                self._serial.write(data[first : first + _SLICE_BYTES])
        except (OSError, ValueError) as error:
            raise LinkError(self.port, f"the line takes no bytes: {error}") from None

    def write_some(self, data: bytes, timeout_s: float) -> int:
        """Send what is taken within ``timeout_s``, perhaps nothing; return how many bytes that were."""
        if self._descriptor is not None:
            return write_some(self._descriptor, data, timeout_s, port=self.port)
        self.write(data[:_SLICE_BYTES])
        return min(len(data), _SLICE_BYTES)

    def drop_input(self) -> None:
        """Forget what has come and was not read."""
        deadline = time.monotonic() + 0.5
        while self.read(1 << 16, 0.0) and time.monotonic() < deadline:
            pass

    def overruns(self) -> int:
        """Return how many bytes the driver says it lost since the port was opened; 0 where it does not say (Linux)."""
        return max(_driver_losses(self._descriptor) - self._losses_before, 0)

    def close(self) -> None:
        """Close the port; a second call does nothing."""
        with contextlib.suppress(OSError, ValueError):
            self._serial.close()


def _descriptor_of(port: Any) -> int | None:
    """Return the descriptor of a POSIX port or a socket, ``None`` where there is none to wait on."""
    if os.name != "posix":
        return None
    try:
        descriptor = port.fileno()
    except (OSError, AttributeError, ValueError):
        return None
    return descriptor if isinstance(descriptor, int) else None


def _driver_losses(descriptor: int | None) -> int:
    """Return the driver's counts of overruns in the chip and in its buffer, as the kernel keeps them."""
    if descriptor is None or not sys.platform.startswith("linux"):
        return 0
    import fcntl

    counts = struct.Struct("20i")  # struct serial_icounter_struct of linux/serial.h
    try:
        answer = counts.unpack(fcntl.ioctl(descriptor, _TIOCGICOUNT, bytes(counts.size)))
    except OSError:  # a pseudo-terminal, a socket
        return 0
    return int(answer[7] + answer[10])


def _reason(port: str, error: Exception) -> str:
    """Say why a port does not open, without the class names and the port's own name in pyserial's messages."""
    number = getattr(error, "errno", None)
    text = os.strerror(number) if number else str(error)
    said = text.removeprefix(f"Could not open port {port}: ").removeprefix(f"could not open port {port}: ")
    if "exclusively lock" in str(error):
        return "another program has locked it"
    return said or type(error).__name__
