"""Measure what a motion that is wrong, missing or rest costs, and how soon suppression stops.

    python tests/benchmarks/bench_fail_open.py [--seed N] [--loss]

The built-in disc with its mover; the motion is right until 125 ms and faulty for 100 ms from then on, so that the
fault's beginning and its end are both seen. ``mover lost``: share of the mover's events suppressed in those 100 ms.
``stops``: from the beginning of the fault until the last millisecond in which more than 1 % of the events are
suppressed, whatever was predicted before it included; ``–`` where there is none, ``never`` where the fault ends first.
``resumes``: from the fault's end until a millisecond suppresses half of what the last ones before the fault did.
With ``--loss`` the second table instead: ego and mover suppressed behind a guard with ``max_loss``, true motion, preset
``selective`` that needs no support of its own.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule
from tiegocancel.events import EGO, MOVER
from tiegocancel.matching.presets import PRESETS
from tiegocancel.matching.selective import Schedules
from tiegocancel.scene import SceneConfig, scene_named, simulate, true_motion
from tiegocancel.study.guard import Guard, GuardConfig

DURATION_S, FAULT_US, FAULT_SPAN_US, HOLD_US = 0.35, 125_000, 100_000, 30_000
BIN_US = 1000
LOSSES = (1.0, 0.1, 0.05, 0.03)
FAULTS = ("wrong sign", "half the speed", "taken for rest", f"dropped, held for {HOLD_US // 1000} ms")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--loss", action="store_true")
    args = parser.parse_args()
    (_losses if args.loss else _faults)(args.seed)


def _losses(seed: int) -> None:
    """Print a line a bound, a column a scene."""
    config = replace(_config(PRESETS["selective"]), need=1)
    names = ("disc", "noisy", "pan", "two-movers")
    columns = []
    for name in names:
        scene = scene_named(name)
        events = Events.concatenate(list(simulate(scene, duration_s=0.25, seed=seed)))
        motion = (true_motion(scene, duration_s=0.25).schedule(config.horizon_us),)
        size = {"width": events.width, "height": events.height}
        decisions = Canceller(config, motion, **size, track_source=False).process(events)
        counted = events.t >= int(events.t[0]) + 80_000
        fields = []
        for max_loss in LOSSES:
            guard = Guard(GuardConfig(enabled=True, max_loss=max_loss), config, **size)
            suppressed = guard.process(events, decisions.suppressed, decisions.support)
            fields.append(", ".join(f"{suppressed[counted & (events.label == k)].mean():.3f}" for k in (EGO, MOVER)))
        columns.append(fields)
    sys.stdout.write(f"| `L` | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}\n")
    for max_loss, *row in zip(LOSSES, *columns, strict=True):
        sys.stdout.write(f"| {max_loss:g} | {' | '.join(row)} |\n")


def _faults(seed: int) -> None:
    """Print a line a fault, a preset and a guard."""
    turning, resting = (
        Events.concatenate(list(simulate(scene, duration_s=DURATION_S, seed=seed)))
        for scene in (_disc(), replace(_disc(), rig=replace(_disc().rig, omega_rad_s=0.0)))
    )
    sys.stdout.write("| fault | preset | guard | ego suppressed | mover lost | stops (ms) | resumes (ms) |\n|")
    sys.stdout.write("---|" * 7 + "\n")
    for preset in ("plain", "selective", "two-speed"):
        config = _config(PRESETS[preset])
        for guard in (False, True):
            for fault in FAULTS:
                suppressed = _suppressed(turning, config, _schedules(config, fault), guard=guard)
                _row(fault, preset, guard, turning, suppressed)
            for name, schedules in (
                ("at rest, known", (MotionSchedule.still(),)),
                ("at rest, told to turn", _schedules(config, "none")),
            ):
                suppressed = _suppressed(resting, config, schedules, guard=guard)
                _row(name, preset, guard, resting, suppressed)


def _disc() -> SceneConfig:
    scene = scene_named("disc")
    assert isinstance(scene, SceneConfig)
    return scene


def _config(table: dict[str, Any]) -> CancelConfig:
    return CancelConfig(**{name: tuple(value) if isinstance(value, list) else value for name, value in table.items()})


def _schedules(config: CancelConfig, fault: str) -> Schedules:
    """Return the disc's motion with a fault in it."""
    rig, end_us = _disc().rig, FAULT_US + FAULT_SPAN_US
    schedules = []
    for horizon_us in config.horizons_us:
        right, slow, back = (
            MotionSchedule.rotation(
                center_px=rig.center_px, omega_rad_s=factor * rig.omega_rad_s, horizon_us=horizon_us
            )
            for factor in (1.0, 0.5, -1.0)
        )
        faulty, from_us = {
            "none": (right, FAULT_US),
            "wrong sign": (back, FAULT_US),
            "half the speed": (slow, FAULT_US),
            "taken for rest": (MotionSchedule.still(), FAULT_US),
            FAULTS[-1]: (MotionSchedule.unknown(), FAULT_US + HOLD_US),
        }[fault]
        rows = [part.coefficients[0] for part in (right, faulty, right)]
        schedules.append(MotionSchedule(np.array([0, from_us, end_us]), np.array(rows), horizon_us))
    return tuple(schedules)


def _suppressed(events: Events, config: CancelConfig, motion: Schedules, *, guard: bool) -> NDArray[np.bool_]:
    """Decide the stream, behind the guard where it is asked for."""
    if len(motion) == 1:
        motion = motion * len(config.horizons_us)
    size = {"width": events.width, "height": events.height}
    hits = Canceller(config, motion, **size, track_source=False).process(events).suppressed
    return Guard(GuardConfig(enabled=True), config, **size).process(events, hits) if guard else hits


def _row(fault: str, preset: str, guard: bool, events: Events, suppressed: NDArray[np.bool_]) -> None:
    """Print one line of the table."""
    start_us = FAULT_US + (HOLD_US if fault == FAULTS[-1] else 0)
    end_us = FAULT_US + FAULT_SPAN_US
    inside = (events.t >= FAULT_US) & (events.t < end_us)
    ego, mover = (
        f"{suppressed[chosen].mean():.3f}" if chosen.any() else "–"
        for chosen in (inside & (events.label == label) for label in (EGO, MOVER))
    )
    bins = np.arange(0, round(DURATION_S * 1e6) + 1, BIN_US)
    all_in, hit_in = (np.histogram(events.t[mask], bins)[0] for mask in (np.ones(len(events), bool), suppressed))
    share = hit_in / np.maximum(all_in, 1)
    first, last = FAULT_US // BIN_US, end_us // BIN_US
    active = np.flatnonzero(share[first:last] > 0.01)
    stops = "–"
    if len(active):
        stops_us = FAULT_US + (int(active[-1]) + 1) * BIN_US - start_us
        stops = "never" if active[-1] == last - first - 1 else f"{stops_us / 1000:.0f}"
    before = float(share[first - 20 : first].mean())
    back = np.flatnonzero(share[last:] >= 0.5 * before)
    resumes = f"{int(back[0])}" if len(back) and before > 0.01 else "–"
    sys.stdout.write(f"| {fault} | {preset} | {'yes' if guard else 'no'} | {ego} | {mover} | {stops} | {resumes} |\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
