"""A player keeps to the recording's time and the line's rate, says when it cannot, and an emulator obeys its host."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tiegocancel import Events
from tiegocancel.errors import ConfigError, LinkError, TiegoCancelError
from tiegocancel.link.emulator import Emulator, repeated
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.player import Pace, Player
from tiegocancel.link.pseudo_terminal import PseudoTerminal
from tiegocancel.link.source import Limits
from tiegocancel.link.stream_line import StreamLine

Serve = Callable[..., Any]


def play(tiny: SimpleNamespace, events: Events, **pace: Any) -> tuple[Any, bytes, list[str], list[tuple[float, int]]]:
    """Play by a clock of its own; return what was counted, the bytes, the remarks, and when how many bytes went."""
    sent, said, log, clock = bytearray(), [], [], [100.0]  # type: ignore[var-annotated]

    def send(data: bytes) -> bool:
        sent.extend(data)
        log.append((clock[0] - 100.0, len(data)))
        return True

    def sleep(seconds: float) -> None:
        clock[0] += seconds

    player = Player(Pace(**pace), send, said.append, now_s=lambda: clock[0], sleep=sleep)
    played = player.play([events[:777], events[777:]], tiny.Encoder())
    return played, bytes(sent), said, log


def test_everything_is_sent_in_order(tiny: SimpleNamespace) -> None:
    events = tiny.some_events(5000)
    played, sent, said, _ = play(tiny, events, speed=0.0)
    assert sent == tiny.Encoder().encode(events)
    assert (played.sent, played.bytes, played.ended, said) == (5000, 40_000, True, [])


@pytest.mark.parametrize("speed", [0.5, 1.0, 3.0])
def test_each_event_is_sent_at_its_time(tiny: SimpleNamespace, speed: float) -> None:
    events = tiny.some_events(3000, step_us=100)
    played, sent, said, log = play(tiny, events, speed=speed)
    assert sent == tiny.Encoder().encode(events)
    assert said == []
    when = np.repeat([at for at, _ in log], [size // 8 for _, size in log])
    late_s = when - events.t * 1e-6 / speed
    assert late_s.min() > -1e-9
    assert late_s.max() < 0.0021  # pieces of 2 ms
    assert played.seconds == pytest.approx(0.3 / speed, abs=0.001)


def test_a_slow_line_slows_the_playback_down_and_says_so(tiny: SimpleNamespace) -> None:
    events = tiny.some_events(3000, step_us=10)  # 0.03 s, 24,000 bytes
    played, sent, said, log = play(tiny, events, speed=1.0, bytes_per_s=80_000.0)
    assert sent == tiny.Encoder().encode(events)
    assert played.lag_s == pytest.approx(0.25, abs=0.01)
    # No stretch of time carries more than the line does, but for one piece that begins it.
    at, total = np.array([at for at, _ in log]), np.cumsum([size for _, size in log])
    assert (total[:-1] <= 80_000 * at[1:] + 1e-6).all()
    assert len(said) == 1
    assert "80,000 bytes/s" in said[0]
    assert "10 kev/s at 8.00 bytes" in said[0]
    assert "slowed down" in said[0]


def test_a_slow_line_may_thin_the_stream_out_and_counts_it(tiny: SimpleNamespace) -> None:
    events = tiny.some_events(30_000, step_us=10)  # 0.3 s at 100 kev/s, of which the line carries 25 kev/s
    played, sent, said, _ = play(tiny, events, speed=1.0, bytes_per_s=200_000.0, when_full="thin")
    kept = tiny.Decoder().feed(sent)
    assert played.sent == len(kept)
    assert played.sent + played.thinned == 30_000
    assert played.sent == pytest.approx(7500, rel=0.1)
    assert played.seconds == pytest.approx(0.3, abs=0.03)
    assert np.isin(kept.t, events.t).all()
    # Thinned evenly, not cut off.
    counts = np.histogram(kept.t[kept.t > 60_000], bins=8)[0]
    assert counts.min() > 0.7 * counts.max()
    assert "thinned out evenly" in said[0]


def test_an_end_that_takes_too_little_is_told_from_a_line_that_does(tiny: SimpleNamespace) -> None:
    clock, said = [0.0], []  # type: ignore[var-annotated]

    def send(data: bytes) -> bool:
        clock[0] += 0.05 if data else 0.0  # the other end is slow to take it
        return True

    def sleep(seconds: float) -> None:
        clock[0] += seconds

    player = Player(Pace(bytes_per_s=1e6), send, said.append, now_s=lambda: clock[0], sleep=sleep)
    player.play([tiny.some_events(2000)], tiny.Encoder())
    assert len(said) == 1
    assert "the other end takes less than it is sent: the playback is slowed down" in said[0]


def test_a_recording_can_be_repeated_in_time(tiny: SimpleNamespace) -> None:
    events = tiny.some_events(100)
    whole = Events.concatenate(list(repeated(lambda: [events[:40], events[40:]], 3)))
    assert len(whole) == 300
    assert np.array_equal(whole.x, np.tile(events.x, 3))
    assert int(whole.t[100]) - int(whole.t[99]) == 1000
    with pytest.raises(LinkError, match="holds no events"):
        next(repeated(lambda: [events[:0]], 1))


def test_a_host_may_start_and_stop_as_often_as_it_likes(
    serve: Serve, tiny: SimpleNamespace, line_options: LineOptions
) -> None:
    events = tiny.some_events(30_000)
    serving = serve(events, speed=1.0)
    for count in (10, 1000, 30_000):
        link = tiny.source(serving.port, line_options, limits=Limits(max_events=count))
        assert tiny.equal(tiny.received(link), events[:count])


def test_a_recording_is_played_into_a_file(tiny: SimpleNamespace, tmp_path: Path) -> None:
    events = tiny.some_events(2000)
    path = tmp_path / "stream.bin"
    with StreamLine(str(path), writes=True) as line:
        Emulator(line, tiny.Device(), lambda: [events], pace=Pace(speed=0.0), at_once=True, once=True).serve()
    assert path.read_bytes() == tiny.Encoder().encode(events)


def test_a_port_may_have_a_second_name(tmp_path: Path, line_options: LineOptions) -> None:
    name = tmp_path / "dvs0"
    with PseudoTerminal() as line, PseudoTerminal() as other:
        line.name(name)
        assert str(name.resolve()) == line.port
        other.name(name)
        assert str(name.resolve()) == other.port
    assert not name.is_symlink()
    name.write_text("a file")
    with PseudoTerminal() as line, pytest.raises(ConfigError, match="in the way"):
        line.name(name)
    assert name.read_text() == "a file"


def test_bytes_that_nobody_reads_are_told(tiny: SimpleNamespace) -> None:
    with PseudoTerminal(write_timeout_s=0.2) as line:
        line.write(b"x" * 100)
        deadline = time.monotonic() + 2.0
        while line.unread != 100 and time.monotonic() < deadline:
            time.sleep(0.001)
        assert line.unread == 100
        with pytest.raises(LinkError, match=r"has taken no byte for 0\.2 s"):
            line.write(b"x" * 1_000_000)


HOST = """
import sys, time
sys.path.insert(0, sys.argv[2])
from conftest import TinyDecoder, TinyHost
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.source import LinkSource
with LinkSource(sys.argv[1], "tiny", decoder=TinyDecoder(), host=TinyHost()) as link:
    for chunk in link:
        if len(chunk):
            sys.stdout.write(".")
            sys.stdout.flush()
