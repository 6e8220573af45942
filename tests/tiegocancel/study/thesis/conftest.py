"""A small disc that turns fast, so that a few milliseconds tell what the big one tells in many."""

from __future__ import annotations

import pytest

from tiegocancel.scene import SceneConfig, ground_truth, simulate
from tiegocancel.study.thesis.probe import Bench
from tiegocancel.study.thesis.settings import (
    AgreementSettings,
    BiasSettings,
    EngineSettings,
    GateSettings,
    GridSettings,
    ThesisSettings,
    VideoSettings,
    WindowSettings,
)
from tiegocancel.study.thesis.windows import cut_windows

SETTINGS = ThesisSettings(
    windows=WindowSettings(count=2),
    grid=GridSettings(
        horizons_us=(0, 1000, 2000, 6000, 8000),
        tolerances_px=(1.0, 2.0),
        tolerances_us=(1000,),
        heatmaps_us=(2000, 6000),
    ),
    bias=BiasSettings(omega_rad_s=(0.0, 0.05, 12.0), center_px=(0.0, 5.0), horizons_us=(2000,)),
    gates=GateSettings(tolerances_us=(300, 1000)),
    agreement=AgreementSettings(tolerances_px=(2.0,), tolerances_us=(1000,), kept_shares=(1.0, 0.5)),
    video=VideoSettings(frames=3),
    engine=EngineSettings(kind="inline"),
)


@pytest.fixture(scope="session")
def small_bench() -> Bench:
    """Two windows of a disc of 240×180 px at 15 rad/s, with its truth and labels."""
    scene = SceneConfig.disc(width=240, height=180, omega_rad_s=15.0)
    parts = list(simulate(scene, duration_s=0.1, seed=3))
    windows, _ = cut_windows(lambda: parts, SETTINGS.windows, SETTINGS.longest_us)
    return Bench(windows, ground_truth(scene, duration_s=0.1), scene.rig.center_px, scene.rig.radius_px)


@pytest.fixture(scope="session")
def small_settings() -> ThesisSettings:
    """The whole study on coarse grids."""
    return SETTINGS
