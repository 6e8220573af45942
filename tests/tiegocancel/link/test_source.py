"""Events come over every kind of line exactly as they were sent, and nothing is lost without being counted."""

from __future__ import annotations

import os
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

import pytest

from tiegocancel import ConfigError, Events, TiegoCancelError
from tiegocancel.errors import LinkError
from tiegocancel.link.event_queue import QueueOptions
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.opening import open_line
from tiegocancel.link.source import Limits

Serve = Callable[..., Any]


def test_a_pseudo_terminal_brings_every_event(serve: Serve, tiny: SimpleNamespace, line_options: LineOptions) -> None:
    events = tiny.some_events(20_000)
    serving = serve(events, speed=1.0)
    link = tiny.source(serving.port, line_options, limits=Limits(max_events=len(events)))
    assert tiny.equal(tiny.received(link), events)
    assert (link.banner, link.events, link.latency.count) == ("tiny", 20_000, 20_000)
    assert link.to_json()["decoder"]["events"] == 20_000
    assert link.notes() == []


def test_a_socket_brings_every_event(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    events = tiny.some_events(5000)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def device() -> None:
            peer, _ = server.accept()
            with peer:
                said = b""
                while b"G" not in said:
                    said += peer.recv(100)
                peer.sendall(b"tiny\n" + tiny.Encoder().encode(events))
                while peer.recv(100):
                    pass

        thread = threading.Thread(target=device)
        thread.start()
        port = f"socket://127.0.0.1:{server.getsockname()[1]}"
        link = tiny.source(port, line_options, limits=Limits(max_events=5000))
        assert tiny.equal(tiny.received(link), events)
        thread.join(5.0)
        assert not thread.is_alive()


def test_a_file_is_read_to_its_end(tiny: SimpleNamespace, line_options: LineOptions, tmp_path: Path) -> None:
    events = tiny.some_events(50_000)
    path = tmp_path / "stream.bin"
    path.write_bytes(tiny.Encoder().encode(events))
    assert tiny.equal(tiny.received(tiny.source(str(path), line_options, host=tiny.SilentHost())), events)


def test_a_loop_brings_back_what_was_written(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    with open_line("loop://", line_options) as line:
        line.write(b"abc")
        assert line.read(2, 1.0) == b"ab"
        assert line.read(10, 1.0) == b"c"
        started = time.monotonic()
        assert line.read(10, 0.05) == b""
        assert time.monotonic() - started < 1.0
        line.write(b"xyz")
        line.drop_input()
        assert line.read(10, 0.0) == b""


def test_standard_input_is_a_line(tiny: SimpleNamespace, tmp_path: Path) -> None:
    code = (
        "from tiegocancel.link.opening import open_line\n"
        "from tiegocancel.link.line_options import LineOptions\n"
        "line, said = open_line('-', LineOptions()), b''\n"
        "while not line.ended: said += line.read(100, 1.0)\n"
        "print(len(said))"
    )
    done = subprocess.run([sys.executable, "-c", code], input=b"x" * 100_000, capture_output=True, check=True)
    assert done.stdout.strip() == b"100000"


def test_any_fragmentation_gives_the_same_events(
    tiny: SimpleNamespace, line_options: LineOptions, tmp_path: Path
) -> None:
    events = tiny.some_events(400)
    data = tiny.Encoder().encode(events)
    read_end, write_end = os.pipe()
    path = tmp_path / "fifo"
    os.close(read_end)
    os.close(write_end)
    os.mkfifo(path)

    def dribble() -> None:
        with path.open("wb", buffering=0) as pipe:
            for first in range(0, len(data), 37):
                pipe.write(data[first : first + 37])
                time.sleep(0.0005)

    thread = threading.Thread(target=dribble)
    thread.start()
    link = tiny.source(str(path), line_options, host=tiny.SilentHost())
    assert tiny.equal(tiny.received(link), events)
    thread.join(5.0)


def test_at_low_rates_an_event_is_held_no_longer_than_the_bound(
    serve: Serve, tiny: SimpleNamespace, line_options: LineOptions
) -> None:
    events = tiny.some_events(300, step_us=1000)
    serving = serve(events, speed=1.0)
    queue = QueueOptions(hold_s=0.005)
    link = tiny.source(serving.port, line_options, queue=queue, limits=Limits(max_events=300))
    with link:
        chunks = [chunk for chunk in link if len(chunk)]
    assert sum(map(len, chunks)) == 300
    # 300 ms in pieces of 5 ms; a loaded machine makes fewer and longer ones of them.
    assert len(chunks) > 10


def test_a_limit_in_time_stops_the_device(serve: Serve, tiny: SimpleNamespace, line_options: LineOptions) -> None:
    serving = serve(tiny.some_events(100_000, step_us=100), speed=1.0)
    started = time.monotonic()
    got = tiny.received(tiny.source(serving.port, line_options, limits=Limits(duration_s=0.3)))
    assert 0.25 < time.monotonic() - started < 3.0
    assert 1000 < len(got) < 6000
    deadline = time.monotonic() + 2.0
    while serving.emulator.device.streaming and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not serving.emulator.device.streaming


def test_silence_ends_the_stream_with_a_line(serve: Serve, tiny: SimpleNamespace, line_options: LineOptions) -> None:
    events = tiny.some_events(100)
    serving = serve(events, speed=0.0)
    link = tiny.source(serving.port, replace(line_options, silence_s=0.2))
    chunks: list[Events] = []
    with link, pytest.raises(TiegoCancelError, match=r"/dev/pts/\d+: no byte for 0.2 s"):
        chunks.extend(link)
    assert tiny.equal(Events.concatenate(chunks), events)


def test_a_device_that_goes_away_is_told_after_its_events(
    serve: Serve, tiny: SimpleNamespace, line_options: LineOptions
) -> None:
    events = tiny.some_events(2000)
    serving = serve(events, speed=0.0)
    chunks: list[Events] = []
    link = tiny.source(serving.port, line_options)

    def collect() -> None:
        for chunk in link:
            chunks.append(chunk)
            if link.events == len(events):
                serving.end()

    with link, pytest.raises(TiegoCancelError, match="the line is gone"):
        collect()
    assert tiny.equal(Events.concatenate(chunks), events)


def test_a_lost_line_is_opened_again_and_the_device_started(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    events = tiny.some_events(3000)
    data = tiny.Encoder().encode(events)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def device() -> None:
            for part in (data[: 8 * 1000], data[8 * 1000 :]):
                peer, _ = server.accept()
                with peer:
                    said = b""
                    while b"G" not in said:
                        said += peer.recv(100)
                    peer.sendall(b"tiny\n" + part)
                    time.sleep(0.1)

        thread = threading.Thread(target=device)
        thread.start()
        port = f"socket://127.0.0.1:{server.getsockname()[1]}"
        link = tiny.source(port, replace(line_options, reconnect_s=5.0), limits=Limits(max_events=3000))
        assert tiny.equal(tiny.received(link), events)
        assert link.reconnects == 1
        assert any("opening it again" in note for note in link.notes())
        thread.join(5.0)


def test_reconnecting_gives_up_in_time(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def device() -> None:
            peer, _ = server.accept()
            with peer:
                said = b""
                while b"G" not in said:
                    said += peer.recv(100)
                peer.sendall(b"tiny\n" + tiny.Encoder().encode(tiny.some_events(10)))
                time.sleep(0.05)
            server.close()

        thread = threading.Thread(target=device)
        thread.start()
        link = tiny.source(f"socket://127.0.0.1:{server.getsockname()[1]}", replace(line_options, reconnect_s=0.3))
        with pytest.raises(TiegoCancelError, match=r"for 0\.3 s on"):
            tiny.received(link)
        thread.join(5.0)


def test_what_cannot_be_opened_is_one_line(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    with pytest.raises(LinkError, match=r"^/dev/ttyNONE: cannot be opened: No such file"):
        open_line("/dev/ttyNONE", line_options)
    with pytest.raises(LinkError, match="tiegocancel ports"):
        open_line("nowhere.bin", line_options)
    with pytest.raises(LinkError, match="cannot be opened"):
        open_line("nonsense://x", line_options)
    link = tiny.source("/dev/ttyNONE", line_options)
    with pytest.raises(TiegoCancelError, match="ttyNONE"):
        tiny.received(link)


def test_a_port_is_exclusive(serve: Serve, tiny: SimpleNamespace, line_options: LineOptions) -> None:
    serving = serve(tiny.some_events(10))
    with open_line(serving.port, line_options), pytest.raises(LinkError, match="another program has locked it"):
        open_line(serving.port, line_options)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Limits(max_events=0), "--max-events must be at least 1"),
        (lambda: Limits(duration_s=0.0), "--duration must be"),
        (lambda: LineOptions(baud=1), "baud must be from 50"),
        (lambda: QueueOptions(policy="never"), "policy must be one of block, drop-oldest, thin"),  # type: ignore[arg-type]
        (lambda: QueueOptions(capacity_events=10, chunk_events=20), "capacity_events must be"),
    ],
)
def test_settings_that_cannot_be_meant_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        make()


def test_a_device_that_does_not_answer_is_named(serve: Serve, tiny: SimpleNamespace, line_options: LineOptions) -> None:
    class Deaf:
        def start(self, line: object) -> str:
            raise LinkError("", "the device does not answer")

        def stop(self, line: object) -> None: ...

    serving = serve(tiny.some_events(10))
    link = tiny.source(serving.port, line_options, host=Deaf())
    with pytest.raises(TiegoCancelError, match=rf"^{serving.port}: the device does not answer"):
        tiny.received(link)


def test_a_port_without_counters_of_its_driver_tells_no_overruns(
    serve: Serve, line_options: LineOptions, tiny: SimpleNamespace
) -> None:
    with open_line(serve(tiny.some_events(10)).port, line_options) as line:
        assert line.overruns() == 0


def test_a_port_of_another_machine_is_a_line_too(tiny: SimpleNamespace, line_options: LineOptions) -> None:
    """Serve RFC 2217 in front of a port that echoes, as the server that comes with pyserial does."""
    import serial
    import serial.rfc2217

    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            peer, _ = server.accept()
            port = serial.serial_for_url("loop://", timeout=0)

            class Connection:
                def write(self, data: bytes) -> None:
                    peer.sendall(data)

            manager = serial.rfc2217.PortManager(port, Connection())
            peer.settimeout(0.02)
            with peer, port:
                while True:
                    try:
                        data = peer.recv(1024)
                        if not data:
                            return
                        port.write(b"".join(manager.filter(data)))
                    except TimeoutError:
                        pass
                    if echo := port.read(port.in_waiting):
                        peer.sendall(b"".join(manager.escape(echo)))

        thread = threading.Thread(target=serve)
        thread.start()
        data = bytes(range(256)) * 8  # with the bytes that the protocol must escape
        with open_line(f"rfc2217://127.0.0.1:{server.getsockname()[1]}", line_options) as line:
            line.write(data)
            heard, deadline = b"", time.monotonic() + 10.0
            while len(heard) < len(data) and time.monotonic() < deadline:
                heard += line.read(100, 0.1)
        assert heard == data
        thread.join(5.0)
        assert not thread.is_alive()
