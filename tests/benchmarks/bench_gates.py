"""Measure what each gate beyond the preset ``selective`` buys, and at which state.

    python tests/benchmarks/bench_gates.py [--duration S] [--scenes NAME ...]

True motion; the first 80 ms are left out; every ring holds the most that it ever held, and a quarter more. Each field:
J (ego suppressed, mover suppressed, ego under zero motion; KiB). The last column is the disc seen by a sensor whose
OFF events come less surely: threshold 0.4 instead of 0.23, and 1.5 ms of jitter (one deviation) on top.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from typing import Any

import numpy as np
from tiegocancel.firmware_sim.state import state_bits

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule
from tiegocancel.events import EGO, MOVER
from tiegocancel.matching.presets import PRESETS
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.trajectory import Trajectory
from tiegocancel.scene import SceneConfig, SensorConfig, scene_named, simulate, true_motion

SKIPPED_US, HEADROOM = 80_000, 1.25
UNEVEN = "disc, uneven sensor"
_NARROW, _WIDE = 1536, 4096
VARIANTS: dict[str, dict[str, Any]] = {
    "selective": {},
    "one horizon, 8.2 ms": {"horizon_us": 8192},
    "choose 4 px of 6.1, 12.3 ms": {"horizon_us": 6144, "more_horizons_us": (12_288,), "choose_px": 4.0},
    "choose 4 px of 4.1, 8.2, 16.4 ms": {"horizon_us": 4096, "more_horizons_us": (8192, 16_384), "choose_px": 4.0},
    "2 px": {"tolerance_px": 2.0},
    "spread 1 px + 1.3 ms, to 2 px": {"tolerance_px": 2.0, "spread_px": 1.0, "spread_us": 1300},
    "spread 0.5 px + 1 ms, to 2 px": {"tolerance_px": 2.0, "spread_px": 0.5, "spread_us": 1000},
    "line 1.5 px": {"line_px": 1.5},
    "line 1 px": {"line_px": 1.0},
    "line 0.75 px": {"line_px": 0.75},
    "line 0.75 px, 1 bit": {"line_px": 0.75, "fraction_bits": 1},
    "line 0.75 px, 2 bits": {"line_px": 0.75, "fraction_bits": 2},
    "line 0.75 px, 3 bits": {"line_px": 0.75, "fraction_bits": 3},
    "±1.5 ms": {"early_us": _NARROW, "late_us": _NARROW},
    "±4.1 ms": {"early_us": _WIDE, "late_us": _WIDE},
    "−1.5, +4.1 ms": {"early_us": _NARROW, "late_us": _WIDE},
    "−2.6, +4.1 ms": {"late_us": _WIDE},
    "−2.6, ON +2.6, OFF +4.1 ms": {"off_late_us": _WIDE},
    "1 px, OFF 2 px": {"off_tolerance_px": 2.0},
    "1 px, OFF 2 px and +4.1 ms": {"off_tolerance_px": 2.0, "off_late_us": _WIDE},
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--duration", type=float, default=0.25, metavar="S")
    parser.add_argument("--scenes", nargs="+", default=["disc", "noisy", "pan", "two-movers", "stop-and-go", UNEVEN])
    args = parser.parse_args()
    grounds = [_ground(name, args.duration) for name in args.scenes]
    sys.stdout.write(f"| gates | {' | '.join(args.scenes)} |\n|{'---|' * (len(grounds) + 1)}\n")
    base = {name: tuple(value) if isinstance(value, list) else value for name, value in PRESETS["selective"].items()}
    for name, changes in VARIANTS.items():
        config = CancelConfig(**{**base, **changes, "ring_capacity": 1 << 18})
        fields = [_field(events, config, motion) for events, motion in grounds]
        sys.stdout.write(f"| {name} | {' | '.join(fields)} |\n")
        sys.stdout.flush()


def _ground(name: str, duration_s: float) -> tuple[Events, Trajectory]:
    """Return a scene's events and its motion."""
    scene = scene_named("disc" if name == UNEVEN else name)
    if name == UNEVEN:
        assert isinstance(scene, SceneConfig)
        scene = replace(scene, sensor=SensorConfig(threshold_off=0.4))
    events = Events.concatenate(list(simulate(scene, duration_s=duration_s, seed=1)))
    if name == UNEVEN:
        events = _jittered(events)
    return events, true_motion(scene, duration_s=duration_s)


def _jittered(events: Events) -> Events:
    """Return the events with the times of OFF spread by a normal deviation of 1.5 ms."""
    late = np.where(events.p == 0, np.random.default_rng(0).normal(0.0, 1500.0, len(events)), 0.0)
    t = np.maximum(events.t + np.rint(late).astype(np.int64), 0)
    return Events.from_unsorted(t, events.x, events.y, events.p, events.width, events.height, events.label)[0]


def _field(events: Events, config: CancelConfig, motion: Trajectory) -> str:
    schedules = tuple(motion.schedule(horizon_us) for horizon_us in config.horizons_us)
    ego, mover, held = _shares(events, config, schedules)
    still, _, _ = _shares(events, config.without_motion(), MotionSchedule.still())
    first, *more = (max(round(HEADROOM * count), 1) for count in held)
    sized = replace(config, ring_capacity=first, more_ring_capacities=tuple(more))
    kib = state_bits(sized, width=events.width, height=events.height).total_kib
    return f"**{ego - mover:.3f}** ({ego:.3f}, {mover:.3f}, {still:.3f}; {kib:.0f})"


def _shares(
    events: Events, config: CancelConfig, motion: MotionSchedule | Schedules
) -> tuple[float, float, tuple[int, ...]]:
    """Return the shares of ego and of mover events that are suppressed, and the most that each ring held."""
    canceller = Canceller(config, motion, width=events.width, height=events.height, track_source=False)
    suppressed = canceller.process(events).suppressed
    counted = events.t >= int(events.t[0]) + SKIPPED_US
    assert events.label is not None
    ego, mover = (float(suppressed[counted & (events.label == label)].mean()) for label in (EGO, MOVER))
    return ego, mover, canceller.most_held


if __name__ == "__main__":
    main()
