"""A live run decides at once and counts later; its numbers are those of a run over the same events."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule, RotationTrajectory
from tiegocancel.errors import LinkError
from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.metrics import DiscRegion, Tally
from tiegocancel.study import INTERRUPTED, Settings, run_stream
from tiegocancel.study.controls import ShuffledControl
from tiegocancel.study.feed import FixedMotion, TrackedMotion
from tiegocancel.study.live import run_live, warm_up
from tiegocancel.study.settings import ReportSettings

WIDTH, HEIGHT, CENTER, OMEGA = 96, 72, (48.0, 36.0), 15.0
SETTINGS = Settings(
    cancel=CancelConfig(horizon_us=6000), report=ReportSettings(disc_radius_px=30.0, controls=True, diagnose=False)
)
MOTION = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=OMEGA)


def scene(seed: int = 3) -> Events:
    """Thirty turning markers over 120 ms."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 120_000, 100)
    radius, angle = 5 + 28 * rng.random(30), 2 * np.pi * rng.random(30)
    turned = angle + OMEGA * t[:, None] * 1e-6
    x = np.floor(CENTER[0] + radius * np.cos(turned) + 0.5).astype(int)
    y = np.floor(CENTER[1] + radius * np.sin(turned) + 0.5).astype(int)
    fresh = np.ones_like(x, bool)
    fresh[1:] = (np.diff(x, axis=0) != 0) | (np.diff(y, axis=0) != 0)
    on = np.broadcast_to(np.arange(30) % 2, x.shape)
    return Events(np.repeat(t, 30)[fresh.ravel()], x[fresh], y[fresh], on[fresh], WIDTH, HEIGHT)


class Source:
    """Give pieces, with empty ones between; ``after`` is called once so many pieces were given."""

    def __init__(self, events: Events, pieces: int, *, after: int = -1, do: Callable[[], None] | None = None) -> None:
        cuts = np.linspace(0, len(events), pieces + 1).astype(int)
        self.parts = [events[a:b] for a, b in itertools.pairwise(cuts)]
        self.given = self.closed = 0
        self.stopped = False
        self._after, self._do = after, do

    def __iter__(self) -> Iterator[Events]:
        for number, part in enumerate(self.parts):
            if self.stopped:
                return
            yield part[:0]
            self.given += 1
            yield part
            if number == self._after and self._do is not None:
                self._do()

    def decided(self) -> None:
        self.closed += 1

    def stop(self) -> None:
        self.stopped = True


class Keep:
    """Keep what remains, as a sink of either kind of run."""

    def __init__(self) -> None:
        self.parts: list[Events] = []

    def write(self, events: Events) -> None:
        self.parts.append(events)


@pytest.mark.parametrize("pieces", [1, 23, 300])
def test_numbers_are_those_of_a_run_over_the_same_events(pieces: int) -> None:
    events, kept, wanted = scene(), Keep(), Keep()
    source = Source(events, pieces)
    live = run_live(source, SETTINGS, MOTION, sink=kept.write)
    file = run_stream([events], SETTINGS, MOTION, sink=wanted)
    assert live is not None
    assert file is not None
    found, expected = live.to_json(), file.to_json()
    for numbers in (found, expected):
        for name in ("seconds", "events_per_second"):
            del numbers[name]
    assert json.dumps(found) == json.dumps(expected)
    assert np.array_equal(Events.concatenate(kept.parts).t, Events.concatenate(wanted.parts).t)
    assert source.closed == 2 * pieces


class Estimator:
    """Know the true motion every 10 ms."""

    def __init__(self) -> None:
        self._next_us = 0

    def process(self, events: Events) -> list[MotionEstimate]:
        rows = []
        while len(events) and self._next_us <= int(events.t[-1]):
            rows.append(MotionEstimate(t_us=self._next_us, center_px=CENTER, omega_rad_s=OMEGA + 1e-6 * self._next_us))
            self._next_us += 10_000
        return rows


