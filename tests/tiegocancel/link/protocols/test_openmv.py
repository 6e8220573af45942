"""OpenMV's lines: as the camera's script prints them, each event for itself, and the raw REPL around them."""

from __future__ import annotations

import base64
import struct
from collections.abc import Callable
from typing import Any

import pytest

from tiegocancel import Events
from tiegocancel.errors import LinkError
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions

from .conftest import decoded, encoded, rows, stream

OPTIONS = ProtocolOptions(width=128, height=128)


def line_of(*events: tuple[int, ...]) -> bytes:
    data = b"".join(struct.pack("<6H", *event) for event in events)
    return b"C %d %s\n" % (len(events), base64.b64encode(data))


def test_a_line_is_read_as_the_camera_prints_it() -> None:
    decoder = registry.decoder("openmv")
    data = line_of((1, 2, 345, 678, 10, 20), (0, 2, 345, 679, 319, 319), (2, 2, 345, 680, 0, 0), (1, 3, 0, 1, 5, 6))
    came = decoded(decoder, b"<<<STREAM>>>\n" + data)
    assert rows(came) == [(2_345_678, 10, 20, 1), (2_345_679, 319, 319, 0), (3_000_001, 5, 6, 1)]
    assert [line.text for line in decoder.take_lines()] == ["<<<STREAM>>>"]


def test_seconds_wrap_and_time_goes_on() -> None:
    data = line_of((1, 65_535, 999, 998, 1, 1), (1, 65_535, 999, 999, 1, 1), (1, 0, 0, 0, 1, 1), (1, 0, 0, 1, 1, 1))
    came = decoded(registry.decoder("openmv"), data)
    assert (came.t - came.t[0]).tolist() == [0, 1, 2, 3]


def test_a_spoilt_character_loses_its_event_and_not_the_line() -> None:
    events = stream(1, 200, step_us=50)
    data = encoded("openmv", OPTIONS, events)
    start = data.index(b"C 200 ") + 6
    for place in range(start + 16 * 50, start + 16 * 52):
        decoder = registry.decoder("openmv", OPTIONS)
        came = decoded(decoder, data[:place] + b"*" + data[place + 1 :])
        assert 198 <= len(came) <= 199
        assert set(rows(came)) <= set(rows(events))
        assert decoder.counters.lost_events == 200 - len(came)


def test_other_lines_are_text_and_what_is_left_of_a_line_is_not() -> None:
    decoder = registry.decoder("openmv", OPTIONS)
    came = decoded(decoder, b"CSI: Calibrating - 0%\n" + encoded("openmv", OPTIONS, stream(1, 30)) + b"Traceback: no\n")
    assert len(came) == 30
    texts = [line.text for line in decoder.take_lines()]
    assert texts[0] == "CSI: Calibrating - 0%"
    assert not any(text.startswith("C ") for text in texts)


class Camera:
    """A camera that begins to play as soon as its script runs."""

    def __init__(self, events: Events, *, repl: bool = True, script: bool = True) -> None:
        self.device = registry.device("openmv", OPTIONS)
        self.events, self.repl, self.script = events, repl, script
        self.played = False

    def receive(self, data: bytes) -> bytes:
        if not self.repl:
            return b""
        reply = self.device.receive(data if self.script else data.replace(b"GENX320", b"OTHER"))
        if self.device.streaming and not self.played:
            self.played = True
            reply += encoded("openmv", OPTIONS, self.events)
        return reply


def test_the_host_runs_its_script_and_leaves_the_stream_whole(make_line: Callable[..., Any]) -> None:
    events = stream(1, 100)
    camera = Camera(events)
    line = make_line(camera)
    host = registry.host("openmv", OPTIONS)
    assert host.start(line).startswith("OpenMV")
    assert rows(decoded(registry.decoder("openmv", OPTIONS), line.waiting)) == rows(events)
    host.stop(line)
    assert not camera.device.streaming


def test_the_host_says_why_a_camera_does_not_stream(make_line: Callable[..., Any]) -> None:
    with pytest.raises(LinkError, match="no MicroPython answers"):
        registry.host("openmv").start(make_line(Camera(stream(1, 1), repl=False)))
