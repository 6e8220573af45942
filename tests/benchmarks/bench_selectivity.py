"""Measure the canceller's presets on every scene of the library: what is kept of the movers, at which state.

Run by hand: ``python tests/benchmarks/bench_selectivity.py [--duration S]``. True motion; the first 80 ms are left out.
"""

from __future__ import annotations

import argparse
import sys

from tiegocancel.firmware_sim.state import state_bits

from tiegocancel.events import EGO, MOVER, Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.presets import PRESETS
from tiegocancel.matching.selective import Schedules
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.scene import simulate, true_motion
from tiegocancel.scene.library import SCENES, scene_named

SKIPPED_US = 80_000
POINTS = {"thesis, 1 ms": {"horizon_us": 1000}, **PRESETS}


def main() -> None:
    """Print one Markdown table: a row a scene, a column a preset."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--duration", type=float, default=0.25, metavar="S")
    duration_s = arguments.parse_args().duration
    sys.stdout.write(f"| scene | {' | '.join(POINTS)} |\n|{'---|' * (len(POINTS) + 1)}\n")
    for name in SCENES:
        scene = scene_named(name)
        events = Events.concatenate(list(simulate(scene, duration_s=duration_s, seed=1)))
        motion = true_motion(scene, duration_s=duration_s)
        cells = []
        for table in POINTS.values():
            config = CancelConfig(**{key: _tupled(value) for key, value in table.items()})
            schedules = tuple(motion.schedule(horizon_us) for horizon_us in config.horizons_us)
            ego, mover = shares(events, config, schedules)
            # Under a least shift zero motion would predict nothing, and the control would be 0 by construction.
            still, _ = shares(events, config.without_motion(), MotionSchedule.still())
            kib = state_bits(config, width=events.width, height=events.height).total_kib
            cells.append(f"{ego:.3f}, {mover:.3f}: **{ego - mover:.2f}** ({still:.2f}; {kib:,.0f})")
        sys.stdout.write(f"| {name} | {' | '.join(cells)} |\n")
        sys.stdout.flush()


def shares(events: Events, config: CancelConfig, motion: MotionSchedule | Schedules) -> tuple[float, float]:
    """Return the shares of ego and of mover events that are suppressed."""
    canceller = Canceller(config, motion, width=events.width, height=events.height, track_source=False)
    suppressed = canceller.process(events).suppressed
    counted = events.t >= int(events.t[0]) + SKIPPED_US
    ego, mover = (float(suppressed[counted & (events.label == label)].mean()) for label in (EGO, MOVER))
    return ego, mover


def _tupled(value: object) -> object:
    """Return a list of a TOML table as the tuple that the configuration holds."""
    return tuple(value) if isinstance(value, list) else value


if __name__ == "__main__":
    main()
