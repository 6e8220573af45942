"""Check that the full-size scene is what the canceller's numbers are stated for."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.events import EGO, MOVER, NOISE, Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.scene import SceneConfig, simulate

HORIZON_US = 8000
DURATION_S = 0.12


@pytest.fixture(scope="module")
def events():
    return Events.concatenate(list(simulate(SceneConfig(), duration_s=DURATION_S, seed=2)))


def suppressed(events, omega_rad_s):
    """Return the share of ego and of mover events that are suppressed, after the first 40 ms."""
    config = CancelConfig(horizon_us=HORIZON_US, tolerance_us=1000, tolerance_px=2.0, ring_capacity=1 << 17)
    schedule = MotionSchedule.rotation(
        center_px=SceneConfig().rig.center_px, omega_rad_s=omega_rad_s, horizon_us=HORIZON_US
    )
    canceller = Canceller(config, schedule, width=events.width, height=events.height)
    hit = canceller.process(events).suppressed
    late = events.t > 40_000
    return tuple(float(hit[late & (events.label == label)].mean()) for label in (EGO, MOVER))


def test_rate_and_shares_are_those_of_the_recording(events):
    shares = np.bincount(events.label, minlength=3) / len(events)
    assert 3.2e6 < len(events) / DURATION_S < 4.2e6
    assert 0.03 < shares[MOVER] < 0.10
    assert 0.01 < shares[NOISE] < 0.03


def test_the_true_motion_cancels_the_disc_and_spares_the_mover(events):
    ego, mover = suppressed(events, 3.6)
    assert ego > 0.85
    assert mover < 0.25


@pytest.mark.parametrize("omega_rad_s", [0.0, -3.6])
def test_wrong_motion_does_not_cancel_the_disc(events, omega_rad_s):
    ego, _ = suppressed(events, omega_rad_s)
    assert ego < 0.3
