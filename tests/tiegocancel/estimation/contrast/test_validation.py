"""Validate the estimates on simulated discs whose motion is known (thesis §3.7): errors, and what they cost in CR."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from tiegocancel.estimation.contrast.refine import refine
from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.track import RotationTracker, TrackConfig
from tiegocancel.estimation.estimate import MotionEstimate, trajectory_of
from tiegocancel.events import EGO, Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.scene import MoverConfig, RigConfig, SceneConfig, ground_truth, simulate

pytestmark = pytest.mark.slow

DURATION_S = 0.5
SETTLED_US = 50_000
WINDOW_US = 20_000
HORIZON_US = 40_000

RIGS = {
    "constant": RigConfig(),
    "ramped": RigConfig(ramp_rad_s2=4.0),
    "rippled": RigConfig(ripple=0.02),
    "stop_and_go": RigConfig(stop_go_hz=2.0, stop_share=0.3),
    "wobbling": RigConfig(wobble_px=(6.0, 4.0)),
}
ROW_CENTER_PX = {"wobbling": 1.5}
"""The centre of a wobbling disc runs 27 px a second to and fro; the others' rows stay within half a px."""


@dataclass(frozen=True, slots=True)
class Case:
    """A simulated recording with its truth and the tracker's rows."""

    name: str
    events: Events
    truth: RotationTrajectory
    rows: list[MotionEstimate]

    def true_at(self, t_us: int) -> tuple[tuple[float, float], float]:
        cx, cy, omega = (float(value[0]) for value in self.truth.at(np.array([t_us])))
        return (cx, cy), omega

    def steady(self, start_us: int, stop_us: int) -> bool:
        """Tell whether the disc turns, without starting or stopping, from a little before to the end."""
        times = np.arange(start_us, stop_us + 1, 1000)
        return self.name != "stop_and_go" or bool((np.abs(self.truth.at(times)[2] - 3.6) < 1e-6).all())


@pytest.fixture(scope="module", params=[(name, mover) for name in RIGS for mover in (False, True)], ids=str)
def case(request) -> Case:
    name, mover = request.param
    config = SceneConfig(rig=RIGS[name], mover=MoverConfig(enabled=mover))
    events = Events.concatenate(list(simulate(config, duration_s=DURATION_S, seed=1)))
    tracker = RotationTracker(TrackConfig(), width=events.width, height=events.height)
    return Case(name, events, ground_truth(config, duration_s=DURATION_S), tracker.process(events))


def test_window_of_20_ms_gives_the_motion_of_its_middle(case):
    errors = []
    for start_us in range(SETTLED_US, 480_000, 2 * WINDOW_US):
        if not case.steady(start_us, start_us + WINDOW_US):
            continue
        center, omega = case.true_at(start_us + WINDOW_US // 2)
        anchor = (center[0] + 10.0, center[1] - 7.0)
        start = Twist.about((center[0] + 2.0, center[1] - 2.0), 1.05 * omega, anchor)
        fit = refine(case.events.between(start_us, start_us + WINDOW_US), start, anchor_px=anchor, signed=True)
        assert fit.converged
        off = np.hypot(*np.subtract(fit.twist.center_px(anchor), center))
        errors.append((abs(fit.twist.omega_rad_s - omega) / omega, off))
    share, apart = np.array(errors).T
    assert len(errors) >= 5
    assert share.max() < 0.002
    assert np.median(apart) < 0.2
    assert apart.max() < 0.4


def test_rows_give_the_motion_of_their_own_time(case):
    errors = []
    for row in case.rows:
        if row.t_us < SETTLED_US or not case.steady(row.t_us - 2 * WINDOW_US, row.t_us):
            continue
        center, omega = case.true_at(row.t_us)
        assert row.confident
        assert not row.doubt
        errors.append((abs(row.omega_rad_s - omega) / omega, np.hypot(*np.subtract(row.center_px, center))))
    share, apart = np.array(errors).T
    assert len(errors) >= 20
    assert np.median(share) < 0.002
    assert share.max() < 0.01
    assert np.percentile(apart, 95) < ROW_CENTER_PX.get(case.name, 0.8)


def test_causal_schedule_cancels_as_much_as_the_truth(case):
    config = CancelConfig(horizon_us=HORIZON_US, tolerance_us=1000, tolerance_px=2.0, ring_capacity=1 << 18)
    settled = case.events.t >= 100_000
    ratios = []
    for motion in (case.truth, trajectory_of(case.rows, source="track")):
        canceller = Canceller(
            config, motion.schedule(HORIZON_US), width=case.events.width, height=case.events.height, track_source=False
        )
        suppressed = canceller.process(case.events).suppressed
        assert case.events.label is not None
        ratios.append((suppressed[settled].mean(), suppressed[settled & (case.events.label == EGO)].mean()))
    (truth, truth_ego), (tracked, tracked_ego) = ratios
    assert tracked > truth - 0.006
    assert tracked_ego > truth_ego - 0.006


@pytest.mark.parametrize("mover", [False, True])
def test_stop_is_told_within_a_window_and_the_start_is_followed(mover):
    config = SceneConfig(rig=RIGS["stop_and_go"], mover=MoverConfig(enabled=mover))
    events = Events.concatenate(list(simulate(config, duration_s=0.6, seed=1)))
    truth = ground_truth(config, duration_s=0.6)
    rows = RotationTracker(TrackConfig(), width=events.width, height=events.height).process(events)
    omega = truth.at(np.array([row.t_us for row in rows]))[2]
    still = [row for k, row in enumerate(rows) if (omega[max(k - 3, 0) : k + 1] == 0.0).all()]
    assert len(still) >= 8
    assert not any(row.confident and abs(row.omega_rad_s) > 0.2 for row in still)
    go = [row for k, row in enumerate(rows) if k > 40 and (omega[k - 3 : k + 1] == 3.6).all()]
    assert len(go) >= 5
    assert all(row.confident for row in go)
    # The first of them overshoots, because it was sped up to until 30 ms ago.
    assert go[0].omega_rad_s == pytest.approx(3.6, abs=0.15)
    assert [row.omega_rad_s for row in go[1:]] == pytest.approx([3.6] * (len(go) - 1), abs=0.05)


def test_fit_of_the_real_disc(recording):
    from tiegocancel.estimation.contrast.fit import fit_rotation

    rows = np.load(recording("anu_disc_10ms.npy"))
    x, y, p, t_s, _ = rows[rows[:, 4] == 0].T
    t_us = np.round(t_s.astype(np.float64) * 1e6).astype(np.int64)
    fit = fit_rotation(Events(t_us, x.astype(int), y.astype(int), p.astype(int), 1280, 720))
    assert fit.confident
    assert fit.center_px == (pytest.approx(665.0, abs=2.0), pytest.approx(338.0, abs=2.0))
    assert fit.omega_rad_s == pytest.approx(3.61, abs=0.1)


def test_fit_of_the_real_spinning_dot(recording):
    from tiegocancel.estimation.contrast.fit import fit_rotation
    from tiegocancel.files import read_events

    fit = fit_rotation(read_events(recording("spinning_dot_evt2.raw")))
    assert fit.confident
    assert fit.center_px == pytest.approx((314.4, 202.5), abs=3.0)
    assert fit.omega_rad_s == pytest.approx(121.8, abs=1.0)
