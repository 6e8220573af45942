"""A real recording arrives event by event as it was, at the pace of its line and at ten times that."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tiegocancel import Events, read_events
from tiegocancel.link.emulator import Emulator
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.player import Pace
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.pseudo_terminal import PseudoTerminal
from tiegocancel.link.source import Limits, LinkSource

BAUD = 921_600
Recording = Callable[[str], Path]


def over_the_emulator(events: Events, form: str, *, speed: float, baud: int) -> tuple[Events, Emulator, LinkSource]:
    """Play events through an emulated eDVS over a pseudo-terminal; return what a host got."""
    options = ProtocolOptions(edvs_format=form)
    with PseudoTerminal() as line:
        stopped = threading.Event()
        pace = Pace(speed=speed, bytes_per_s=LineOptions(baud=baud).bytes_per_s)
        emulator = Emulator(line, registry.device("edvs", options), lambda: [events], pace=pace, stopped=stopped.is_set)
        thread = threading.Thread(target=emulator.serve)
        thread.start()
        try:
            link = LinkSource(
                line.port, "edvs", options=options, line=LineOptions(baud=baud, reconnect_s=0.0),
                limits=Limits(max_events=len(events)),
            )  # fmt: skip
            with link:
                parts = list(link)
        finally:
            stopped.set()
            thread.join(5.0)
    return Events.concatenate(parts), emulator, link


def assert_exact(events: Events, form: str, *, speed: float, baud: int) -> None:
    found, emulator, link = over_the_emulator(events, form, speed=speed, baud=baud)
    # The host sets the device's clock to zero, so that it counts from the first event on. What E2 does not carry, whole
    # turns of its 16 bits within a pause, nobody can know.
    steps = np.diff(events.t) % (1 << 16) if form == "E2" else np.diff(events.t)
    assert np.array_equal(np.diff(found.t), steps)
    for name in "xyp":
        assert np.array_equal(getattr(found, name), getattr(events, name)), name
    counters = link.decoder.counters
    assert (counters.bad_bytes, counters.resyncs, counters.time_jumps, counters.outside) == (0, 0, 0, 0)
    assert emulator.plays[-1].thinned == 0


@pytest.fixture(scope="module")
def box(recording: Recording) -> Events:
    return read_events(recording("dvs128_moving_box.aedat"))


@pytest.mark.parametrize("form", ["E2", "E3", "E4"])
def test_a_stretch_arrives_exactly_at_ten_times_the_pace(box: Events, form: str) -> None:
    start = int(box.t[0]) + 10_000_000
    assert_exact(box.between(start, start + 3_000_000), form, speed=10.0, baud=10 * BAUD)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["E2", "E3", "E4"])
def test_the_whole_recording_arrives_exactly_at_ten_times_the_pace(box: Events, form: str) -> None:
    assert_exact(box, form, speed=10.0, baud=10 * BAUD)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["E2", "E3", "E4"])
def test_the_whole_recording_arrives_exactly_at_its_own_pace(box: Events, form: str) -> None:
    assert_exact(box, form, speed=1.0, baud=BAUD)