def test_motion_found_on_the_way_decides_the_same_in_any_pieces() -> None:
    events = scene()
    results = []
    for pieces in (7, 60):
        result = run_live(Source(events, pieces), SETTINGS, TrackedMotion(Estimator()))
        assert result is not None
        results.append(result)
    assert results[0].counters == results[1].counters
    assert results[0].to_json()["controls"] == results[1].to_json()["controls"]
    assert results[0].displacement.summary() == results[1].displacement.summary()
    assert results[0].counters.suppressed > 0.5 * len(events)


def test_rows_of_a_stream_without_end_are_bounded() -> None:
    feed = TrackedMotion(Estimator())
    feed.most_rows = 20
    for start in range(0, 2_000_000, 10_000):
        feed.advance(Events([start + 9_999], [1], [1], [1], WIDTH, HEIGHT))  # type: ignore[arg-type]
        assert len(feed.estimates) <= 20
    latest = feed.schedule(6000, start_us=1_950_000, stop_us=1_990_000, step_us=1000)
    whole = TrackedMotion(Estimator())
    whole.advance(Events([1_999_999], [1], [1], [1], WIDTH, HEIGHT))  # type: ignore[arg-type]
    expected = whole.schedule(6000, start_us=1_950_000, stop_us=1_990_000, step_us=1000)
    assert np.array_equal(latest.t_us, expected.t_us)
    assert np.array_equal(latest.coefficients, expected.coefficients)


def test_what_came_before_a_fault_is_counted() -> None:
    def fail() -> None:
        raise LinkError("/dev/ttyUSB0", "the line is gone")

    events = scene()
    result = run_live(Source(events, 10, after=4, do=fail), SETTINGS, MOTION)
    assert result is not None
    assert result.fault == "/dev/ttyUSB0: the line is gone"
    assert result.counters.events == sum(len(part) for part in Source(events, 10).parts[:5])


def test_ctrl_c_stops_the_source_and_decides_what_it_still_gives() -> None:
    import os
    import signal

    events, kept = scene(), Keep()
    source = Source(events, 10, after=4, do=lambda: os.kill(os.getpid(), signal.SIGINT))
    result = run_live(source, SETTINGS, MOTION, sink=kept.write)
    assert result is not None
    assert result.fault == INTERRUPTED
    assert source.stopped
    assert result.counters.events == sum(len(part) for part in source.parts[: source.given])
    assert sum(map(len, kept.parts)) == result.counters.events - result.counters.suppressed


def test_a_stream_without_events_has_no_result() -> None:
    assert run_live(Source(scene()[:0], 3), SETTINGS, MOTION) is None


def test_warming_up_leaves_nothing_behind() -> None:
    warm_up(SETTINGS, FixedMotion(MOTION), width=WIDTH, height=HEIGHT)
    warm_up(replace(SETTINGS, report=ReportSettings(controls=False)), MOTION, width=2, height=2)


@pytest.mark.parametrize("pieces", [1, 11, 400])
def test_shuffled_blocks_of_bounded_time_do_not_depend_on_chunks(pieces: int) -> None:
    events = scene()
    motion = MotionSchedule.rotation(center_px=CENTER, omega_rad_s=OMEGA, horizon_us=6000)
    region = DiscRegion(WIDTH, HEIGHT, center_px=CENTER, radius_px=30.0)
    shares = []
    for parts in (Source(events, 1).parts, Source(events, pieces).parts):
        canceller = Canceller(SETTINGS.cancel, motion, width=WIDTH, height=HEIGHT, track_source=False)
        control = ShuffledControl(canceller, Tally(region, 0), 0, block_us=20_000)
        for part in parts:
            control.process(part)
            held = control.oldest_us
            assert held is None or not len(part) or int(part.t[-1]) - held < 20_000
        control.finish()
        shares.append((control.tally.share(), control.shortest_us))
    assert shares[0] == shares[1]
    assert shares[0][0].events == len(events)
