"""The live view shows what the last moments held, in a thread and a process of its own, and holds nothing up."""

from __future__ import annotations

import io
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from tiegocancel import CancelConfig, Events, RotationTrajectory
from tiegocancel.link.live_view import LiveView, Numbers, Snapshot, signed_image
from tiegocancel.link.screen_process import ScreenProcess
from tiegocancel.link.terminal_screen import half_blocks, picture_of, shrunk
from tiegocancel.study import Settings
from tiegocancel.study.feed import FixedMotion
from tiegocancel.study.one_pass import OnePass
from tiegocancel.study.settings import ReportSettings

NUMBERS = Numbers(
    port="/dev/ttyUSB0", seconds=1.0, rate_hz=12_000.0, residual_hz=3000.0, ratio=0.75, zero_motion=0.1, events=12_000,
    lost=0, waiting=3, latency="p50 3.00 ms",
)  # fmt: skip


class Screen:
    """Remember what it was given; ``slow`` holds the drawing up."""

    def __init__(self, slow: threading.Event | None = None) -> None:
        self.snapshots: list[Snapshot] = []
        self.closed = False
        self._slow = slow

    def draw(self, snapshot: Snapshot) -> bool:
        if self._slow is not None:
            self._slow.wait(5.0)
        self.snapshots.append(snapshot)
        return True

    def close(self) -> None:
        self.closed = True


def watch(view: LiveView, events: Events, step_us: int = 2000) -> OnePass:
    """Show a run chunk by chunk."""
    settings = Settings(cancel=CancelConfig(horizon_us=3000), report=ReportSettings(diagnose=False))
    motion = FixedMotion(RotationTrajectory.constant(center_px=(32.0, 24.0), omega_rad_s=20.0))
    run = OnePass(settings, motion, events[:1], None, None, live=True)
    for start in range(0, int(events.t[-1]) + 1, step_us):
        chunk = events.between(start, start + step_us)
        decisions = run.decide(chunk)
        view(chunk, decisions, run)
        run.settle()
    return run


def test_a_picture_holds_the_last_moments_and_what_remains_of_them(tiny: SimpleNamespace, line_options: object) -> None:
    events = tiny.some_events(6000, step_us=20)
    link = tiny.source("/dev/null", line_options)
    screen = Screen()
    with LiveView(screen, link, refresh_hz=1e6, picture_us=10_000) as view:
        run = watch(view, events)
        deadline = time.monotonic() + 5.0
        while (not screen.snapshots or screen.snapshots[-1].numbers.events < 6000) and time.monotonic() < deadline:
            time.sleep(0.01)
    last = screen.snapshots[-1]
    before, after = last.images()
    shown = events.between(int(last.recent[0][0].t[0]), 1 << 40)
    assert 10_000 <= shown.span_us <= 14_000
    assert np.array_equal(before, signed_image([shown], (64, 48)))
    assert np.abs(after).sum() < np.abs(before).sum()
    assert last.numbers.events == 6000
    assert last.numbers.ratio == pytest.approx(run.tally.share().ratio, abs=0.05)
    assert last.numbers.zero_motion is not None
    assert screen.closed


def test_a_slow_screen_skips_pictures_and_holds_nothing_up(tiny: SimpleNamespace, line_options: object) -> None:
    free = threading.Event()
    screen = Screen(free)
    link = tiny.source("/dev/null", line_options)
    with LiveView(screen, link, refresh_hz=1e6) as view:
        watch(view, tiny.some_events(4000, step_us=20))
        assert len(screen.snapshots) == 0
        free.set()
    assert 1 <= len(screen.snapshots) <= 3


def test_signed_counts_are_on_minus_off() -> None:
    events = Events([0, 1, 2, 3], [1, 1, 1, 0], [2, 2, 2, 0], [1, 1, 0, 0], 3, 4)
    image = signed_image([events[:2], events[2:]], (3, 4))
    assert image.shape == (4, 3)
    assert (image[2, 1], image[0, 0], np.abs(image).sum()) == (1, -1, 2)


@pytest.mark.parametrize(("width", "height"), [(64, 48), (128, 128), (1280, 720), (5, 3)])
def test_shrinking_loses_no_count(width: int, height: int) -> None:
    image = np.random.default_rng(0).integers(-3, 4, (height, width)).astype(np.int8)
    small = shrunk(image, 40, 30)
    assert small.sum() == image.sum(dtype=np.int64)
    assert small.shape[0] <= 31
    assert small.shape[1] <= 41


def test_a_terminal_shows_both_pictures_and_the_numbers() -> None:
    image = np.zeros((48, 64), np.int8)
    image[10, 20], image[30, 40] = 5, -5
    text = half_blocks(shrunk(image, 64, 48))
    colours = {str(span.style) for span in text.spans}
    assert any("216,60,80" in colour or "d83c50" in colour for colour in colours)
    assert any("37,99,171" in colour or "2563ab" in colour for colour in colours)
    console = Console(width=100, height=30, record=True, file=io.StringIO())
    console.print(picture_of((image, image, NUMBERS.lines()), 100, 30))
    said = console.export_text()
    assert len(said.splitlines()) <= 30
    assert "zero motion  10.0%" in said
    assert "12 kev/s" in said


def test_a_screen_of_its_own_process_ends_with_the_run() -> None:
    screen = ScreenProcess("tiegocancel.link.terminal_screen")
    events = Events([0, 1], [0, 1], [0, 1], [0, 1], 8, 8)  # type: ignore[arg-type]
    snapshot = Snapshot([(events, np.array([True, False]))], (8, 8), NUMBERS)
    assert all(screen.draw(snapshot) for _ in range(3))
    screen.close()
    assert not screen.draw(snapshot)
