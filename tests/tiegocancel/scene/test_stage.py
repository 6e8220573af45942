"""Check that no pixel changes unseen: what is rendered is all that moves."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.scene import MoverConfig, RigConfig, SceneConfig
from tiegocancel.scene.stage import Stage


@pytest.mark.parametrize("phase_rad", [0.0, 1.6, 2.3, 3.1, 4.7])
@pytest.mark.parametrize("omega_rad_s", [0.0, 3.6])
def test_every_pixel_that_changes_is_listed(phase_rad, omega_rad_s):
    mover, rig = MoverConfig(phase_rad=phase_rad), RigConfig(omega_rad_s=omega_rad_s)
    stage = Stage(SceneConfig(width=320, height=180, mover=mover, rig=rig))
    time_s = np.linspace(0.2, 0.225, 26)
    everywhere = np.arange(320 * 180, dtype=np.int32)
    levels, covered = stage.look(everywhere, time_s)
    changed = np.flatnonzero((np.ptp(levels, axis=1) > 0) | covered.any(axis=1))
    listed = stage.changing(time_s)
    assert len(changed) > 100
    assert set(changed.tolist()) <= set(listed.tolist())
    assert (np.diff(listed) > 0).all()


def test_flickering_light_changes_every_pixel():
    stage = Stage(SceneConfig(width=64, height=48, flicker_depth=0.1))
    assert len(stage.changing(np.array([0.0, 0.001]))) == 64 * 48


def test_one_pixel_looks_the_same_alone_and_among_others():
    stage = Stage(SceneConfig(width=320, height=180))
    time_s = np.linspace(0.0, 0.02, 5)
    everywhere = np.arange(320 * 180, dtype=np.int32)
    levels, covered = stage.look(everywhere, time_s)
    few = everywhere[5000::3111].copy()
    alone, alone_covered = stage.look(few, time_s)
    np.testing.assert_array_equal(alone, levels[few])
    np.testing.assert_array_equal(alone_covered, covered[few])
