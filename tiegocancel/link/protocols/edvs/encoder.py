"""Encode events as an eDVS sends them."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.link.protocols.axes import to_device
from tiegocancel.link.protocols.edvs.layout import SIDE_PX, stamp_bytes
from tiegocancel.link.protocols.options import ProtocolOptions

__all__ = ["EdvsClock", "EdvsEncoder", "Sensors"]


class EdvsClock:
    """Relate the times of a recording to the clock of the device that plays it."""

    def __init__(self) -> None:
        self._ahead_us = 0
        self._last_us: int | None = None
        self._set_to: int | None = None

    def set(self, value_us: int) -> None:
        """Let the clock show ``value_us`` now: at the event sent last, or else at the next one."""
        self._set_to = value_us
        if self._last_us is not None:
            self._ahead_us, self._set_to = value_us - self._last_us, None

    def stamps(self, t: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the device's times of events at ``t`` [n] µs."""
        if self._set_to is not None:
            self._ahead_us, self._set_to = self._set_to - int(t[0]), None
        self._last_us = int(t[-1])
        return t + self._ahead_us


class Sensors:
    """Stream the lines of a device at rest: what ``!S+bitmap,period`` asks for, every ``period_ms``."""

    _VALUES: ClassVar[dict[int, str]] = {
        7: "0 0 0",
        8: "0 0 16384",
        9: "0 0 0",
        10: "0 0 0",
        11: "0 0 10000",
        12: "0 0 0",
        13: "40000000 0 0 0",
    }

    def __init__(self) -> None:
        self.bitmap = 0
        self.period_ms = 1
        self._next_us: int | None = None

    def due(self, t: NDArray[np.int64]) -> list[tuple[int, bytes]]:
        """Return the lines that fall due up to the last of ``t`` [n] µs, each with the index of the event behind it."""
        lines = b"".join(b"-S%d %s\n" % (bit, text.encode()) for bit, text in self._VALUES.items() if self._has(bit))
        if not lines:
            self._next_us = None
            return []
        period_us = 1000 * self.period_ms
        first = int(t[0]) if self._next_us is None else self._next_us
        times = np.arange(first, int(t[-1]) + 1, period_us)
        self._next_us = first + period_us * len(times)
        return [(int(place), lines) for place in np.searchsorted(t, times)]

    def _has(self, bit: int) -> bool:
        return bool(self.bitmap >> bit & 1)


class EdvsEncoder:
    """Encode E0 to E4 (``options.edvs_format``); lines of ``sensors`` stand between the events.

    Times are taken modulo the stamp; E1 holds steps below 2^28 µs, and takes the first from 0. Coordinates beyond 127
    raise :class:`ConfigError`.
    """

    def __init__(
        self, options: ProtocolOptions, *, clock: EdvsClock | None = None, sensors: Sensors | None = None
    ) -> None:
        self.options = options
        self._clock = clock or EdvsClock()
        self._sensors = sensors
        self._last_us = 0

    def begin(self) -> bytes:
        """Return nothing: the stream begins with an event."""
        return b""

    def encode(self, events: Events) -> bytes:
        """Return the bytes of a chunk, all of them."""
        if not len(events):
            return b""
        heads = self._heads(events)
        stamps = self._clock.stamps(events.t)
        if self.options.edvs_format == "E1":
            return self._with_lines(*self._deltas(heads, stamps), events)
        size = stamp_bytes(self.options.edvs_format)
        rows = np.empty((len(events), 2 + size), np.uint8)
        rows[:, :2] = heads
        for column in range(size):
            rows[:, 2 + column] = (stamps >> 8 * (size - 1 - column)) & 0xFF
        return self._with_lines(rows.reshape(-1), np.arange(len(events) + 1) * (2 + size), events)

    def end(self) -> bytes:
        """Return nothing: every event went when it came."""
        return b""

    def _heads(self, events: Events) -> NDArray[np.uint8]:
        """Return the bytes of place and polarity [n, 2] in the device's axes."""
        turned = to_device(events, self.options)
        x, y = turned.x.astype(np.int64), turned.y.astype(np.int64)
        if int(x.max()) >= SIDE_PX or int(y.max()) >= SIDE_PX:
            raise ConfigError(
                f"an eDVS has {SIDE_PX}x{SIDE_PX} px, and an event of this {events.width}x{events.height} recording "
                "lies beyond: crop it"
            )
        bit = events.p ^ 1 if self.options.off_bit else events.p
        return np.stack([0x80 | y, (bit.astype(np.int64) << 7) | x], axis=1).astype(np.uint8)

    def _deltas(
        self, heads: NDArray[np.uint8], stamps: NDArray[np.int64]
    ) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        """Return the bytes of E1: 7 bits of the step a byte, most significant first, bit 7 on the last."""
        # A clock that was set back steps by nothing: a delta cannot say more.
        steps = np.maximum(np.diff(stamps, prepend=self._last_us), 0)
        if int(steps.max()) >= 1 << 28:
            raise ConfigError(f"E1 holds steps from 0 to {(1 << 28) - 1} µs, not {int(steps.max())}")
        self._last_us = int(stamps[-1])
        # The firmware's thresholds: the largest value of a length already goes into the next.
        groups = 1 + (steps >= 0x7F).astype(np.int64) + (steps >= 0x3FFF) + (steps >= 0x1FFFFF)
        starts = np.concatenate([[0], np.cumsum(2 + groups)])
        out = np.empty(int(starts[-1]), np.uint8)
        out[starts[:-1]], out[starts[:-1] + 1] = heads[:, 0], heads[:, 1]
        for back in range(4):
            has = groups > back
            out[starts[1:][has] - 1 - back] = ((steps[has] >> 7 * back) & 0x7F) | (0 if back else 0x80)
        return out, starts

    def _with_lines(self, out: NDArray[np.uint8], starts: NDArray[np.int64], events: Events) -> bytes:
        """Put the sensors' lines between the events that begin at ``starts``."""
        lines = self._sensors.due(events.t) if self._sensors is not None else []
        if not lines:
            return out.tobytes()
        parts, done = [], 0
        for row, line in lines:
            parts += [out[done : starts[row]].tobytes(), line]
            done = int(starts[row])
        return b"".join([*parts, out[done:].tobytes()])
