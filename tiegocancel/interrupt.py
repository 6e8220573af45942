"""Let Ctrl-C wait for a safe place."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

__all__ = ["Interrupt", "deferred_interrupt"]


class Interrupt:
    """Say whether the user asked to stop."""

    def __init__(self) -> None:
        self.wanted = False


@contextlib.contextmanager
def deferred_interrupt() -> Iterator[Interrupt]:
    """Yield an :class:`Interrupt` that the first Ctrl-C sets; a second one interrupts at once.

    Only the main thread receives signals: elsewhere, and where the host ignores Ctrl-C, nothing is changed.
    """
    asked = Interrupt()
    usual = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or usual in (signal.SIG_IGN, None):
        yield asked
        return

    def defer(number: int, frame: FrameType | None) -> None:
        if asked.wanted:
            raise KeyboardInterrupt
        asked.wanted = True

    signal.signal(signal.SIGINT, defer)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, usual)