"""


def killed_hosts(serve: Serve, tiny: SimpleNamespace, line_options: LineOptions, rounds: int) -> None:
    """Kill a host at a random moment so many times; after each the next one gets the whole stream again."""
    rng = np.random.default_rng(7)
    events = tiny.some_events(200_000)
    serving = serve(events, speed=1.0)
    for _ in range(rounds):
        host = subprocess.Popen(
            [sys.executable, "-c", HOST, serving.port, str(Path(__file__).parent)], stdout=subprocess.PIPE
        )
        assert host.stdout is not None
        assert host.stdout.read(1) == b"."
        time.sleep(float(rng.uniform(0, 0.05)))
        host.send_signal(signal.SIGKILL)
        host.wait(5.0)
        host.stdout.close()
        link = tiny.source(serving.port, line_options, limits=Limits(max_events=3000))
        assert tiny.equal(tiny.received(link), events[:3000])


def test_a_host_killed_at_random_does_no_harm(serve: Serve, tiny: SimpleNamespace, line_options: LineOptions) -> None:
    killed_hosts(serve, tiny, line_options, 3)


@pytest.mark.slow
def test_a_hundred_hosts_killed_at_random_do_no_harm(
    serve: Serve, tiny: SimpleNamespace, line_options: LineOptions
) -> None:
    killed_hosts(serve, tiny, line_options, 100)


def killed_devices(tiny: SimpleNamespace, line_options: LineOptions, rounds: int) -> None:
    """Let the device vanish in the middle of a byte stream so many times; the host never hangs and says so."""
    rng = np.random.default_rng(8)
    data = tiny.Encoder().encode(tiny.some_events(5000))
    for _ in range(rounds):
        length = int(rng.integers(8, len(data)))
        with socket.create_server(("127.0.0.1", 0)) as server:

            def device(server: socket.socket = server, length: int = length) -> None:
                peer, _ = server.accept()
                with peer:
                    said = b""
                    while b"G" not in said:
                        said += peer.recv(100)
                    peer.sendall(b"tiny\n" + data[:length])

            thread = threading.Thread(target=device)
            thread.start()
            link = tiny.source(f"socket://127.0.0.1:{server.getsockname()[1]}", line_options)
            with pytest.raises(TiegoCancelError):
                tiny.received(link)
            assert link.events <= length // 8
            thread.join(5.0)
            assert not thread.is_alive()


def test_a_device_killed_at_random_is_told(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    killed_devices(tiny, replace(line_options, reconnect_s=0.0), 5)


@pytest.mark.slow
def test_a_hundred_devices_killed_at_random_are_told(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    killed_devices(tiny, replace(line_options, reconnect_s=0.0), 100)


def test_a_device_sends_no_more_than_its_credit(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    pytest.importorskip("cobs", reason="the framed protocol needs the extra link")
    from tiegocancel.link.opening import open_line
    from tiegocancel.link.protocols import registry
    from tiegocancel.link.protocols.framed import FramedDecoder, FramedHost
    from tiegocancel.link.protocols.options import ProtocolOptions

    options = ProtocolOptions(width=64, height=48)
    events = tiny.some_events(2000, step_us=100)  # 20 events a piece of 2 ms: one frame
    stopped = threading.Event()
    with PseudoTerminal() as device:
        emulator = Emulator(
            device, registry.device("framed", options), lambda: [events], pace=Pace(speed=0.5), stopped=stopped.is_set
        )
        thread = threading.Thread(target=emulator.serve)
        thread.start()
        host, decoder = FramedHost(options, credit=5), FramedDecoder(options)
        got: list[Events] = []

        def hear(seconds: float) -> int:
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                got.append(decoder.feed(line.read(4096, 0.05)))
            return decoder.frames

        with open_line(device.port, line_options) as line:
            host.start(line)
            assert hear(0.4) == 5
            line.write(host.grant(12))
            assert hear(0.4) == 12
            line.write(host.grant(1000))
            deadline = time.monotonic() + 10.0
            while sum(map(len, got)) < 2000 and time.monotonic() < deadline:
                hear(0.05)
        stopped.set()
        thread.join(5.0)
    assert tiny.equal(Events.concatenate([part for part in got if len(part)]), events)
