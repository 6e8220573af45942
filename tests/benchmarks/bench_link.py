"""Measure the serial link per protocol: bytes an event, speed of encoder and decoder, rate and latency end to end.

    python tests/benchmarks/bench_link.py [--events N] [--seconds S]
    python tests/benchmarks/bench_link.py --soak 600 [--protocol edvs:E4]

Events are of a turning pattern on 128×128 px. End to end: a second process plays them into a pseudo-terminal, this one
reads, decodes and cancels them live (constant motion, controls on), first as fast as the line takes them, then at
50 kev/s, where the latency from byte to decision is measured. The soak plays them without end, as fast as they are
taken, compares every event with what was sent, and watches memory and descriptors.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tiegocancel import CancelConfig, Events, RotationTrajectory, write_events
from tiegocancel.link.event_queue import QueueOptions
from tiegocancel.link.line_options import LineOptions
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.link.source import Limits, LinkSource
from tiegocancel.study import Settings
from tiegocancel.study.feed import FixedMotion
from tiegocancel.study.live import run_live, warm_up

SIDE, CENTER, OMEGA = 128, (64.0, 60.0), 20.0
PROTOCOLS = ("edvs:E2", "edvs:E3", "edvs:E4", "evt2", "evt3", "openmv", "framed")
PAGE = 1 << 16
MOTION = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=OMEGA)


def turning(count: int, *, rate_hz: float) -> Events:
    """Return so many events of markers that turn, at a mean rate."""
    rng = np.random.default_rng(5)
    markers = max(int(rate_hz / 400), 1)
    radius, angle = 55 * np.sqrt(rng.random(markers)), 2 * np.pi * rng.random(markers)
    parts, t = [], 0
    while sum(len(part) for part in parts) < count:
        times = np.sort(t + rng.integers(0, 10_000, int(rate_hz / 100)))
        who = rng.integers(0, markers, len(times))
        turned = angle[who] + OMEGA * times * 1e-6
        x, y = CENTER[0] + radius[who] * np.cos(turned), CENTER[1] + radius[who] * np.sin(turned)
        parts.append(np.stack([times, np.round(x), np.round(y), who % 2]).astype(np.int64).T)
        t += 10_000
    t_, x, y, p = np.concatenate(parts)[:count].T
    return Events(t_, np.clip(x, 0, SIDE - 1), np.clip(y, 0, SIDE - 1), p, SIDE, SIDE)


def options_of(protocol: str) -> tuple[str, ProtocolOptions]:
    name, _, form = protocol.partition(":")
    return name, ProtocolOptions(width=SIDE, height=SIDE, edvs_format=form or "E3")


def codec(protocol: str, events: Events) -> tuple[float, float, float]:
    """Return bytes an event, and Mev/s of one core of encoder and decoder, each alone."""
    name, options = options_of(protocol)
    started = time.process_time()
    encoder = registry.encoder(name, options)
    data = encoder.begin() + b"".join(encoder.encode(events[k : k + PAGE]) for k in range(0, len(events), PAGE))
    data += encoder.end()
    encoded = time.process_time() - started
    decoder = registry.decoder(name, options)
    started = time.process_time()
    count = sum(len(decoder.feed(data[k : k + PAGE])) for k in range(0, len(data), PAGE)) + len(decoder.settle())
    decoded = time.process_time() - started
    if count != len(events):
        raise SystemExit(f"{protocol}: {count} of {len(events)} events came back")
    return len(data) / len(events), len(events) / encoded / 1e6, len(events) / decoded / 1e6


class Device:
    """A process that plays a recording into a pseudo-terminal."""

    def __init__(self, path: Path, protocol: str, *more: str) -> None:
        name, options = options_of(protocol)
        words = ["emulate", path, "--protocol", name, "--edvs-format", options.edvs_format, "--no-line-rate", *more]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tiegocancel", *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        assert self._process.stdout is not None
        self.port = self._process.stdout.readline().decode().strip()

    def end(self) -> None:
        self._process.kill()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()


def link_of(device: Device, protocol: str, limits: Limits) -> LinkSource:
    name, options = options_of(protocol)
    return LinkSource(
        device.port, name, options=options, line=LineOptions(reconnect_s=0.0), limits=limits, queue=QueueOptions()
    )


def live(path: Path, protocol: str, seconds: float, *more: str) -> tuple[float, LinkSource]:
    """Cancel live for some seconds; return the rate in kev/s and the link."""
    settings = Settings(cancel=CancelConfig(horizon_us=8000))
    device = Device(path, protocol, "--repeat", "0", *more)
    try:
        with link_of(device, protocol, Limits(duration_s=seconds)) as link:
            run_live(link, settings, FixedMotion(MOTION))
            return link.rate_hz() / 1e3, link
    finally:
        device.end()


def table(args: argparse.Namespace) -> None:
    events = turning(args.events, rate_hz=1e6)
    head = ("protocol", "bytes/ev", "encode Mev/s", "decode Mev/s", "live kev/s", "p50 ms", "p99 ms", "max ms")
    sys.stdout.write("".join(f"{name:>13}" for name in head) + "\n")
    warm_up(Settings(cancel=CancelConfig(horizon_us=8000)), FixedMotion(MOTION), width=SIDE, height=SIDE)
    with tempfile.TemporaryDirectory() as folder:
        fast, slow = Path(folder) / "fast.npz", Path(folder) / "slow.npz"
        write_events(fast, events)
        write_events(slow, turning(200_000, rate_hz=5e4))
        for protocol in args.protocol:
            size, encoded, decoded = codec(protocol, events)
            most, _ = live(fast, protocol, args.seconds, "--speed", "0")
            _, link = live(slow, protocol, args.seconds, "--speed", "1")
            waits = link.latency.to_json()
            cells = (size, encoded, decoded, most, waits["p50_ms"], waits["p99_ms"], waits["max_ms"])
            sys.stdout.write(f"{protocol:>13}" + "".join(f"{cell:13.2f}" for cell in cells) + "\n")
            sys.stdout.flush()


def soak(args: argparse.Namespace) -> None:
    """Receive without end, check every event, watch memory and descriptors."""
    settings = Settings(cancel=CancelConfig(horizon_us=8000))
    events = turning(500_000, rate_hz=1e6)
    warm_up(settings, FixedMotion(MOTION), width=SIDE, height=SIDE)
    seen, wrong, report_s = 0, 0, time.monotonic()
    page_kib = resource.getpagesize() // 1024
    period_us = events.span_us + 1000
    origin_us: int | None = None

    def check(chunk: Events, decisions: object, run: object) -> None:
        nonlocal seen, wrong, report_s, origin_us
        if len(chunk):
            origin_us = int(chunk.t[0]) if origin_us is None else origin_us
            index = np.arange(seen, seen + len(chunk))
            place, turn = index % len(events), index // len(events)
            wanted_us = events.t[place] - events.t[0] + turn * period_us
            good = (chunk.t - origin_us == wanted_us) & (chunk.x == events.x[place])
            good &= (chunk.y == events.y[place]) & (chunk.p == events.p[place])
            wrong += int(np.count_nonzero(~good))
            seen += len(chunk)
        if time.monotonic() - report_s > 30.0:
            report_s = time.monotonic()
            held = int(Path("/proc/self/statm").read_text().split()[1]) * page_kib
            descriptors = len(os.listdir("/proc/self/fd"))
            sys.stdout.write(f"{seen:,} events, {wrong:,} wrong, {held:,} KiB, {descriptors} descriptors\n")
            sys.stdout.flush()

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fast.npz"
        write_events(path, events)
        for protocol in args.protocol:
            device = Device(path, protocol, "--repeat", "0", "--speed", "0")
            try:
                with link_of(device, protocol, Limits(duration_s=args.soak)) as link:
                    run_live(link, settings, FixedMotion(MOTION), watch=check)
                    sys.stdout.write(
                        f"{protocol}: {seen:,} events, {wrong:,} wrong, {link.rate_hz() / 1e3:,.0f} kev/s, "
                        f"{link.latency.text()}\n" + "".join(f"  {note}\n" for note in link.notes())
                    )
            finally:
                device.end()
            seen = wrong = 0
            origin_us = None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=1_000_000)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--protocol", nargs="+", default=PROTOCOLS)
    parser.add_argument("--soak", type=float, default=0.0)
    args = parser.parse_args()
    (soak if args.soak else table)(args)


if __name__ == "__main__":
    main()
