"""EVT 2.0 and EVT 3.0 words over a line: offsets, times that jump, and what a word leaves behind."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.errors import ConfigError
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions

from .conftest import decoded, encoded, rows, stream

OPTIONS = ProtocolOptions(width=128, height=128)
WORDS = pytest.mark.parametrize("name", ["evt2", "evt3"])


@WORDS
@pytest.mark.parametrize("garbage", [b"\x00", b"\x7f\xff", b"\x10\x20\x33", b"\x01" * 7, b"hello, world"])
def test_the_offset_is_found_behind_any_garbage(name: str, garbage: bytes) -> None:
    events = stream(1, 300)
    decoder = registry.decoder(name, OPTIONS)
    came = decoded(decoder, garbage + encoded(name, OPTIONS, events))
    assert len(events) - len(came) <= 6
    assert set(rows(came)) <= set(rows(events))


@WORDS
def test_events_before_the_first_time_word_are_lost_and_counted(name: str) -> None:
    # From the middle of a tick on: first what the words before have said is missing.
    data = encoded(name, OPTIONS, stream(1, 300, step_us=2))
    decoder = registry.decoder(name, OPTIONS)
    came = decoded(decoder, data[8:])
    assert decoder.counters.lost_events > 0
    assert set(rows(came)) <= set(rows(stream(1, 300, step_us=2)))


@WORDS
@pytest.mark.parametrize("bits", [24, 34])
def test_time_goes_on_when_the_words_wrap(name: str, bits: int) -> None:
    period = {"evt2": 34, "evt3": 24}[name]
    if bits != period:
        pytest.skip("another word's range")
    events = stream(1, 400, start_us=(1 << bits) - 10_000)
    assert rows(decoded(registry.decoder(name, OPTIONS), encoded(name, OPTIONS, events))) == rows(events)


@WORDS
def test_pauses_up_to_the_plausible_and_beyond_it_are_kept(name: str) -> None:
    parts = [stream(1, 80), stream(2, 80, start_us=600_000), stream(3, 200, start_us=4_000_000, step_us=3000)]
    events = Events.concatenate(parts)
    decoder = registry.decoder(name, OPTIONS)
    assert rows(decoded(decoder, encoded(name, OPTIONS, events))) == rows(events)
    assert decoder.counters.time_jumps == 1


@WORDS
def test_after_a_restart_time_goes_on(name: str) -> None:
    before, after = stream(1, 300, start_us=6_000_000), stream(2, 300)
    decoder = registry.decoder(name, OPTIONS)
    came = decoded(decoder, encoded(name, OPTIONS, before) + encoded(name, OPTIONS, after))
    assert len(came) >= 590
    assert (np.diff(came.t) >= 0).all()
    assert came.t[-1] - before.t[-1] <= after.span_us + 5000
    assert decoder.counters.time_jumps >= 1


@WORDS
def test_a_time_word_with_a_spoilt_bit_moves_no_other_time(name: str) -> None:
    events = stream(4, 400, step_us=160)
    data = encoded(name, OPTIONS, events)
    size = {"evt2": 4, "evt3": 2}[name]
    words = [int.from_bytes(data[at : at + size], "little") for at in range(0, len(data), size)]
    times = [index for index, word in enumerate(words) if word >> (8 * size - 4) == 8]
    middle = times[len(times) // 2]
    for bit in range(8 * size - 4):
        spoilt = list(words)
        spoilt[middle] ^= 1 << bit
        came = decoded(registry.decoder(name, OPTIONS), b"".join(word.to_bytes(size, "little") for word in spoilt))
        assert len(came) == 400
        assert int(np.count_nonzero(came.t != events.t)) <= (110 if name == "evt3" else 20)
        assert came.t[-1] == events.t[-1]


def test_behind_a_breach_no_row_is_guessed() -> None:
    events = stream(1, 200)
    data = encoded("evt3", OPTIONS, events)
    sent = {(x, y) for _, x, y, _ in rows(events)}
    for place in range(100, 140):
        decoder = registry.decoder("evt3", OPTIONS)
        came = decoded(decoder, data[:place] + data[place + 1 :])
        # The word itself may read as another; what came behind it has the right row or none.
        assert len({(x, y) for _, x, y, _ in rows(came)} - sent) <= 1
        assert decoder.counters.bad_bytes + decoder.counters.lost_events > 0


@WORDS
def test_a_sensor_that_the_words_cannot_hold_is_refused(name: str) -> None:
    wide = Events(np.array([1]), np.array([2999]), np.array([0]), np.array([1]), 3000, 10)
    with pytest.raises(ConfigError, match="2048x2048"):
        encoded(name, OPTIONS, wide)


@WORDS
def test_the_device_streams_from_the_start_and_takes_no_command(name: str) -> None:
    device = registry.device(name, OPTIONS)
    assert device.streaming
    assert device.receive(b"anything\n") == b""
