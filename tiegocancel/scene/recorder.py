"""Record what a sensor makes of a stage: block after block, in constant memory."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.scene.sensor import SensorConfig, noise_keys, thresholds
from tiegocancel.scene.steps import STEPS_PER_BLOCK
from tiegocancel.scene.view import View

__all__ = ["Scenery", "checked_span", "record"]


class Scenery(Protocol):
    """What can be recorded: light that changes with time on the pixels of a sensor."""

    width: int
    height: int
    sensor: SensorConfig
    label_clear: NDArray[np.uint8]
    """Label uint8[height · width] of an event that no mover causes."""

    def step_us(self, start_s: float) -> int:
        """Return the time between two samples in the block that begins at ``start_s``."""
        ...

    def changing(self, time_s: NDArray[np.float64]) -> NDArray[np.int32]:
        """Return the pixels int32[n], rising, whose light can change between the first and the last time."""
        ...

    def look(self, pixels: NDArray[np.int32], time_s: NDArray[np.float64]) -> View:
        """Return what is seen on ``pixels`` at each time."""
        ...


def checked_span(duration_s: float, seed: int) -> int:
    """Return the duration in µs; raise ``ValueError`` for a duration or seed out of range."""
    if not (math.isfinite(duration_s) and 0.0 <= duration_s <= 1e6):
        raise ValueError(f"duration_s must be from 0 to 1e6 s, not {duration_s!r}")
    if not 0 <= seed < 2**64:
        raise ValueError(f"seed must be from 0 to 2^64 − 1, not {seed}")
    return round(duration_s * 1e6)


def record(stage: Scenery, *, duration_us: int, seed: int, start_us: int) -> Iterator[Events]:
    """Yield the events of block after block; jittered events that may still be overtaken wait for the next one.

    A block's step depends on its own start alone, so that a longer recording begins with the shorter one.
    """
    from tiegocancel.kernels.sensor import TIME_SHIFT, fire, unpack

    sensor = stage.sensor
    size = stage.width * stage.height
    threshold_on, threshold_off, offset = thresholds(sensor, size, seed)
    view = stage.look(np.arange(size, dtype=np.int32), np.zeros(1))
    touched = view.veiled >= 0
    clear, behind = np.ones(size, np.float32), np.zeros(size, np.float32)
    clear[touched], behind[touched] = view.clear[:, 0], view.behind[:, 0]
    release_us = np.full(size, -1.0)
    state = {
        "level": view.levels[:, 0].copy(),
        "clear": clear,
        "behind": behind,
        "memory": view.levels[:, 0] + offset,
        # Nobody made the first memory's offset: half of it to the movers, half to the background, decides nothing.
        "moved": np.float32(-0.5) * offset,
        "release_us": release_us,
    }
    slack_us = math.ceil(2.0 * math.sqrt(3.0) * sensor.jitter_us) + 1
    waiting: NDArray[np.int64] = np.zeros(0, np.int64)
    block, begin_us, step_us = 0, 0, stage.step_us(0.0)
    while begin_us < duration_us + slack_us:
        first_step, block_us = block * STEPS_PER_BLOCK, STEPS_PER_BLOCK * step_us
        # Times are multiples of the step while that stays the same: the sums are then exact.
        early_us = begin_us - first_step * step_us
        steps = np.arange(first_step, first_step + STEPS_PER_BLOCK + 1, dtype=np.float64)
        time_s = steps * (step_us * 1e-6) + early_us * 1e-6
        pixels = stage.changing(time_s)
        view = stage.look(pixels, time_s[1:])
        fired = fire(
            view.levels,
            pixels,
            state,
            veiled=view.veiled,
            clear=view.clear,
            behind=view.behind,
            label_clear=stage.label_clear,
            threshold_on=threshold_on,
            threshold_off=threshold_off,
            width=stage.width,
            first_step=first_step,
            step_us=step_us,
            refractory_us=sensor.refractory_us,
            jitter_us=sensor.jitter_us,
            seed=_word(seed),
        )
        noise = noise_keys(sensor, stage.width, stage.height, block_us, block, seed)
        keys = np.sort(np.concatenate([waiting, fired, noise]))
        first, last = np.searchsorted(
            keys, np.array([-begin_us, min(block_us - slack_us, duration_us - begin_us)]) << TIME_SHIFT
        )
        waiting = keys[last:] - (block_us << TIME_SHIFT)
        t, x, y, p, label = unpack(keys[first:last])
        if len(t):
            yield Events(t + (begin_us + start_us), x, y, p, stage.width, stage.height, label)
        block, begin_us = block + 1, begin_us + block_us
        next_us = stage.step_us(begin_us * 1e-6)
        if next_us != step_us:
            _shift(release_us, block * STEPS_PER_BLOCK * (next_us - step_us))
            step_us = next_us


def _shift(release_us: NDArray[np.float64], by_us: int) -> None:
    """Move the ends of resets to the kernel's new clock, which counts all steps so far as if of the new length."""
    held = release_us >= 0.0
    release_us[held] = np.maximum(release_us[held] + by_us, 0.0)


def _word(seed: int) -> int:
    """Fold a seed of 64 bits into the 32 that the kernel's hash takes."""
    return int(np.random.default_rng([seed, 0]).integers(0, 2**32))
