"""Count what a spoilt byte costs each wire protocol: events lost and false events, exact to the microsecond.

Bytes are dropped, doubled, flipped in one bit, or random ones inserted, one kind as often as another. An event counts
as come only with its exact time, place and polarity; one with a wrong time is lost and false. E2 is also held to its
16 bits, because a wrap that is taken for a pause shifts all that follows. Times of E1 shift with every lost step.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from tiegocancel import Events, read_events
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions

RECORDING = Path(__file__).resolve().parents[3] / "shared" / "data" / "dvs128_moving_box.aedat"
CASES = (
    "edvs E1",
    "edvs E2",
    "edvs E2 (16 bits)",
    "edvs E3",
    "edvs E4",
    "evt2",
    "evt3",
    "openmv",
    "framed",
    "framed 16",
)


def recording(count: int) -> Events:
    if RECORDING.exists():
        e = read_events(RECORDING)[:count]
    else:
        rng = np.random.default_rng(0)
        t = np.cumsum(rng.exponential(80, count)).astype(np.int64)
        place = np.clip(rng.normal(64, 20, (2, count)), 0, 127).astype(np.int64)
        e = Events(t, place[0], place[1], np.repeat(rng.integers(0, 2, count // 4 + 1), 4)[:count], 128, 128)
    return Events(e.t - e.t[0], e.x, e.y, e.p, 128, 128)


def spoil(data: bytes, share: float, seed: int) -> tuple[bytes, int]:
    rng = np.random.default_rng(seed)
    hits = np.sort(rng.choice(len(data), int(len(data) * share), replace=False))
    parts, done = [], 0
    for place, what in zip(hits.tolist(), rng.integers(0, 4, len(hits)).tolist(), strict=True):
        byte = data[place : place + 1]
        if what == 1:
            byte += byte
        elif what == 2:
            byte = bytes([byte[0] ^ 1 << int(rng.integers(8))])
        elif what == 3:
            byte += bytes([int(rng.integers(256))])
        parts += [data[done:place], b"" if what == 0 else byte]
        done = place + 1
    return b"".join([*parts, data[done:]]), len(hits)


def common(one: Events, other: Events, period_us: int) -> int:
    """Return how many events two streams have in common."""
    keys, counts = [], []
    for e in (one, other):
        place = e.x.astype(np.int64) << 8 | e.y.astype(np.int64) << 1 | e.p
        found, count = np.unique((e.t % period_us) << 15 | place, return_counts=True)
        keys.append(found)
        counts.append(count)
    _, a, b = np.intersect1d(*keys, assume_unique=True, return_indices=True)
    return int(np.minimum(counts[0][a], counts[1][b]).sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--events", type=int, default=100_000)
    parser.add_argument("--seeds", type=int, default=2)
    args = parser.parse_args()
    events = recording(args.events)
    sys.stdout.write(
        "| spoilt bytes | protocol | bytes hit | lost a byte | false a byte | lost (%) | counted |\n"
        "|---|---|---|---|---|---|---|\n"
    )
    for share in (1e-3, 1e-2):
        for case in CASES:
            name, _, kind = case.partition(" ")
            options = ProtocolOptions(
                width=128, height=128, edvs_format=kind[:2] if name == "edvs" else "E3",
                frame_events=int(kind) if name == "framed" and kind else 96,
            )  # fmt: skip
            lost = false = hits = bad = frames = jumps = 0
            for seed in range(args.seeds):
                encoder = registry.encoder(name, options)
                data, count = spoil(encoder.begin() + encoder.encode(events) + encoder.end(), share, seed)
                decoder = registry.decoder(name, options)
                parts = [decoder.feed(data[at : at + 65_536]) for at in range(0, len(data), 65_536)]
                came = Events.concatenate([*parts, decoder.settle()])
                same = common(events, came, 65_536 if "16 bits" in kind else 1 << 47)
                lost, false, hits = lost + len(events) - same, false + len(came) - same, hits + count
                counters = decoder.counters
                bad, frames = bad + counters.bad_bytes, frames + counters.lost_frames
                jumps += counters.time_jumps
            total = len(events) * args.seeds
            sys.stdout.write(
                f"| {share:g} | {case} | {hits} | {lost / hits:.2f} | {false / hits:.2f} | {100 * lost / total:.1f} "
                f"| {bad} bad bytes, {frames} frames, {jumps} jumps |\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
