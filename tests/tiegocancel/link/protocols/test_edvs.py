"""The eDVS: bytes as the guide prints them, text between events, wraps, resets, and the conversation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import Events
from tiegocancel.errors import ConfigError, LinkError
from tiegocancel.estimation.inertial.edvs_lines import gyro_of_lines
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.edvs.host import bytes_an_event
from tiegocancel.link.protocols.options import ProtocolOptions

from .conftest import counted, decoded, encoded, rows, spoil, stream

FORMATS = ("E0", "E1", "E2", "E3", "E4")


def one(t_us: int, x: int, y: int, p: int) -> Events:
    return Events(np.array([t_us]), np.array([x]), np.array([y]), np.array([p]), 128, 128)


@pytest.mark.parametrize(
    ("edvs_format", "line"),
    [
        ("E0", "85 83"),
        ("E1", "85 83 24 f4"),
        ("E2", "85 83 12 74"),
        ("E3", "85 83 00 12 74"),
        ("E4", "85 83 00 00 12 74"),
    ],
)
def test_an_event_is_row_then_polarity_and_column_then_the_stamp_with_its_high_byte_first(
    edvs_format: str, line: str
) -> None:
    options = ProtocolOptions(edvs_format=edvs_format)
    event = one(0x1274, 3, 5, 0)
    assert encoded("edvs", options, event) == bytes.fromhex(line)
    if edvs_format != "E0":
        assert rows(decoded(registry.decoder("edvs", options), bytes.fromhex(line))) == rows(event)


@given(st.integers(0, (1 << 28) - 1))
def test_delta_stamps_are_as_long_as_the_firmware_makes_them_and_come_back(step_us: int) -> None:
    options = ProtocolOptions(edvs_format="E1", max_jump_us=1 << 28)
    events = Events(np.array([0, step_us]), np.array([1, 2]), np.array([3, 4]), np.array([1, 0]), 128, 128)
    data = encoded("edvs", options, events)
    assert len(data) == 3 + 2 + (1 if step_us < 127 else 2 if step_us < 16_383 else 3 if step_us < 2_097_151 else 4)
    assert rows(decoded(registry.decoder("edvs", options), data)) == rows(events)


def test_the_polarity_bit_may_mean_on() -> None:
    options = ProtocolOptions(off_bit=False)
    assert decoded(registry.decoder("edvs", options), bytes.fromhex("85 83 00 12 74")).p.tolist() == [1]
    assert encoded("edvs", options, one(0x1274, 3, 5, 1)) == bytes.fromhex("85 83 00 12 74")


def test_events_without_a_stamp_bear_the_time_of_their_arrival() -> None:
    now = iter([70, 60, 90])
    options = ProtocolOptions(edvs_format="E0", now_us=lambda: next(now))
    decoder = registry.decoder("edvs", options)
    came = Events.concatenate([decoder.feed(b"\x81\x01" * 3), decoder.feed(b"\x82\x02"), decoder.settle()])
    # Each waits for its successor; the clock that fell back is held.
    assert came.t.tolist() == [70, 70, 70, 90]


@pytest.mark.parametrize(("edvs_format", "bits"), [("E2", 16), ("E3", 24), ("E4", 32)])
def test_stamps_wrap_and_time_goes_on(edvs_format: str, bits: int) -> None:
    options = ProtocolOptions(edvs_format=edvs_format)
    events = stream(1, 400, start_us=(1 << bits) - 10_000)
    assert rows(decoded(registry.decoder("edvs", options), encoded("edvs", options, events))) == rows(events)


@pytest.mark.parametrize("edvs_format", ["E3", "E4"])
def test_a_pause_that_events_behind_it_confirm_is_kept(edvs_format: str) -> None:
    options = ProtocolOptions(edvs_format=edvs_format)
    before, after = stream(1, 100), stream(2, 100, start_us=5_000_000)
    events = Events.concatenate([before, after])
    decoder = registry.decoder("edvs", options)
    assert rows(decoded(decoder, encoded("edvs", options, events))) == rows(events)
    assert decoder.counters.time_jumps == 1


@pytest.mark.parametrize("edvs_format", ["E2", "E3", "E4"])
@pytest.mark.parametrize("banner", [b"", b"\nEDVS-4337, RELEASE V1.4 IMU\nSystem Clock: 192MHz\n"])
def test_after_a_reset_time_goes_on_and_no_event_is_lost(edvs_format: str, banner: bytes) -> None:
    options = ProtocolOptions(edvs_format=edvs_format)
    before, after = stream(1, 200, start_us=3_000_000), stream(2, 200)
    decoder = registry.decoder("edvs", options)
    came = decoded(decoder, encoded("edvs", options, before) + banner + encoded("edvs", options, after))
    assert len(came) == 400
    assert (np.diff(came.t) >= 0).all()
    assert came.x.tolist() == [*before.x.tolist(), *after.x.tolist()]
    # Without the banner E2 takes the reset for a pause of less than one wrap.
    assert came.t[-1] - came.t[199] == after.span_us or (edvs_format == "E2" and not banner)
    assert [line.text for line in decoder.take_lines()] == [line.decode() for line in banner.split(b"\n") if line]


def test_a_stamp_with_a_spoilt_bit_loses_one_event_and_no_time() -> None:
    options = ProtocolOptions(edvs_format="E3")
    events = stream(5, 60, step_us=100)
    data = bytearray(encoded("edvs", options, events))
    for bit in range(8, 24):
        spoilt = bytearray(data)
        spoilt[5 * 30 + 2 + (23 - bit) // 8] ^= 1 << bit % 8
        came = decoded(registry.decoder("edvs", options), bytes(spoilt))
        assert rows(came)[-29:] == rows(events)[31:]
        assert len(came) >= 59


@pytest.mark.parametrize("edvs_format", ["E1", "E2", "E3", "E4"])
def test_lines_of_the_gyroscope_between_events_stay_out_of_band(edvs_format: str) -> None:
    options = ProtocolOptions(edvs_format=edvs_format)
    device = registry.device("edvs", ProtocolOptions(edvs_format=edvs_format))
    device.receive(b"!S+1152,2\n")
    events = stream(3, 500)
    data = device.encoder().encode(events)
    decoder = registry.decoder("edvs", options)
    assert rows(decoded(decoder, data)) == rows(events)
    lines = decoder.take_lines()
    assert len(lines) == decoder.counters.text_lines == 2 * (events.span_us // 2000 + 1)
    assert {line.text for line in lines} == {"-S7 0 0 0", "-S10 0 0 0"}
    assert all(line.t_us in (0, *events.t.tolist()) for line in lines)
    gyro = gyro_of_lines((line.t_us, line.text) for line in lines)
    assert gyro.malformed == 0
    assert gyro.samples is not None


@pytest.mark.parametrize("edvs_format", ["E1", "E2", "E3", "E4"])
@pytest.mark.parametrize("seed", range(4))
def test_cuts_change_nothing_where_lines_resets_and_spoilt_bytes_meet(edvs_format: str, seed: int) -> None:
    options = ProtocolOptions(edvs_format=edvs_format)
    device = registry.device("edvs", options)
    device.receive(b"!S+1152,1\n")
    data = b"\nEDVS-4337, a banner\n" + device.encoder().encode(stream(seed, 100))
    device.receive(b"!ET0\n")
    data += device.encoder().encode(stream(seed + 1, 60))
    if seed:
        data, _ = spoil(data, seed, 0.01 * seed)
    whole, cut = registry.decoder("edvs", options), registry.decoder("edvs", options)
    assert rows(decoded(cut, data, range(1, len(data)))) == rows(decoded(whole, data))
    assert counted(cut.counters) == counted(whole.counters)
    assert cut.take_lines() == whole.take_lines()


def test_a_half_line_waits_for_its_end() -> None:
    decoder = registry.decoder("edvs")
    assert len(decoder.feed(bytes.fromhex("8583001274") + b"-S7 1")) == 0
    assert decoder.settle().t.tolist() == [0x1274]
    assert decoder.take_lines() == []
    decoder.feed(b" 2 3\n")
    assert [line.text for line in decoder.take_lines()] == ["-S7 1 2 3"]


def test_the_last_event_waits_until_it_is_settled() -> None:
    decoder = registry.decoder("edvs")
    data = encoded("edvs", ProtocolOptions(), stream(1, 10))
    assert len(decoder.feed(data)) == 9
    assert len(decoder.settle()) == 1
    assert len(decoder.settle()) == 0


def test_coordinates_beyond_the_sensor_are_refused() -> None:
    with pytest.raises(ConfigError, match="crop"):
        encoded("edvs", ProtocolOptions(), Events(*(np.array([v]) for v in (0, 200, 0, 1)), 346, 260))


def test_a_smaller_sensor_counts_what_lies_beyond_it() -> None:
    decoder = registry.decoder("edvs", ProtocolOptions(width=64, height=64))
    came = decoded(decoder, encoded("edvs", ProtocolOptions(), stream(1, 200)))
    assert decoder.counters.outside == 200 - len(came) > 0


@pytest.mark.parametrize("edvs_format", FORMATS)
def test_the_host_starts_the_device_in_the_format_it_wants(edvs_format: str, make_line: Callable[..., Any]) -> None:
    options = ProtocolOptions(edvs_format=edvs_format, sensor_bitmap=128)
    device = registry.device("edvs", options)
    line = make_line(device)
    host = registry.host("edvs", options)
    assert host.start(line).startswith("EDVS-4337")
    assert device.streaming
    events = stream(1, 50, start_us=777)
    came = decoded(registry.decoder("edvs", options), line.waiting + device.encoder().encode(events))
    assert came.x.tolist() == events.x.tolist()
    if edvs_format != "E0":
        assert came.t.tolist() == (events.t - 777).tolist()
    host.stop(line)
    assert not device.streaming
    assert b"P" not in line.sent.upper()


class Firmware:
    """A device whose formats are not those of today: it lists them, or is silent and sends."""

    def __init__(self, sizes: dict[bytes, int], *, lists: bool) -> None:
        self.sizes, self.lists, self.size, self.streaming = sizes, lists, 2, False

    def receive(self, data: bytes) -> bytes:
        reply = b""
        for command in data.split(b"\n"):
            if command == b"R":
                reply += b"DVS128 board, EDVS\n"
            elif command == b"??E" and self.lists:
                reply += b"".join(b" %s   - %d bytes per event, binary\n" % item for item in self.sizes.items())
            elif command in self.sizes:
                self.size = self.sizes[command]
            elif command in (b"E+", b"E-"):
                self.streaming = command == b"E+"
                if self.streaming:
                    wanted = {2: "E0", 4: "E2", 5: "E3", 6: "E4"}[self.size]
                    reply += encoded("edvs", ProtocolOptions(edvs_format=wanted), stream(1, 60))
        return reply


@pytest.mark.parametrize("lists", [True, False])
def test_the_host_finds_the_command_of_older_firmware(lists: bool, make_line: Callable[..., Any]) -> None:
    older = Firmware({b"!E0": 2, b"!E1": 4, b"!E2": 5, b"!E3": 6}, lists=lists)
    registry.host("edvs", ProtocolOptions(edvs_format="E3")).start(make_line(older))
    assert older.size == 5
    assert older.streaming


def test_the_host_refuses_a_device_without_the_format(make_line: Callable[..., Any]) -> None:
    with pytest.raises(LinkError, match="no event format like E4: it offers !E0 of 2 bytes"):
        registry.host("edvs", ProtocolOptions(edvs_format="E4")).start(make_line(Firmware({b"!E0": 2}, lists=True)))
    only = Firmware({b"!E4": 4, b"!E3": 4}, lists=False)
    with pytest.raises(LinkError, match="sends events of 4 bytes, not the 6"):
        registry.host("edvs", ProtocolOptions(edvs_format="E4")).start(make_line(only))


def test_the_host_refuses_what_is_no_edvs(make_line: Callable[..., Any]) -> None:
    with pytest.raises(LinkError, match="no eDVS at this baud"):
        registry.host("edvs").start(make_line(registry.device("edvs"), answers=False))


@pytest.mark.parametrize(("edvs_format", "size"), [("E0", 2), ("E2", 4), ("E3", 5), ("E4", 6)])
def test_the_size_of_events_is_told_from_their_bytes(edvs_format: str, size: int) -> None:
    data = encoded("edvs", ProtocolOptions(edvs_format=edvs_format), stream(7, 200))
    assert bytes_an_event(data) == bytes_an_event(data[3:]) == size
    assert bytes_an_event(data[:20]) == 0


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        (b"!E3\n", b""), (b"?E\n", b"-E3\n"), (b"!E9\n", b"Set: parsing error\n"), (b"?Q\n", b"Get: parsing error\n"),
        (b"hello\n", b"?\n"), (b"P\n", b"the boot loader is not emulated\n"),
        (b"pRog\n", b"the boot loader is not emulated\n"),
        (b"!BF\n!B0=17\n", b""), (b"+\n", b""),
    ],
)  # fmt: skip
def test_the_device_answers_as_the_firmware_does(command: bytes, reply: bytes) -> None:
    assert registry.device("edvs").receive(command) == reply


def test_the_device_tells_its_formats_its_help_and_echoes_after_a_reset() -> None:
    device = registry.device("edvs")
    assert b"!E4   - 6 bytes per event" in device.receive(b"??E\n")
    assert b"Supported Commands" in device.receive(b"??\n")
    assert b"EDVS-4337" in device.receive(b"?V\n")
    assert b"EDVS-4337" in device.receive(b"R\n")
    assert device.receive(b"E+\n") == b"E+\n"
    assert device.streaming


def test_the_clock_of_the_device_is_set_by_command() -> None:
    device = registry.device("edvs", ProtocolOptions(edvs_format="E4"))
    device.receive(b"!ET=500\n")
    encoder = device.encoder()
    assert encoder.encode(one(9000, 1, 1, 1))[2:] == (500).to_bytes(4, "big")
    assert encoder.encode(one(9010, 1, 1, 1))[2:] == (510).to_bytes(4, "big")
    device.receive(b"!ET0\n")
    assert encoder.encode(one(9015, 1, 1, 1))[2:] == (5).to_bytes(4, "big")
