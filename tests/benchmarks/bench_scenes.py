"""Tabulate the library of scenes: who makes the events, and how selective the canceller is on each.

    python tests/benchmarks/bench_scenes.py [--duration S] [--seed N] [--relative]

True motion, gates of 1 ms and 2 px, a ring that never overflows. J is the share of ego events suppressed less that of
mover events; beside it, in brackets, the same under zero motion. Warm-up of the longest horizon is left out. With
``--relative`` the second table instead: by how much a mover must outpace the print to be told from it.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from numpy.typing import NDArray

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule
from tiegocancel.events import EGO, MOVER
from tiegocancel.scene import SCENES, CameraSceneConfig, SceneConfig, scene_named, simulate, true_motion

HORIZONS_US = (8000, 20_000, 40_000)
RELATIVE_PX_S = (0.0, 12.5, 25.0, 37.5, 50.0, 62.5, 75.0, 100.0, 150.0, 200.0, 400.0)
GATE_PX = 2.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--duration", type=float, default=0.25)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--relative", action="store_true")
    args = parser.parse_args()
    (_relative if args.relative else _library)(args.duration, args.seed)


def _library(duration_s: float, seed: int) -> None:
    """Print a line a scene."""
    heads = " | ".join(f"J {horizon_us // 1000} ms" for horizon_us in HORIZONS_US)
    sys.stdout.write(f"| scene | Mev/s | ego | mover | noise | {heads} | ego, mover {HORIZONS_US[-1] // 1000} ms |\n")
    sys.stdout.write("|---|---|---|---|---|" + "---|" * (len(HORIZONS_US) + 1) + "\n")
    for name in SCENES:
        scene = scene_named(name)
        events = _recorded(scene, duration_s, seed)
        shares = np.bincount(np.asarray(events.label), minlength=3) / len(events)
        cells = [f"{len(events) / duration_s / 1e6:.2f}", *(f"{share:.1%}" for share in shares)]
        pair = 0.0, 0.0
        for horizon_us in HORIZONS_US:
            pair = _shares(events, _suppressed(events, scene, horizon_us, duration_s))
            still = _shares(events, _suppressed(events, scene, horizon_us, duration_s, moves=False))
            cells.append(f"{pair[0] - pair[1]:.2f} ({still[0] - still[1]:.2f})")
        cells.append(f"{pair[0]:.3f}, {pair[1]:.3f}")
        sys.stdout.write(f"| {name} | {' | '.join(cells)} |\n")
        sys.stdout.flush()


def _relative(duration_s: float, seed: int) -> None:
    """Print a line a relative speed: a hand that rides on the disc alone, so that every mover event is its own."""
    horizons = " | ".join(f"mover {horizon_us // 1000} ms | px / gate" for horizon_us in HORIZONS_US)
    sys.stdout.write(f"| relative (px/s) | events of the hand | {horizons} |\n")
    sys.stdout.write("|---|---|" + "---|---|" * len(HORIZONS_US) + "\n")
    for relative_px_s in RELATIVE_PX_S:
        table = {"companion": {"relative_px_s": relative_px_s}, "mover": {"enabled": False}}
        scene = scene_named("two-movers", table)
        events = _recorded(scene, duration_s, seed)
        cells = [f"{np.count_nonzero(np.asarray(events.label) == MOVER):,}"]
        for horizon_us in HORIZONS_US:
            _, lost = _shares(events, _suppressed(events, scene, horizon_us, duration_s))
            cells += [f"{lost:.3f}", f"{relative_px_s * horizon_us * 1e-6 / GATE_PX:.2f}"]
        sys.stdout.write(f"| {relative_px_s:g} | {' | '.join(cells)} |\n")
        sys.stdout.flush()


def _recorded(scene: SceneConfig | CameraSceneConfig, duration_s: float, seed: int) -> Events:
    return Events.concatenate(list(simulate(scene, duration_s=duration_s, seed=seed)))


def _suppressed(
    events: Events, scene: SceneConfig | CameraSceneConfig, horizon_us: int, duration_s: float, *, moves: bool = True
) -> NDArray[np.bool_]:
    config = CancelConfig(horizon_us=horizon_us, tolerance_us=1000, tolerance_px=GATE_PX, ring_capacity=1 << 21)
    motion = true_motion(scene, duration_s=duration_s)
    span = {"start_us": 0, "stop_us": round(duration_s * 1e6)}
    schedule = motion.schedule(horizon_us, **span) if moves else MotionSchedule.still()
    return Canceller(config, schedule, width=scene.width, height=scene.height).process(events).suppressed


def _shares(events: Events, suppressed: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the shares of ego and of mover events that are suppressed, after the warm-up."""
    counted = events.t >= events.t[0] + HORIZONS_US[-1] + 1000
    ego, mover = (float(suppressed[counted & (events.label == label)].mean()) for label in (EGO, MOVER))
    return ego, mover


if __name__ == "__main__":
    main()
