"""Measure the tracked motion of the built-in disc against its true one, and what following it costs in cancellation.

Run by hand: ``python tests/benchmarks/bench_tracking.py``. Rows of the first 0.1 s, while the motion is being acquired,
are left out, and so are their events. Windows are 20 ms, rows 10 ms apart, each made of earlier events alone.
"""

from __future__ import annotations

import sys

import numpy as np

from tiegocancel.estimation.contrast.track import RotationTracker, TrackConfig
from tiegocancel.estimation.estimate import trajectory_of
from tiegocancel.events import EGO, Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.trajectory import Trajectory
from tiegocancel.scene import SceneConfig, ground_truth, simulate
from tiegocancel.scene.mover import MoverConfig
from tiegocancel.scene.rig import RigConfig

DURATION_S, ACQUIRED_US, HORIZON_US = 0.8, 100_000, 40_000
CASES = {
    "constant, no mover": (RigConfig(), MoverConfig(enabled=False)),
    "constant, a mover (5 % of the events)": (RigConfig(), MoverConfig()),
    "2 % ripple at 2 Hz, a mover": (RigConfig(ripple=0.02), MoverConfig()),
    "ramp of 4 rad/s², a mover": (RigConfig(ramp_rad_s2=4.0), MoverConfig()),
    "centre wobbles by 3 px at 2 Hz, a mover": (RigConfig(wobble_px=(3.0, 3.0), wobble_hz=2.0), MoverConfig()),
    "centre wobbles by 10 px at 2 Hz, a mover": (RigConfig(wobble_px=(10.0, 10.0), wobble_hz=2.0), MoverConfig()),
    "stop-and-go at 2 Hz, a mover": (RigConfig(stop_go_hz=2.0), MoverConfig()),
}


def main() -> None:
    """Print one Markdown row a case."""
    sys.stdout.write(
        "| motion | rows in use | error of ω, median / 95 % | error of the centre, median / 95 % (px) "
        "| ego suppressed at 40 ms: truth | tracked | loss (points) |\n|---|---|---|---|---|---|---|\n"
    )
    for name, (rig, mover) in CASES.items():
        scene = SceneConfig(rig=rig, mover=mover)
        events = Events.concatenate(list(simulate(scene, duration_s=DURATION_S, seed=1)))
        truth = ground_truth(scene, duration_s=DURATION_S)
        rows = RotationTracker(TrackConfig(), width=events.width, height=events.height).process(events)
        sure = [row for row in rows if row.confident and row.t_us > ACQUIRED_US]
        late = sum(row.t_us > ACQUIRED_US for row in rows)
        cx, cy, omega = truth.at(np.array([row.t_us for row in sure], np.int64))
        share = np.abs(np.array([row.omega_rad_s for row in sure]) - omega) / np.maximum(np.abs(omega), 0.05)
        centers = np.array([row.center_px for row in sure])
        away = np.hypot(centers[:, 0] - cx, centers[:, 1] - cy)
        kept = [suppressed(events, motion) for motion in (truth, trajectory_of(rows, source="track"))]
        sys.stdout.write(
            f"| {name} | {len(sure)} of {late} | {np.median(share):.2%} / {np.percentile(share, 95):.2%} "
            f"| {np.median(away):.2f} / {np.percentile(away, 95):.2f} "
            f"| {kept[0]:.1%} | {kept[1]:.1%} | {100 * (kept[0] - kept[1]):.2f} |\n"
        )


def suppressed(events: Events, motion: Trajectory) -> float:
    """Return the share of ego events that are suppressed under a motion, at gates of 1 ms and 2 px."""
    config = CancelConfig(horizon_us=HORIZON_US, tolerance_us=1000, tolerance_px=2.0, ring_capacity=1 << 18)
    schedule = motion.schedule(HORIZON_US)
    canceller = Canceller(config, schedule, width=events.width, height=events.height, track_source=False)
    counted = (events.label == EGO) & (events.t > ACQUIRED_US)
    return float(canceller.process(events).suppressed[counted].mean())


if __name__ == "__main__":
    main()
