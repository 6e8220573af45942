"""Time the thesis's sweep of 525 combinations, and the reference beside the streaming canceller, in one run.

    python tests/benchmarks/bench_sweep.py [--events N] [--reference N]

Events of the built-in disc, true motion. The sweep runs the batched kernel over all of ``--events``; the reference
(Algorithm 1 as printed, and the symmetric gate of eq. 4.4) and ``Canceller.process`` run at Δt = 2 ms on the first
``--reference`` of them. Combinations × events per second, wall and CPU time, because machines are shared.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable

from tiegocancel import CancelConfig, Canceller, Events
from tiegocancel.matching.many import cancel_many
from tiegocancel.matching.reference import ReferenceConfig, run_reference
from tiegocancel.scene import SceneConfig, ground_truth, simulate
from tiegocancel.study.thesis.settings import GridSettings

LAUNCH = 64  # combinations whose decisions are in memory at a time


def timed(work: Callable[[], object], repeats: int = 1) -> tuple[float, float]:
    """Return wall and CPU seconds of the fastest of some runs."""
    best = (float("inf"), float("inf"))
    for _ in range(repeats):
        wall, cpu = time.perf_counter(), time.process_time()
        work()
        best = min(best, (time.perf_counter() - wall, time.process_time() - cpu))
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=1_000_000)
    parser.add_argument("--reference", type=int, default=200_000)
    args = parser.parse_args()
    scene = SceneConfig()
    parts: list[Events] = []
    for chunk in simulate(scene, duration_s=10.0, seed=1):
        parts.append(chunk)
        if sum(map(len, parts)) >= args.events:
            break
    events = Events.concatenate(parts)[: args.events]
    motion = ground_truth(scene, duration_s=10.0)
    grid = GridSettings()
    points = [
        (CancelConfig(horizon_us=h, tolerance_px=px, tolerance_us=t), motion.schedule(h))
        for h in grid.horizons_us
        for px in grid.tolerances_px
        for t in grid.tolerances_us
    ]
    cancel_many(events[:100], points[:1])  # compile

    def sweep() -> None:
        for first in range(0, len(points), LAUNCH):
            cancel_many(events, points[first : first + LAUNCH])

    wall, cpu = timed(sweep)
    work = len(points) * len(events)
    sys.stdout.write(
        f"{len(points)} combinations × {len(events):,} events: {wall:.1f} s wall, {cpu:.1f} s CPU; "
        f"{work / wall / 1e6:.1f} M combinations × events per second ({work / cpu / 1e6:.1f} per CPU second)\n"
    )
    some = events[: args.reference]
    config = CancelConfig(horizon_us=2000, ring_capacity=1 << 18)
    schedule = motion.schedule(2000)
    Canceller(config, schedule, width=scene.width, height=scene.height).prepare()
    rows: dict[str, Callable[[], object]] = {
        "streaming canceller": lambda: Canceller(config, schedule, width=scene.width, height=scene.height).process(
            some
        ),
        "Algorithm 1 as printed": lambda: run_reference(some, motion, ReferenceConfig()),
        "symmetric gate, own off": lambda: run_reference(
            some, motion, ReferenceConfig(allow_self_match=False, release="closed", gate="pair")
        ),
    }
    rates = {name: len(some) / timed(work, repeats=3)[1] / 1e6 for name, work in rows.items()}
    for name, rate in rates.items():
        ratio = rates["streaming canceller"] / rate
        sys.stdout.write(f"{name:24} {rate:8.2f} Mev/s of CPU time, canceller ×{ratio:.1f}\n")


if __name__ == "__main__":
    main()
