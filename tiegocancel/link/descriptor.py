"""Read and write a file descriptor with bounded waits."""

from __future__ import annotations

import errno
import os
import select
import time

from tiegocancel.errors import LinkError

__all__ = ["read_some", "write_all", "write_some"]

_WRITE_BYTES = 4096
"""A pipe that is ready takes so many bytes without blocking."""
_AGAIN = (errno.EAGAIN, errno.EWOULDBLOCK, errno.EINTR)


def read_some(descriptor: int, most: int, timeout_s: float, *, port: str) -> bytes | None:
    """Return up to ``most`` bytes as soon as there are any, nothing after ``timeout_s``, ``None`` at the end.

    Raise :class:`LinkError` when the device is gone.
    """
    try:
        ready, _, _ = select.select([descriptor], [], [], timeout_s)
        if not ready:
            return b""
        return os.read(descriptor, most) or None
    except (OSError, ValueError) as error:
        if getattr(error, "errno", None) in _AGAIN:
            return b""
        raise LinkError(port, _gone(error)) from None


def write_some(descriptor: int, data: bytes | memoryview, timeout_s: float, *, port: str) -> int:
    """Write what is taken within ``timeout_s``, perhaps nothing; return how many bytes that were."""
    try:
        _, ready, _ = select.select([], [descriptor], [], timeout_s)
        return os.write(descriptor, data[:_WRITE_BYTES]) if ready else 0
    except (OSError, ValueError) as error:
        if getattr(error, "errno", None) in _AGAIN:
            return 0
        raise LinkError(port, _gone(error)) from None


def write_all(descriptor: int, data: bytes, timeout_s: float, *, port: str) -> None:
    """Write all of ``data``; raise :class:`LinkError` when nothing is taken for ``timeout_s`` or the device is gone."""
    rest = memoryview(data)
    last_s = time.monotonic()
    while rest:
        taken = write_some(descriptor, rest, min(timeout_s, 0.1), port=port)
        rest = rest[taken:]
        now_s = time.monotonic()
        if taken:
            last_s = now_s
        elif now_s - last_s > timeout_s:
            raise LinkError(port, f"the other end has taken no byte for {timeout_s:g} s")


def _gone(error: Exception) -> str:
    """Say why a descriptor no longer serves."""
    return f"the line is gone: {getattr(error, 'strerror', None) or error}"
