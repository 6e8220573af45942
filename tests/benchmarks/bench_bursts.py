"""Measure what a cell should be where one edge fires several events a pixel: counts, latches, depth, refreshing.

    python tests/benchmarks/bench_bursts.py [--data FOLDER]

The built-in disc (2 % ripple of its speed, 8 ms, 1 ms, 2 px) and, where FOLDER holds it, the real spinning dot (8 ms,
0.3 ms, 2 px). One horizon, no support, true motion. ``bits``: of a cell, stamps as ``firmware_sim.state`` sizes them.
The prototype in ``bursts.c`` is held to ``Canceller`` to the event for every form that the canceller has.
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.state import state_bits

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule, read_events
from tiegocancel.events import EGO, MOVER
from tiegocancel.scene import SceneConfig, scene_named, simulate, true_motion

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data"
DOT = "spinning_dot_evt2.raw"
HORIZON_US = 8000


@dataclass(frozen=True, kw_only=True)
class Cell:
    """What a cell is: ``uses`` as ``CancelConfig`` has them, predictions deep, refreshed by hits."""

    uses: int = 1
    depth: int = 1
    refresh: bool = False

    def bits(self, tolerance_us: int) -> int:
        """Return the bits of a pixel."""
        config = CancelConfig(horizon_us=HORIZON_US, tolerance_us=tolerance_us, uses=0)
        uses = (self.uses - 1).bit_length() if self.uses else 0
        return self.depth * state_bits(config, width=8, height=8).cell + uses


FORMS = {
    "one-deep, one hit": Cell(),
    "count of 2 bits": Cell(uses=4),
    "count of 3 bits": Cell(uses=8),
    "count of 4 bits": Cell(uses=15),
    "latched": Cell(uses=0),
    "two-deep": Cell(depth=2),
    "four-deep": Cell(depth=4),
    "refreshed by its hits": Cell(refresh=True),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=FOLDER)
    data = parser.parse_args().data
    scene = scene_named("disc", {"rig": {"ripple": 0.02, "ripple_hz": 2.0}})
    assert isinstance(scene, SceneConfig)
    disc = Events.concatenate(list(simulate(scene, duration_s=0.2, seed=1)))
    disc_motion = true_motion(scene, duration_s=0.2).schedule(HORIZON_US)
    dot, dot_motion = None, MotionSchedule.still()
    if (data / DOT).exists():
        dot = read_events(data / DOT)
        dot_motion = MotionSchedule.rotation(center_px=(314.4, 202.5), omega_rad_s=121.8, horizon_us=HORIZON_US)
    sys.stdout.write("| cell | bits | ego | mover | J | ego, zero motion | bits | dot | dot, zero motion | gap |\n|")
    sys.stdout.write("---|" * 10 + "\n")
    for name, cell in FORMS.items():
        ego, mover = _shares(disc, _decided(disc, disc_motion, cell, 1000))
        still, _ = _shares(disc, _decided(disc, MotionSchedule.still(), cell, 1000))
        line = f"| {name} | {cell.bits(1000)} | {ego:.3f} | {mover:.3f} | **{ego - mover:.3f}** | {still:.3f} "
        if dot is None:
            sys.stdout.write(line + "| – | – | – | – |\n")
            continue
        counted = dot.t >= int(dot.t[0]) + HORIZON_US + 300
        own, rest = (
            float(_decided(dot, motion, cell, 300)[counted].mean()) for motion in (dot_motion, MotionSchedule.still())
        )
        sys.stdout.write(f"{line}| {cell.bits(300)} | {own:.3f} | {rest:.3f} | **{own - rest:.3f}** |\n")
        sys.stdout.flush()


def _shares(events: Events, suppressed: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the shares of ego and of mover events that are suppressed, after 40 ms."""
    counted = events.t >= int(events.t[0]) + 40_000
    ego, mover = (float(suppressed[counted & (events.label == label)].mean()) for label in (EGO, MOVER))
    return ego, mover


def _decided(events: Events, motion: MotionSchedule, cell: Cell, tolerance_us: int) -> NDArray[np.bool_]:
    """Decide a stream with the prototype; where the canceller has the form, it must decide the same."""
    config = CancelConfig(
        horizon_us=HORIZON_US, tolerance_us=tolerance_us, tolerance_px=2.0, uses=cell.uses, ring_capacity=1 << 18
    )
    suppressed = _prototype(events, motion, cell, config)
    if cell.depth == 1 and not cell.refresh:
        canceller = Canceller(config, motion, width=events.width, height=events.height, track_source=False)
        if not np.array_equal(canceller.process(events).suppressed, suppressed):
            raise AssertionError(f"the prototype and the canceller differ for {cell}")
    return suppressed


def _prototype(events: Events, motion: MotionSchedule, cell: Cell, config: CancelConfig) -> NDArray[np.bool_]:
    to_x, to_y = motion.predict(events.t, events.x, events.y, HORIZON_US)
    cells = events.width * events.height * cell.depth
    suppressed = np.zeros(len(events), np.uint8)
    offsets = np.array(config.offsets, np.int64)
    arrays = (
        offsets,
        events.t,
        events.x.astype(np.int32),
        events.y.astype(np.int32),
        events.p,
        np.clip(to_x, -1, events.width).astype(np.int32),
        np.clip(to_y, -1, events.height).astype(np.int32),
        np.zeros(cells, np.int64),
        np.zeros(cells, np.uint8),
        np.zeros(cells, np.uint8),
        suppressed,
    )
    numbers = (
        len(events), events.width, events.height, HORIZON_US, config.tolerance_us, cell.depth, cell.uses,
        int(cell.refresh), len(offsets),
    )  # fmt: skip
    _library().bursts(*map(ctypes.c_int64, numbers), *(array.ctypes.data_as(ctypes.c_void_p) for array in arrays))
    return suppressed.view(np.bool_)


@cache
def _library() -> ctypes.CDLL:
    """Compile the prototype once."""
    source, built = Path(__file__).with_name("bursts.c"), Path(tempfile.mkdtemp()) / "bursts.so"
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", str(built), str(source)], check=True)
    return ctypes.CDLL(str(built))


if __name__ == "__main__":
    main()
