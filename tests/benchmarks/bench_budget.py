"""Judge every part on the built-in disc at four sensor sizes, and time the simulator itself.

Run by hand: ``python tests/benchmarks/bench_budget.py [--quick]``. The operating point is a preset that fits the speed
of the scene, the same for every part of a size; verdicts and the simulator's pace come from one run.
"""

from __future__ import annotations

import argparse
import sys
import time

from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.core.simulator import CoreSimulator
from tiegocancel.firmware_sim.jit import is_compiled
from tiegocancel.firmware_sim.target import load_target, target_names

from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.presets import preset_table
from tiegocancel.scene import SceneConfig, ground_truth, simulate
from tiegocancel.study.budget.ground import Ground, gather
from tiegocancel.study.budget.judge import Judged, judge_target
from tiegocancel.study.budget.settings import BudgetSettings
from tiegocancel.study.feed import FixedMotion

SIZES = {(1280, 720): 0.1, (640, 480): 0.15, (320, 240): 0.4, (128, 128): 0.6}
"""Sensor size in px and seconds of the scene: longer where it is slow, for the warm-up."""

# A ring for what the scene holds at its rate, and a table in sets for what is open at once; a small sensor is slow.
RINGS = {(1280, 720): 49_152, (640, 480): 16_384, (320, 240): 5_120, (128, 128): 1_024}
SETS = {(1280, 720): (6, 5), (640, 480): (5, 4), (320, 240): (4, 4), (128, 128): (3, 3)}
SLOWER = {(1280, 720): 1, (640, 480): 2, (320, 240): 4, (128, 128): 8}
"""Times of the preset are multiplied by this: edges of a smaller disc run so many times slower."""


def configured(size: tuple[int, int]) -> CancelConfig:
    table = {**preset_table("selective", "bench"), "ring_capacity": RINGS[size], "set_bits": SETS[size]}
    for name in ("horizon_us", "early_us", "late_us"):
        table[name] *= SLOWER[size]
    return CancelConfig(**table)


def ground_of(size: tuple[int, int], seconds: float) -> Ground:
    scene = SceneConfig(width=size[0], height=size[1])
    feed = FixedMotion(ground_truth(scene, duration_s=seconds))
    found = gather(simulate(scene, duration_s=seconds, seed=1), feed, most=10**7, step_us=1000)
    assert found is not None
    return found


def row(one: Judged) -> str:
    verdict, outcome = one.verdict, one.verdict.outcome
    word = "**yes**" if verdict.passes else ("fits" if verdict.fits else "no")
    margin = "none" if verdict.binding.margin < -9.99 else f"{verdict.binding.margin:+.0%}"
    rate = "–" if outcome is None else f"{outcome.max_events_per_second * 1e-6:.2f}"
    latency = "–" if outcome is None else f"{outcome.latency_ns.p99 * 1e-3:.1f}"
    change = one.changes[0].name if one.changes else ""
    return f"| {verdict.target} | {word} | {verdict.binding.name} {margin} | {rate} | {latency} | {change} |"


def share(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def pace(ground: Ground, cancel: CancelConfig) -> float:
    """Return events a minute of the event-driven simulator, compiled before."""
    events, motion = ground.events, ground.motion(cancel)
    for count in (1000, len(events)):
        core = CoreSimulator(CoreConfig(), cancel, motion, width=events.width, height=events.height, saturated=True)
        began = time.process_time()
        core.process(events[:count])
        taken = time.process_time() - began
    return len(events) / taken * 60.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="no changes, three parts")
    quick = parser.parse_args().quick
    names = ("ecp5-45f", "ice40up5k", "rp2040") if quick else target_names()
    for size, seconds in SIZES.items():
        ground, cancel = ground_of(size, seconds), configured(size)
        rate = len(ground.events) / seconds
        judged = [
            judge_target(ground, load_target(name), cancel, CoreConfig(), BudgetSettings(changes=not quick))
            for name in names
        ]
        ideal = judged[0].ideal
        sys.stdout.write(
            f"\n{size[0]}×{size[1]}: {rate * 1e-3:,.0f} kev/s, ego {share(ideal.ego)}, mover "
            f"{share(ideal.mover)} without limits; {pace(ground, cancel) * 1e-6:.1f} M events a minute "
            f"simulated ({'compiled' if is_compiled() else 'plain Python'})\n\n"
            "| part | passes | binding | sustains (Mev/s) | p99 (µs) | smallest change |\n|---|---|---|---|---|---|\n"
        )
        for one in judged:
            assert one.equal is not False, one.verdict.target
            sys.stdout.write(row(one) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
