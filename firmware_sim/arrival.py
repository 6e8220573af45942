"""Turn the times of events into cycles at a device's input: the sensor's readout, its buffer, the link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.jit import jit

__all__ = ["Arrivals", "InputPath"]

Int64s = NDArray[np.int64]

_ONE = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True)
class InputPath:
    """Say how events reach a device.

    ``readout_events_per_second``: how fast the sensor reads out events that fire together, 0 for one a cycle.
    ``link_bits_per_second``: of the line into the device, 0 for as wide as it takes; ``bits_per_event`` on it.
    ``buffer_events``: what the sensor holds while the line is busy; what finds it full is lost at the sensor.
    """

    readout_events_per_second: float = 0.0
    link_bits_per_second: float = 0.0
    bits_per_event: float = 32.0
    buffer_events: int = 4096

    def __post_init__(self) -> None:
        for name in ("readout_events_per_second", "link_bits_per_second"):
            value = getattr(self, name)
            if value != 0 and not 1 <= value <= 1e15:
                raise ValueError(f"{name} must be 0 or from 1 to 1e15, not {value!r}")
        if not 0 < self.bits_per_event <= 4096:
            raise ValueError(f"bits_per_event must be above 0 and at most 4096, not {self.bits_per_event!r}")
        if self.buffer_events < 1:
            raise ValueError(f"buffer_events must be at least 1, not {self.buffer_events}")


class Arrivals:
    """Compute the cycle in which each event of a stream reaches the input, chunk by chunk.

    An event is there in cycle ``⌊(t − t₀)·clock⌋`` at the earliest, after the readout of the one before, and when the
    line has carried what waits; one a cycle at most. ``lost`` counts what the sensor could not hold.
    """

    def __init__(self, path: InputPath, *, clock_hz: float) -> None:
        if not 1e3 <= clock_hz <= 1e11:
            raise ValueError(f"clock_hz must be from 1e3 to 1e11, not {clock_hz!r}")
        self.path, self.clock_hz = path, clock_hz
        self._readout = _interval(clock_hz, path.readout_events_per_second)
        self._line = _interval(clock_hz, path.link_bits_per_second / path.bits_per_event)
        self._origin_us: int | None = None
        self._state = np.full(4, -(1 << 60), np.int64)  # last readout, last send, last arrival; events held so far
        self._state[3] = 0
        self._sent = np.full(path.buffer_events, -(1 << 60), np.int64)
        self.lost = 0

    def process(self, t_us: Int64s) -> tuple[Int64s, NDArray[np.bool_]]:
        """Return arrivals int64[n] and which events were lost at the sensor, bool[n]; lost ones have arrival −1."""
        arrival, lost = np.zeros(len(t_us), np.int64), np.zeros(len(t_us), np.bool_)
        if not len(t_us):
            return arrival, lost
        if self._origin_us is None:
            self._origin_us = int(t_us[0])
        # In 2^-16 cycles from the first event on: 2^63 is 16 days at 100 MHz.
        fire = np.floor((t_us - self._origin_us) * (self.clock_hz * 1e-6)).astype(np.int64) * _ONE
        _arrive(fire, self._readout, self._line, self._state, self._sent, arrival, lost)
        self.lost += int(lost.sum())
        return arrival, lost


def _interval(clock_hz: float, per_second: float) -> int:
    """Return the time between two events at a rate, in 2^-16 cycles; one cycle for no rate."""
    return _ONE if per_second <= 0 else max(round(clock_hz / per_second * _ONE), 1)


@jit
def _arrive(
    fire: Int64s,
    readout: int,
    line: int,
    state: Int64s,
    sent: Int64s,
    arrival: Int64s,
    lost: NDArray[np.bool_],
) -> Any:
    """Fill ``arrival`` and ``lost``; ``state`` and ``sent`` carry on."""
    depth = len(sent)
    for i in range(len(fire)):
        read = max(fire[i], state[0] + readout)
        state[0] = read
        held = state[3]
        if held >= depth and sent[held % depth] > read:
            lost[i], arrival[i] = True, -1
            continue
        send = max(read, state[1] + line)
        state[1] = send
        sent[held % depth] = send
        state[3] += 1
        at = max((send + 65535) >> 16, state[2] + 1)
        state[2] = at
        arrival[i] = at
    return 0
