"""Show a live run while it goes on: pictures before and after, rates, ratios and latency, drawn by a second thread."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.link.source import LinkSource
from tiegocancel.matching.canceller import Decisions
from tiegocancel.study.one_pass import OnePass
from tiegocancel.units import rate_text

__all__ = ["LiveView", "Numbers", "Screen", "Snapshot", "signed_image"]

_MOST_EVENTS = 200_000
_RATE_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbers:
    """What is written beside the pictures; ratios and latency are of the whole run, rates of the last second."""

    port: str
    seconds: float
    rate_hz: float
    residual_hz: float
    ratio: float
    zero_motion: float | None
    events: int
    lost: int
    waiting: int
    latency: str

    def lines(self) -> list[str]:
        """Say the numbers in lines for people."""
        control = "no controls" if self.zero_motion is None else f"zero motion {self.zero_motion:6.1%}"
        return [
            f"{self.port}   {self.seconds:,.1f} s   {self.events:,} events",
            f"in {rate_text(self.rate_hz):>11}   out {rate_text(self.residual_hz):>11}",
            f"cancelled {self.ratio:6.1%}   {control}",
            f"lost {self.lost:,}   waiting {self.waiting:,}",
            f"latency {self.latency}",
        ]


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """The latest stretch of the stream, chunk by chunk with what was suppressed, and the numbers."""

    recent: list[tuple[Events, NDArray[np.bool_]]]
    size: tuple[int, int]
    numbers: Numbers

    def images(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return signed counts (ON − OFF) int32[height, width] of all events and of those that remain."""
        return (
            signed_image([events for events, _ in self.recent], self.size),
            signed_image([events.select(~suppressed) for events, suppressed in self.recent], self.size),
        )


class Screen(Protocol):
    """Draw snapshots; a screen that is gone returns ``False`` and is asked no more."""

    def draw(self, snapshot: Snapshot) -> bool:
        """Draw one; return whether the screen is still there."""
        ...

    def close(self) -> None:
        """Give back terminal or window."""
        ...


class LiveView:
    """Watch a live run; use it as a context manager. Calling it costs the run a few µs a chunk.

    ``refresh_hz`` pictures a second at most, each of the last ``picture_us`` of the stream. The thread that draws takes
    the latest snapshot and skips those that it is too slow for.
    """

    def __init__(self, screen: Screen, link: LinkSource, *, refresh_hz: float = 15.0, picture_us: int = 40_000) -> None:
        self._screen, self._link = screen, link
        self._every_s, self._picture_us = 1.0 / refresh_hz, picture_us
        self._recent: deque[tuple[Events, NDArray[np.bool_]]] = deque()
        self._recent_events = 0
        self._passed: deque[tuple[float, int, int]] = deque()
        self._events = self._residual = 0
        self._begun_s = self._shown_s = time.monotonic()
        self._latest: Snapshot | None = None
        self._changed = threading.Condition()
        self._ending = False
        self.drawn = 0
        self._thread = threading.Thread(target=self._draw, name="live view", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._changed:
            self._ending = True
            self._changed.notify_all()
        self._thread.join(5.0)
        self._screen.close()

    def __call__(self, events: Events, decisions: Decisions | None, run: OnePass | None) -> None:
        """Look at a chunk; hand a snapshot over when it is time."""
        if decisions is not None and len(events):
            self._keep(events, decisions.suppressed)
        now_s = time.monotonic()
        if run is None or now_s - self._shown_s < self._every_s:
            return
        self._shown_s = now_s
        snapshot = Snapshot(list(self._recent), (run.width, run.height), self._numbers(run, now_s))
        with self._changed:
            self._latest = snapshot
            self._changed.notify_all()

    def _keep(self, events: Events, suppressed: NDArray[np.bool_]) -> None:
        self._recent.append((events, suppressed))
        self._recent_events += len(events)
        oldest_us = int(events.t[-1]) - self._picture_us
        while len(self._recent) > 1 and (
            int(self._recent[0][0].t[-1]) < oldest_us or self._recent_events > _MOST_EVENTS
        ):
            self._recent_events -= len(self._recent.popleft()[0])
        self._events += len(events)
        self._residual += int(len(events) - np.count_nonzero(suppressed))

    def _numbers(self, run: OnePass, now_s: float) -> Numbers:
        self._passed.append((now_s, self._events, self._residual))
        while len(self._passed) > 2 and self._passed[0][0] < now_s - _RATE_S:
            self._passed.popleft()
        then_s, events, residual = self._passed[0]
        seconds = max(now_s - then_s, 1e-9)
        control = run.controls.get("zero_motion")
        wire, queue = self._link.decoder.counters, self._link.queue
        return Numbers(
            port=self._link.port,
            seconds=now_s - self._begun_s,
            rate_hz=(self._events - events) / seconds,
            residual_hz=(self._residual - residual) / seconds,
            ratio=run.tally.share().ratio,
            zero_motion=None if control is None else control.tally.share().ratio,
            events=self._events,
            lost=wire.lost_events + queue.counters.dropped + queue.counters.thinned,
            waiting=len(queue),
            latency=self._link.latency.text(),
        )

    def _draw(self) -> None:
        """Draw the latest snapshot whenever there is a new one."""
        while True:
            with self._changed:
                while self._latest is None and not self._ending:
                    self._changed.wait(0.5)
                snapshot, self._latest = self._latest, None
            if snapshot is None or not self._screen.draw(snapshot):
                return
            self.drawn += 1


def signed_image(parts: list[Events], size: tuple[int, int]) -> NDArray[np.int32]:
    """Return ON − OFF counts int32[height, width] of events on a sensor of ``size`` = (width, height) px."""
    width, height = size
    image = np.zeros(width * height, np.int32)
    for events in parts:
        places = events.y.astype(np.int64) * width + events.x
        np.add.at(image, places, np.where(events.p == 1, 1, -1).astype(np.int32))
    return image.reshape(height, width)
