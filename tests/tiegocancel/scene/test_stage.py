"""Check that no pixel changes unseen: what is rendered is all that moves."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.events import EGO
from tiegocancel.scene import CompanionConfig, MoverConfig, RigConfig, SceneConfig
from tiegocancel.scene.stage import Stage


@pytest.mark.parametrize("phase_rad", [0.0, 1.6, 2.3, 3.1, 4.7])
@pytest.mark.parametrize("omega_rad_s", [0.0, 3.6])
@pytest.mark.parametrize("wobble_px", [(0.0, 0.0), (8.0, 8.0), (25.0, 2.0)])
@pytest.mark.parametrize("companion", [False, True])
def test_every_pixel_that_changes_is_listed(phase_rad, omega_rad_s, wobble_px, companion):
    mover = MoverConfig(phase_rad=phase_rad)
    rig = RigConfig(omega_rad_s=omega_rad_s, wobble_px=wobble_px, wobble_hz=20.0)
    second = CompanionConfig(enabled=companion, phase_rad=phase_rad, relative_px_s=300.0)
    stage = Stage(SceneConfig(width=320, height=180, mover=mover, rig=rig, companion=second))
    time_s = np.linspace(0.2, 0.225, 26)
    everywhere = np.arange(320 * 180, dtype=np.int32)
    view = stage.look(everywhere, time_s)
    changed = np.flatnonzero((np.ptp(view.levels, axis=1) > 0) | view.covered.any(axis=1))
    listed = stage.changing(time_s)
    assert len(changed) > 100
    assert set(changed.tolist()) <= set(listed.tolist())
    assert (np.diff(listed) > 0).all()


def test_a_pixel_that_a_wobbling_disc_sweeps_belongs_to_it():
    rig = RigConfig(omega_rad_s=0.0, wobble_px=(9.0, 5.0), wobble_hz=10.0)
    stage = Stage(SceneConfig(width=320, height=180, rig=rig, mover=MoverConfig(enabled=False)))
    levels = stage.look(np.arange(320 * 180, dtype=np.int32), np.linspace(0.0, 0.1, 41)).levels
    moving = np.ptp(levels, axis=1) > 0
    assert (stage.label_clear[moving] == EGO).all()
    still = Stage(SceneConfig(width=320, height=180))
    assert np.count_nonzero(moving & (still.label_clear != EGO)) > 1000
    # Hardly more than what moves is called the disc.
    assert np.count_nonzero(stage.label_clear == EGO) < np.count_nonzero(still.label_clear == EGO) * 1.4


def test_flickering_light_changes_every_pixel():
    stage = Stage(SceneConfig(width=64, height=48, flicker_depth=0.1))
    assert len(stage.changing(np.array([0.0, 0.001]))) == 64 * 48


def test_one_pixel_looks_the_same_alone_and_among_others():
    stage = Stage(SceneConfig(width=320, height=180))
    time_s = np.linspace(0.0, 0.02, 5)
    everywhere = np.arange(320 * 180, dtype=np.int32)
    whole = stage.look(everywhere, time_s)
    few = everywhere[5000::3111].copy()
    alone = stage.look(few, time_s)
    np.testing.assert_array_equal(alone.levels, whole.levels[few])
    np.testing.assert_array_equal(alone.covered, whole.covered[few])
    assert alone.covered.any()


def test_what_is_seen_is_the_background_through_what_is_clear_and_the_movers_for_the_rest():
    config = SceneConfig(width=320, height=180, companion=CompanionConfig(enabled=True))
    stage = Stage(config)
    without = Stage(SceneConfig(width=320, height=180, mover=MoverConfig(enabled=False)))
    everywhere, time_s = np.arange(320 * 180, dtype=np.int32), np.linspace(0.0, 0.02, 5)
    view, background = stage.look(everywhere, time_s), without.look(everywhere, time_s)
    touched = view.veiled >= 0
    np.testing.assert_array_equal(view.behind, background.levels[touched])
    np.testing.assert_array_equal(view.levels[~view.covered], background.levels[~view.covered])
    assert ((view.clear >= 0.0) & (view.clear <= 1.0)).all()
    for opaque in (view.clear == 0.0, (view.clear > 0.0) & (view.clear < 1.0)):
        assert opaque.sum() > 100


def test_a_flickering_light_falls_on_board_and_mover_alike():
    lit = Stage(SceneConfig(width=320, height=180, flicker_depth=0.5, flicker_hz=50.0, rig=RigConfig(omega_rad_s=0.0)))
    plain = Stage(SceneConfig(width=320, height=180, rig=RigConfig(omega_rad_s=0.0)))
    everywhere, time_s = np.arange(320 * 180, dtype=np.int32), np.array([0.005])
    difference = lit.look(everywhere, time_s).levels - plain.look(everywhere, time_s).levels
    np.testing.assert_allclose(difference, np.log(1.5), atol=1e-5)
