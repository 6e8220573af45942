"""Tabulate what a horizon buys on the built-in scene: ego and mover suppressed, zero motion, the ring needed.

    python tests/benchmarks/bench_horizons.py [--duration S] [--seed N]

True motion, gates of 1 ms and 2 px; all canceller runs see the same events; warm-up of the longest horizon left out.
"""

from __future__ import annotations

import argparse
import sys

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule
from tiegocancel.scene import SceneConfig, ground_truth, simulate

HORIZONS_US = (500, 1000, 2000, 4000, 8000, 20_000, 40_000)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--duration", type=float, default=0.4)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    scene = SceneConfig()
    events = Events.concatenate(list(simulate(scene, duration_s=args.duration, seed=args.seed)))
    trajectory = ground_truth(scene, duration_s=args.duration)
    counted = events.t >= events.t[0] + max(HORIZONS_US) + 1000
    assert events.label is not None
    ego, mover = counted & (events.label == 0), counted & (events.label == 1)
    sys.stdout.write("| horizon (ms) | ego | mover | J | ego, zero motion | ring needed |\n|---|---|---|---|---|---|\n")
    for horizon_us in HORIZONS_US:
        config = CancelConfig(horizon_us=horizon_us, ring_capacity=1 << 20)
        size = {"width": scene.width, "height": scene.height}
        true = Canceller(config, trajectory.schedule(horizon_us), **size)
        suppressed = true.process(events).suppressed
        still = Canceller(config, MotionSchedule.still(), **size).process(events).suppressed
        shares = suppressed[ego].mean(), suppressed[mover].mean()
        sys.stdout.write(
            f"| {horizon_us / 1000:g} | {shares[0]:.3f} | {shares[1]:.3f} | {shares[0] - shares[1]:.2f} "
            f"| {still[ego].mean():.3f} | {true.counters.ring_high_water:,} |\n"
        )


if __name__ == "__main__":
    main()
