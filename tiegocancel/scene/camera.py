"""Simulate the event camera that looks at a scene."""

from __future__ import annotations

from collections.abc import Iterator

from tiegocancel.events import Events
from tiegocancel.scene.camera_config import CameraSceneConfig
from tiegocancel.scene.config import SceneConfig
from tiegocancel.scene.recorder import checked_span, record

__all__ = ["simulate", "simulate_camera"]


def simulate(
    config: SceneConfig | CameraSceneConfig, *, duration_s: float, seed: int = 0, start_us: int = 0
) -> Iterator[Events]:
    """Yield the labelled events of ``duration_s`` seconds in chunks of about ten milliseconds, in constant memory.

    Events are in the order of (t, y, x, p) and never decrease in time across chunks. ``seed`` draws thresholds, jitter
    and noise; a longer simulation begins with the shorter one, and the number of threads changes nothing.
    ``start_us`` is the time stamp of the scene's time 0. A label says who moved the pixel's light farther towards the
    event since the pixel's last reset (see ``kernels.sensor``): the background (ego) or a mover; what neither a moving
    background nor a mover makes is noise. Raise ``ValueError`` for a duration or seed out of range.
    """
    if isinstance(config, CameraSceneConfig):
        return simulate_camera(config, duration_s=duration_s, seed=seed, start_us=start_us)
    return _disc_events(config, checked_span(duration_s, seed), seed, start_us)


def simulate_camera(
    config: CameraSceneConfig, *, duration_s: float, seed: int = 0, start_us: int = 0
) -> Iterator[Events]:
    """Yield what a turning camera sees of a far world; arguments, order and errors are those of :func:`simulate`."""
    return _camera_events(config, checked_span(duration_s, seed), seed, start_us)


def _disc_events(config: SceneConfig, duration_us: int, seed: int, start_us: int) -> Iterator[Events]:
    """Paint when the first chunk is asked for."""
    from tiegocancel.scene.stage import Stage

    if duration_us:
        yield from record(Stage(config), duration_us=duration_us, seed=seed, start_us=start_us)


def _camera_events(config: CameraSceneConfig, duration_us: int, seed: int, start_us: int) -> Iterator[Events]:
    """Paint when the first chunk is asked for."""
    from tiegocancel.scene.world_stage import WorldStage

    if duration_us:
        yield from record(WorldStage(config), duration_us=duration_us, seed=seed, start_us=start_us)
