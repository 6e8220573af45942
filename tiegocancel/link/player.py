"""Play a recording over a line as a device would: each event at its time, no byte faster than the baud carries."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from tiegocancel.errors import ConfigError
from tiegocancel.events import Events
from tiegocancel.link.protocols.protocol import Encoder
from tiegocancel.units import rate_text

__all__ = ["Pace", "Played", "Player", "WhenFull"]

WhenFull = Literal["slow", "thin"]

_SLICE_S = 0.002
_SLICE_EVENTS = 4096
_LATE_S = 0.02
"""A line that lags by more than this is one that does not carry the stream."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """Say how fast a recording is played.

    ``speed``: seconds of recording a second, 0 as fast as the line takes it; ``bytes_per_s``: what the line carries at
    its baud, 0 as much as it takes. Where that does not carry the stream, ``when_full`` makes the playback ``slow`` or
    lets it ``thin`` out events evenly.
    """

    speed: float = 1.0
    bytes_per_s: float = 0.0
    when_full: WhenFull = "slow"

    def __post_init__(self) -> None:
        if not 0.0 <= self.speed <= 1e6:
            raise ConfigError(f"--speed must be from 0 (as fast as the line takes it) to 10^6, not {self.speed}")
        if not 0.0 <= self.bytes_per_s <= 1e9:
            raise ConfigError(f"the line must carry from 0 (no limit) to 10^9 bytes/s, not {self.bytes_per_s}")
        if self.when_full not in get_args(WhenFull):
            raise ConfigError(f"--when-full must be slow or thin, not {self.when_full!r}")


@dataclass(slots=True, kw_only=True)
class Played:
    """Count what was played: events ``sent`` in so many ``bytes``, events ``thinned`` out, and how long it all took.

    ``recording_s`` of the recording took ``seconds``; ``lag_s`` is the most that the playback was behind its plan;
    ``ended``: the recording was played to its end.
    """

    sent: int = 0
    thinned: int = 0
    bytes: int = 0
    recording_s: float = 0.0
    seconds: float = 0.0
    lag_s: float = 0.0
    ended: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return the counts by name."""
        return {name: getattr(self, name) for name in self.__slots__}


class Player:
    """Play one stream once. ``send`` takes bytes and returns ``False`` to break off; ``tell`` takes remarks.

    ``now_s`` and ``sleep`` are the clock that it keeps to.
    """

    def __init__(
        self,
        pace: Pace,
        send: Callable[[bytes], bool],
        tell: Callable[[str], None],
        *,
        now_s: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.pace, self._send, self._tell, self._now_s, self._sleep = pace, send, tell, now_s, sleep
        self.played = Played()
        self._begun_s = 0.0
        self._free_s = 0.0  # when the line will have carried what it was given
        self._phase = 0.0
        self._told = False

    def play(self, chunks: Iterable[Events], encoder: Encoder) -> Played:
        """Play chunks through an encoder; return what was played, also when it was broken off."""
        self._begun_s = self._free_s = self._now_s()
        played = self.played
        start_us: int | None = None
        going = self._put(encoder.begin(), 0.0)
        for events in self._slices(chunks) if going else ():
            start_us = int(events.t[0]) if start_us is None else start_us
            played.recording_s = (int(events.t[-1]) - start_us) * 1e-6
            due_s = self._begun_s + (played.recording_s / self.pace.speed if self.pace.speed else 0.0)
            kept = self._fitting(events, due_s)
            data = encoder.encode(kept)
            played.thinned += len(events) - len(kept)
            if not self._put(data, due_s, len(kept)):
                break
        else:
            played.ended = going and self._put(encoder.end(), 0.0)
        played.seconds = self._now_s() - self._begun_s
        return played

    def _slices(self, chunks: Iterable[Events]) -> Iterator[Events]:
        """Cut chunks into pieces of a few ms of playing time."""
        step_us = max(int(_SLICE_S * 1e6 * (self.pace.speed or 1e3)), 1)
        for chunk in chunks:
            if not len(chunk):
                continue
            cuts = np.flatnonzero(np.diff(chunk.t // step_us)) + 1
            for first, last in zip([0, *cuts.tolist()], [*cuts.tolist(), len(chunk)], strict=True):
                for at in range(first, last, _SLICE_EVENTS):
                    yield chunk[at : min(at + _SLICE_EVENTS, last)]

    def _fitting(self, events: Events, due_s: float) -> Events:
        """Return the events that the line carries in time; all of them where it is allowed to lag."""
        if self.pace.when_full == "slow" or not self.pace.bytes_per_s or not self.pace.speed:
            return events
        behind_s = self._free_s - due_s
        if behind_s <= _LATE_S / 2:
            return events
        # The further behind, the fewer: from all of them to none between half and the whole of the delay allowed.
        share = max(2.0 * (1.0 - behind_s / _LATE_S), 0.0)
        places = np.floor(self._phase + share * np.arange(1, len(events) + 1))
        kept = np.diff(places, prepend=np.floor(self._phase)) > 0
        self._phase = float((self._phase + share * len(events)) % 1.0)
        self._say_full(f"events are thinned out evenly ({rate_text(len(events) / _SLICE_S)} come)", by_line=True)
        return events.select(kept)

    def _put(self, data: bytes, due_s: float, events: int = 0) -> bool:
        """Send bytes once they are due and the line is free; return whether to go on."""
        now_s = self._now_s()
        # A sleep that lasted too long may be made up for, a pause of the host may not.
        begin_s = max(due_s, self._free_s, now_s - _SLICE_S)
        if due_s:
            lag_s = begin_s - due_s if self.pace.speed else 0.0
            self.played.lag_s = max(self.played.lag_s, lag_s)
            if lag_s > _LATE_S and self.pace.when_full == "slow":
                self._say_full("the playback is slowed down", by_line=begin_s <= max(due_s, self._free_s))
        if begin_s > now_s:
            self._sleep(begin_s - now_s)
        self._free_s = begin_s + (len(data) / self.pace.bytes_per_s if self.pace.bytes_per_s else 0.0)
        self.played.bytes += len(data)
        self.played.sent += events
        return self._send(data)

    def _say_full(self, consequence: str, *, by_line: bool) -> None:
        """Say once that the line, or else the other end, does not take the stream."""
        if self._told:
            return
        self._told = True
        each = self.played.bytes / max(self.played.sent, 1)
        limit = self.pace.bytes_per_s
        at = f"from {self.played.recording_s:.3f} s of the recording on"
        if not by_line or not limit:
            self._tell(f"{at} the other end takes less than it is sent: {consequence}")
            return
        rate = f", about {rate_text(limit / each)} at {each:.2f} bytes an event" if each else ""
        self._tell(
            f"the line carries {limit:,.0f} bytes/s{rate}; {at} that is not enough at speed {self.pace.speed:g}: "
            f"{consequence}"
        )
