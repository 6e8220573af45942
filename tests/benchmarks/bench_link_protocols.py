"""Measure every wire protocol on every recording: bytes an event, and how fast it is encoded and decoded.

Rates are events a second of processor time, so that other work on the machine counts little. Recordings are those of
../shared/data, or a synthetic scene where they are absent. A protocol that cannot hold a recording is left out.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from tiegocancel import Events, read_events
from tiegocancel.errors import ConfigError
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions
from tiegocancel.scene import SceneConfig, simulate

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
RECORDINGS = {
    "disc": ("anu_disc_10ms.npy", (1280, 720)),
    "spinning dot": ("spinning_dot_evt2.raw", None),
    "driving": ("driving_evt3.raw", None),
    "cars": ("davis346_imu.aedat4", None),
    "moving box": ("dvs128_moving_box.aedat", None),
    "shapes": ("ecd_shapes_rotation.txt", (240, 180)),
}
PROTOCOLS = ("edvs E1", "edvs E2", "edvs E3", "edvs E4", "evt2", "evt3", "openmv", "framed", "framed by rows")
READ_BYTES = 1 << 15


def recordings() -> dict[str, Events]:
    found = {}
    for name, (file, size) in RECORDINGS.items():
        if (DATA / file).exists():
            found[name] = read_events(DATA / file, **({"width": size[0], "height": size[1]} if size else {}))
    if not found:
        chunks = list(simulate(SceneConfig(), duration_s=0.1, seed=0))
        e = Events.concatenate(chunks)
        found["built-in scene"] = Events(e.t, e.x, e.y, e.p, e.width, e.height)
    # Times from 0, as a device that was just started has them.
    return {name: Events(e.t - e.t[0], e.x, e.y, e.p, e.width, e.height) for name, e in found.items()}


def by_rows(e: Events) -> Events:
    """Return the events with those of one tick in the order of rows, which a device is free to send."""
    order = np.lexsort((e.x, e.y, e.t))
    return Events(e.t[order], e.x[order], e.y[order], e.p[order], e.width, e.height)


def measure(protocol: str, e: Events, repeats: int) -> tuple[float, float, float]:
    """Return bytes an event and encoded and decoded Mev/s."""
    name, _, kind = protocol.partition(" ")
    options = ProtocolOptions(
        width=e.width, height=e.height, edvs_format=kind if name == "edvs" else "E3", max_jump_us=1 << 27
    )
    events = by_rows(e) if kind == "by rows" else e
    encodes, decodes, data = [], [], b""
    for _ in range(repeats):
        encoder = registry.encoder(name, options)
        started = time.process_time()
        data = b"".join([encoder.begin(), *(encoder.encode(events[a : a + 16_384]) for a in range(0, len(e), 16_384))])
        data += encoder.end()
        encodes.append(time.process_time() - started)
        decoder = registry.decoder(name, options)
        started = time.process_time()
        came = sum(len(decoder.feed(data[at : at + READ_BYTES])) for at in range(0, len(data), READ_BYTES))
        came += len(decoder.settle())
        decodes.append(time.process_time() - started)
        if came != len(e):
            raise SystemExit(f"{protocol}: {len(e) - came} events were lost")
    return len(data) / len(e), len(e) / min(encodes) / 1e6, len(e) / min(decodes) / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    repeats = parser.parse_args().repeats
    sys.stdout.write(
        "| recording | rate | protocol | bytes/event | encode (Mev/s) | decode (Mev/s) |\n|---|---|---|---|---|---|\n"
    )
    for name, events in recordings().items():
        rate = len(events) / max(events.span_us, 1)
        for protocol in PROTOCOLS:
            try:
                size, encode, decode = measure(protocol, events, repeats)
            except ConfigError:
                continue
            sys.stdout.write(f"| {name} | {rate:.3g} Mev/s | {protocol} | {size:.2f} | {encode:.1f} | {decode:.1f} |\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
