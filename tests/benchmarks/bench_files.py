"""Measure how fast each format is written and read, on events of the built-in scene.

    python tests/benchmarks/bench_files.py [--events N] [--repeats R]

Reading iterates over the whole file in chunks, checks and order included. Best of R.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from tiegocancel import Events, open_events, write_events
from tiegocancel.scene import SceneConfig, simulate

SUFFIXES = ("npz", "npy", "csv", "raw")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=2_000_000)
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    parts: list[Events] = []
    for chunk in simulate(SceneConfig(), duration_s=10.0, seed=0):
        parts.append(chunk)
        if sum(map(len, parts)) >= args.events:
            break
    labelled = Events.concatenate(parts)[: args.events]
    e = Events(labelled.t, labelled.x, labelled.y, labelled.p, labelled.width, labelled.height)
    sys.stdout.write(f"{'file':6}{'bytes/event':>12}{'write Mev/s':>13}{'read Mev/s':>12}\n")
    with tempfile.TemporaryDirectory() as folder:
        for suffix in SUFFIXES:
            path = Path(folder) / f"scene.{suffix}"
            writes, reads = [], []
            for _ in range(args.repeats):
                started = time.perf_counter()
                write_events(path, e)
                writes.append(time.perf_counter() - started)
                started = time.perf_counter()
                with open_events(path, width=e.width, height=e.height) as reader:
                    if sum(map(len, reader)) != len(e):
                        raise SystemExit(f"{suffix}: events were lost")
                reads.append(time.perf_counter() - started)
            size = path.stat().st_size / len(e)
            rates = [len(e) / min(seconds) / 1e6 for seconds in (writes, reads)]
            sys.stdout.write(f"{suffix:6}{size:12.2f}{rates[0]:13.1f}{rates[1]:12.1f}\n")


if __name__ == "__main__":
    main()
