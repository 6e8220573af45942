"""The framed protocol: its vectors, its counts of what is missing, decisions, credits, restarts."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tiegocancel.link.protocols
from tiegocancel import Events
from tiegocancel.errors import ConfigError, LinkError
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.framed import FramedDecoder, FramedEncoder, FramedHost
from tiegocancel.link.protocols.framed.frame import Kind, open_frame, seal_frame
from tiegocancel.link.protocols.framed.vectors import vectors
from tiegocancel.link.protocols.options import ProtocolOptions

from .conftest import decoded, encoded, rows, stream

SMALL = ProtocolOptions(width=128, height=128, frame_events=10)
COMMITTED = json.loads(
    (Path(tiegocancel.link.protocols.__file__).parent / "framed_vectors.json").read_text(encoding="utf-8")
)


def frames_of(data: bytes) -> list[bytes]:
    return [part + b"\0" for part in data.split(b"\0") if part]


def test_the_committed_vectors_are_what_the_code_makes() -> None:
    assert vectors() == COMMITTED


@pytest.mark.parametrize("case", COMMITTED["streams"], ids=lambda case: case["name"])
def test_every_vector_decodes_to_what_it_says(case: dict[str, Any]) -> None:
    decoder = FramedDecoder(ProtocolOptions())
    came = decoder.feed(bytes.fromhex(case["line"]))
    assert decoder.counters.bad_bytes == 0
    if "t_us" in case:
        assert (came.width, came.height) == (case["width"], case["height"])
        assert rows(came) == list(zip(case["t_us"], case["x"], case["y"], case["on"], strict=True))
    elif "suppressed" in case:
        ((first, suppressed),) = decoder.take_decisions()
        assert (first, suppressed.astype(int).tolist()) == (case["first"], case["suppressed"])
    elif "text" in case:
        assert [line.text for line in decoder.take_lines()] == [case["text"]]


def test_one_vector_is_read_by_hand_from_the_page() -> None:
    """Decode the frame of one event with shifts alone, as a microcontroller would."""
    line = bytes.fromhex(COMMITTED["streams"][0]["line"])
    encoded_frame = line.split(b"\0")[-2]
    content, at = b"", 0
    while at < len(encoded_frame):
        code = encoded_frame[at]
        content += encoded_frame[at + 1 : at + code]
        at += code
        content += b"\0" if code < 255 and at < len(encoded_frame) else b""
    assert content[0] == 0x10 | 1
    assert content[8] == 1  # one event
    form = int.from_bytes(content[9:11], "little")
    assert (form >> 6 & 15, form >> 11 & 15) == (15, 15) or form >> 10 & 1 == 0
    bits, take = int.from_bytes(content[11:-2], "little"), 0

    def field(width: int) -> int:
        nonlocal take
        value = bits >> take & (1 << width) - 1
        take += width
        return value

    wx, wy = form >> 6 & 15, form >> 11 & 15
    p = field(1)
    x = field(3) if wx == 15 else field(wx) >> 1
    y = field(2) if wy == 15 else field(wy) >> 1
    assert (p, x, y, int.from_bytes(content[4:8], "little")) == (1, 3, 2, 5)


@pytest.fixture(scope="module")
def reader_in_c(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A reader written from the page alone, in C."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    program = tmp_path_factory.mktemp("c") / "framed_reader"
    source = Path(__file__).with_name("framed_reader.c")
    subprocess.run([compiler, "-O1", "-Wall", "-Wextra", "-Werror", "-o", str(program), str(source)], check=True)
    return program


def read_in_c(program: Path, line: bytes) -> list[tuple[int, ...]]:
    done = subprocess.run([str(program)], input=line, capture_output=True, check=True)
    return [tuple(map(int, row.split())) for row in done.stdout.splitlines()]


@pytest.mark.parametrize(
    "case", [case for case in COMMITTED["streams"] if "t_us" in case], ids=lambda case: case["name"]
)
def test_a_reader_in_c_finds_the_same_in_every_vector(case: dict[str, Any], reader_in_c: Path) -> None:
    found = read_in_c(reader_in_c, bytes.fromhex(case["line"]))
    assert found == list(zip(case["t_us"], case["x"], case["y"], case["on"], strict=True))


@pytest.mark.parametrize(("side_px", "step_us"), [(128, 160), (1280, 1), (320, 20_000)])
def test_a_reader_in_c_finds_the_events_of_any_stream(side_px: int, step_us: int, reader_in_c: Path) -> None:
    events = stream(8, 5000, side_px=side_px, step_us=step_us)
    assert read_in_c(reader_in_c, encoded("framed", ProtocolOptions(), events)) == rows(events)


@given(
    steps=st.lists(st.sampled_from([0, 1, 2, 30, 5000, (1 << 20) - 1, 1 << 20, 1 << 33]), min_size=1, max_size=60),
    side=st.sampled_from([(1, 1), (2, 3), (128, 128), (1280, 720), (65_535, 65_535)]),
    seed=st.integers(0, 99),
    tick_ns=st.sampled_from([1, 20, 1000]),
    start_us=st.sampled_from([0, -5000, 4_294_967_290, 1 << 45]),
)
@settings(max_examples=25)
def test_any_events_within_its_range_come_back(
    steps: list[int], side: tuple[int, int], seed: int, tick_ns: int, start_us: int
) -> None:
    rng = np.random.default_rng(seed)
    n = len(steps)
    t = start_us + np.cumsum(steps)
    events = Events(t, rng.integers(0, side[0], n), rng.integers(0, side[1], n), rng.integers(0, 2, n), *side)
    options = ProtocolOptions(tick_ns=tick_ns, frame_events=7)
    decoder = FramedDecoder(ProtocolOptions())
    assert rows(decoded(decoder, encoded("framed", options, events))) == rows(events)
    assert decoder.counters.lost_frames == decoder.counters.lost_events == decoder.counters.time_jumps == 0


def test_a_lost_frame_is_counted_with_its_events() -> None:
    events = stream(1, 200)
    frames = frames_of(encoded("framed", SMALL, events))
    decoder = FramedDecoder(SMALL)
    came = decoder.feed(b"".join([*frames[:5], *frames[7:]]))
    assert (decoder.counters.lost_frames, decoder.counters.lost_events) == (2, 20)
    assert len(came) == 180


def test_a_spoilt_byte_loses_its_frame_alone() -> None:
    events = stream(1, 100)
    data = encoded("framed", SMALL, events)
    for place in range(200, 300):
        decoder = FramedDecoder(SMALL)
        spoilt = bytearray(data)
        spoilt[place] ^= 0x55
        came = decoder.feed(bytes(spoilt))
        assert len(events) - len(came) <= 20
        assert decoder.counters.lost_events == len(events) - len(came)
        assert decoder.counters.resyncs == 1
        assert set(rows(came)) <= set(rows(events))


def test_a_listener_who_comes_late_waits_for_a_hello_and_counts_what_it_missed() -> None:
    events = Events.concatenate([stream(1, 50), stream(2, 50, start_us=700_000)])
    data = encoded("framed", SMALL, events)
    decoder = FramedDecoder(ProtocolOptions())
    came = decoder.feed(b"".join(frames_of(data)[3:]))
    assert rows(came) == rows(events)[50:]
    assert (decoder.width, decoder.height) == (128, 128)
    assert decoder.counters.lost_events > 0


def test_a_device_that_starts_anew_is_told_by_its_session() -> None:
    first = encoded("framed", SMALL, stream(1, 50, start_us=9_000_000))
    encoder = FramedEncoder(SMALL, session=1)
    second = encoder.begin() + encoder.encode(stream(2, 50))
    decoder = FramedDecoder(SMALL)
    came = decoder.feed(first + second)
    assert len(came) == 100
    assert came.t[50] == came.t[49]
    assert came.span_us == stream(1, 50).span_us + stream(2, 50).span_us
    assert (decoder.counters.lost_frames, decoder.counters.lost_events, decoder.counters.time_jumps) == (0, 0, 1)


def test_a_device_that_is_started_again_begins_a_session_and_says_its_size_first() -> None:
    device = registry.device("framed", ProtocolOptions())
    decoder = FramedDecoder(ProtocolOptions())
    runs = []
    for seed in (1, 2, 3):
        encoder = device.encoder()
        run = stream(seed, 40, start_us=5_000_000)
        runs.append(decoder.feed(encoder.begin() + encoder.encode(run)))
        assert rows(runs[-1]) == [(t - 5_000_000 + int(runs[-1].t[0]), *rest) for t, *rest in rows(run)]
    assert rows(Events.concatenate(runs))[0][0] == 5_000_000
    assert (decoder.counters.lost_frames, decoder.counters.lost_events, decoder.counters.time_jumps) == (0, 0, 2)


def test_decisions_come_back_in_order_and_a_gap_shows() -> None:
    encoder = FramedEncoder(SMALL)
    rng = np.random.default_rng(1)
    masks = [rng.integers(0, 2, n).astype(np.bool_) for n in (3, 70_000, 5)]
    decoder = FramedDecoder(SMALL)
    decoder.feed(encoder.decisions(0, masks[0]) + encoder.decisions(3, masks[1]))
    decoder.feed(encoder.decisions(70_003 + 8, masks[2]))
    parts = decoder.take_decisions()
    assert np.array_equal(np.concatenate([mask for _, mask in parts]), np.concatenate(masks))
    assert parts[-1][0] == 70_011
    assert decoder.counters.lost_events == 8


def test_text_goes_beside_the_events_at_their_time() -> None:
    encoder = FramedEncoder(SMALL)
    events = stream(1, 30)
    data = encoder.encode(events[:20]) + encoder.text("-S7 1 2 3") + encoder.encode(events[20:])
    decoder = FramedDecoder(SMALL)
    assert rows(decoder.feed(data)) == rows(events)
    (line,) = decoder.take_lines()
    assert (line.text, line.t_us) == ("-S7 1 2 3", int(events.t[19]))


def test_what_is_no_sound_payload_is_passed_over() -> None:
    decoder = FramedDecoder(SMALL)
    for kind, payload in [
        (Kind.HELLO, b"xx"), (Kind.EVENTS, b""), (Kind.EVENTS, bytes(9)), (Kind.DECISIONS, b"\0\0\5\0"),
    ]:  # fmt: skip
        decoder.feed(seal_frame(kind, 0, payload))
    # A width of 31 bits and an event without bits, each with a right CRC.
    decoder.feed(seal_frame(Kind.EVENTS, 1, bytes([0, 0, 0, 0, 0, 0, 9, 0xFF, 0xFF])))
    assert decoder.counters.bad_bytes > 0
    assert decoder.counters.events == 0
    assert open_frame(b"\x01\x01\x01\x01\x01") is None


def test_an_endless_frame_does_not_fill_the_memory() -> None:
    decoder = FramedDecoder(SMALL)
    for _ in range(100):
        decoder.feed(b"\x55" * 1000)
    assert decoder.counters.bad_bytes > 95_000


def test_the_host_starts_the_device_and_learns_its_size(make_line: Callable[..., Any]) -> None:
    device = registry.device("framed", ProtocolOptions(width=320, height=240))
    line = make_line(device)
    host = FramedHost(ProtocolOptions())
    assert host.start(line) == "tiegocancel 320x240 px, tick 1000 ns"
    assert device.streaming
    assert device.allowance is None
    host.stop(line)
    assert not device.streaming
    with pytest.raises(LinkError, match="no HELLO"):
        FramedHost(ProtocolOptions()).start(make_line(device, answers=False))


def test_the_device_sends_no_more_than_its_credit(make_line: Callable[..., Any]) -> None:
    device = registry.device("framed", SMALL)
    line = make_line(device)
    host = FramedHost(SMALL, credit=3)
    host.start(line)
    assert device.allowance == 3
    decoder = FramedDecoder(SMALL)
    decoder.feed(device.encoder().encode(stream(1, 30)))
    assert (device.allowance, decoder.frames) == (0, 3)
    line.write(host.grant(decoder.frames + 2))
    assert device.allowance == 2
    line.write(seal_frame(Kind.START, 9, b"\0\0\0"))
    assert device.allowance is None


def test_the_device_tells_what_it_does_not_understand() -> None:
    device = registry.device("framed", SMALL)
    decoder = FramedDecoder(SMALL)
    decoder.feed(device.receive(seal_frame(Kind.TEXT, 0, b"hm")) + device.receive(b"junk\0"))
    assert [line.text for line in decoder.take_lines()] == [
        "a frame of kind 3 is not understood",
        "a frame with a wrong CRC",
    ]


def test_times_beyond_its_range_are_refused() -> None:
    late = Events(np.array([1 << 60]), np.array([0]), np.array([0]), np.array([1]), 4, 4)
    with pytest.raises(ConfigError, match="2\\^62 ticks"):
        encoded("framed", ProtocolOptions(tick_ns=1), late)
