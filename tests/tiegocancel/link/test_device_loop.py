"""A device in the loop is compared event by event, and one that errs is caught at its first wrong decision."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from tiegocancel import CancelConfig, Events, MotionSchedule
from tiegocancel.errors import LinkError
from tiegocancel.link.decider import DeciderDevice
from tiegocancel.link.device_loop import DeviceLoop
from tiegocancel.link.emulator import Emulator
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.opening import open_line
from tiegocancel.link.player import Pace
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.protocols.protocol import Device
from tiegocancel.link.pseudo_terminal import PseudoTerminal
from tiegocancel.matching.oracle import OracleCanceller

pytest.importorskip("cobs", reason="the framed protocol needs the extra link")

CONFIG = CancelConfig(horizon_us=3000, tolerance_us=500, ring_capacity=4096)
MOTION = MotionSchedule.rotation(center_px=(32.0, 24.0), omega_rad_s=20.0, horizon_us=3000)
OPTIONS = ProtocolOptions(width=64, height=48)
Serve = Callable[[Device], str]


def oracle() -> OracleCanceller:
    return OracleCanceller(CONFIG, MOTION, width=64, height=48)


class Deciding:
    """Decide as the plain model does; ``wrong`` names an event on which it errs."""

    def __init__(self, wrong: int | None = None) -> None:
        self._canceller, self._wrong, self._seen = oracle(), wrong, 0

    def __call__(self, events: Events) -> NDArray[np.bool_]:
        suppressed = self._canceller.process(events).suppressed.copy()
        if self._wrong is not None and self._seen <= self._wrong < self._seen + len(events):
            suppressed[self._wrong - self._seen] ^= True
        self._seen += len(events)
        return suppressed


@pytest.fixture
def device() -> Iterator[Serve]:
    """Return a function that puts a device on a pseudo-terminal and returns its port."""
    ends: list[Callable[[], None]] = []

    def begin(device: Device) -> str:
        line = PseudoTerminal()
        stopped = threading.Event()
        emulator = Emulator(line, device, list, pace=Pace(), stopped=stopped.is_set)
        thread = threading.Thread(target=emulator.serve)
        thread.start()
        ends.extend([stopped.set, thread.join, line.close])
        return line.port

    yield begin
    for end in ends:
        end()


def compared(port: str, events: Events, line: LineOptions, **more: float) -> DeviceLoop:
    golden = oracle()
    with DeviceLoop(open_line(port, line), OPTIONS, **more) as loop:  # type: ignore[arg-type]
        for first in range(0, len(events), 700):
            piece = events[first : first + 700]
            loop.exchange(piece, golden.process(piece).suppressed)
    return loop


def test_a_device_that_is_right_agrees_on_every_event(
    device: Serve, tiny: SimpleNamespace, line_options: LineOptions
) -> None:
    events = tiny.some_events(5000, step_us=20)
    suppressed = oracle().process(events).suppressed
    assert 0.02 < suppressed.mean() < 0.9
    port = device(DeciderDevice(OPTIONS, Deciding))
    for window in (2048, 8192):  # a second host finds a fresh device
        loop = compared(port, events, line_options, window=window)
        assert (loop.sent, loop.compared, loop.different, loop.first) == (5000, 5000, 0, None)
        assert loop.latency.count == 5000
        assert "64x48" in loop.banner


@pytest.mark.parametrize("wrong", [0, 1234, 4999])
def test_the_first_wrong_decision_is_named(
    device: Serve, tiny: SimpleNamespace, line_options: LineOptions, wrong: int
) -> None:
    events = tiny.some_events(5000, step_us=20)
    loop = compared(device(DeciderDevice(OPTIONS, lambda: Deciding(wrong))), events, line_options)
    assert loop.compared == 5000
    assert loop.different == 1
    assert loop.first is not None
    assert (loop.first.index, loop.first.t_us) == (wrong, int(events.t[wrong]))
    verb = "suppressed" if not oracle().process(events).suppressed[wrong] else "passed on"
    assert loop.first.text().startswith(f"event {wrong} (t = {int(events.t[wrong])} µs, x = {int(events.x[wrong])}")
    assert f"the device {verb} it" in loop.first.text()
    assert loop.to_json()["first_difference"] == loop.first.text()


def test_a_device_that_stands_still_is_told(device: Serve, tiny: SimpleNamespace, line_options: LineOptions) -> None:
    def stuck() -> Callable[[Events], NDArray[np.bool_]]:
        return lambda events: np.zeros(0, np.bool_)

    port = device(DeciderDevice(OPTIONS, stuck))
    with pytest.raises(LinkError, match=r"has decided 0 of [\d,]+ events and nothing for 0\.2 s"):
        compared(port, tiny.some_events(3000), line_options, silence_s=0.2)


def test_decisions_that_were_lost_are_told(device: Serve, tiny: SimpleNamespace, line_options: LineOptions) -> None:
    class Losing(DeciderDevice):
        lost = False

        def receive(self, data: bytes) -> bytes:
            reply = super().receive(data)
            if self._decided < 1000 or self.lost:
                return reply
            self.lost = True
            return b""

    with pytest.raises(LinkError, match="were lost"):
        compared(device(Losing(OPTIONS, Deciding)), tiny.some_events(3000), line_options, silence_s=2.0)


def test_a_device_that_does_not_fit_is_refused(device: Serve, line_options: LineOptions) -> None:
    with (
        pytest.raises(LinkError, match="the device has 32×48 px, the events 64×48 px"),
        DeviceLoop(
            open_line(device(DeciderDevice(ProtocolOptions(width=32, height=48), Deciding)), line_options), OPTIONS
        ),
    ):
        pass
    with (
        pytest.raises(LinkError, match="does not decide events"),
        DeviceLoop(open_line(device(registry.device("framed", OPTIONS)), line_options), OPTIONS),
    ):
        pass
