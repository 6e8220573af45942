"""A small ground on which parts are judged."""

from __future__ import annotations

import pytest

from tiegocancel.scene import SceneConfig, ground_truth, simulate
from tiegocancel.study.budget.ground import Ground, gather
from tiegocancel.study.feed import FixedMotion


@pytest.fixture(scope="session")
def ground() -> Ground:
    """Sixty milliseconds of the built-in disc on 320×240 px, labelled."""
    scene = SceneConfig(width=320, height=240)
    feed = FixedMotion(ground_truth(scene, duration_s=0.06))
    found = gather(simulate(scene, duration_s=0.06, seed=2), feed, most=100_000, step_us=1000)
    assert found is not None
    return found
