"""On the built-in scene each filter removes what it is for and little else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tiegocancel import Events
from tiegocancel.events import EGO, MOVER, NOISE
from tiegocancel.filters import FilterChain, FilterConfig
from tiegocancel.scene import RigConfig, SceneConfig, SensorConfig, simulate

WIDTH, HEIGHT = 320, 180


def scene(duration_s: float = 0.2, **settings: Any) -> Events:
    config = SceneConfig(width=WIDTH, height=HEIGHT, **settings)
    return Events.concatenate(list(simulate(config, duration_s=duration_s, seed=2)))


def removed(events: Events, **config: Any) -> NDArray[np.bool_]:
    return ~FilterChain(FilterConfig(**config), width=WIDTH, height=HEIGHT).process(events)


def shares(events: Events, gone: NDArray[np.bool_]) -> dict[int, float]:
    assert events.label is not None
    return {label: float(gone[events.label == label].mean()) for label in (EGO, MOVER, NOISE)}


def test_background_removes_most_noise_and_few_edges() -> None:
    """The delay is the time that an edge needs for a pixel or two: 4 to 8 ms on a sensor as small as this."""
    share = shares(events := scene(sensor=SensorConfig(noise_hz=1.0)), removed(events, background_us=8000))
    assert share[NOISE] > 0.8
    assert max(share[EGO], share[MOVER]) < 0.2


def test_hot_pixels_are_muted_once_known_and_edges_are_not() -> None:
    events = scene(sensor=SensorConfig(hot_pixels=60, noise_hz=0.0))
    gone = removed(events, hot_events=20)
    late = events.t > 120_000
    assert shares(events.select(late), gone[late])[NOISE] > 0.95
    assert max(shares(events, gone)[label] for label in (EGO, MOVER)) < 0.01


def test_flickering_light_is_removed_and_a_moving_texture_is_not() -> None:
    still = scene(0.15, flicker_depth=0.3, rig=RigConfig(omega_rad_s=0.0))
    late = still.t > 80_000
    assert removed(still, flicker_periods=4)[late].mean() > 0.95
    assert removed(scene(), flicker_periods=4).mean() < 0.01


@pytest.mark.parametrize(("name", "most"), [("hot_events", 0.02), ("flicker_periods", 0.02)])
def test_a_real_recording_of_moving_things_passes(recording: Any, name: str, most: float) -> None:
    from tiegocancel import read_events

    events = read_events(recording("driving_evt3.raw"))
    chain = FilterChain(FilterConfig(**{name: 4 if name == "flicker_periods" else 20}), width=1280, height=720)
    assert 1.0 - chain.process(events).mean() < most


def test_real_hot_pixels_are_found(recording: Any) -> None:
    """Four pixels far from the spinning dot fire at 9 kHz and more, and are 1.1 % of the recording."""
    from tiegocancel import read_events

    events = read_events(recording("spinning_dot_evt2.raw"))
    pixel = events.y.astype(np.int64) * events.width + events.x
    chain = FilterChain(FilterConfig(hot_events=50, hot_window_us=1_000_000), width=events.width, height=events.height)
    gone = ~chain.process(events)
    hot = np.flatnonzero(np.bincount(pixel) > 500)
    assert len(hot) == 4
    assert gone[np.isin(pixel, hot)].mean() > 0.95
    assert gone.mean() < 0.02
