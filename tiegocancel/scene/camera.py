"""Simulate the event camera that looks at the scene."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.scene.config import SceneConfig
from tiegocancel.scene.sensor import noise_keys, thresholds

__all__ = ["simulate"]

STEPS_PER_BLOCK = 25


def simulate(config: SceneConfig, *, duration_s: float, seed: int = 0, start_us: int = 0) -> Iterator[Events]:
    """Yield the labelled events of ``duration_s`` seconds in chunks of about ten milliseconds, in constant memory.

    Events are in the order of (t, y, x, p) and never decrease in time across chunks. ``seed`` draws thresholds, jitter
    and noise; a longer simulation begins with the shorter one, and the number of threads changes nothing.
    ``start_us`` is the time stamp of the scene's time 0. Raise ``ValueError`` for a duration or seed out of range.
    """
    if not (math.isfinite(duration_s) and 0.0 <= duration_s <= 1e6):
        raise ValueError(f"duration_s must be from 0 to 1e6 s, not {duration_s!r}")
    if not 0 <= seed < 2**64:
        raise ValueError(f"seed must be from 0 to 2^64 − 1, not {seed}")
    return _blocks(config, round(duration_s * 1e6), seed, start_us)


def _blocks(config: SceneConfig, duration_us: int, seed: int, start_us: int) -> Iterator[Events]:
    """Run block after block; jittered events that may still be overtaken wait for the next one."""
    from tiegocancel.kernels.sensor import TIME_SHIFT, fire, unpack
    from tiegocancel.scene.stage import Stage

    if duration_us == 0:
        return
    size = config.width * config.height
    stage = Stage(config)
    threshold_on, threshold_off, offset = thresholds(config.sensor, size, seed)
    everywhere = np.arange(size, dtype=np.int32)
    levels, covered = stage.look(everywhere, np.zeros(1))
    state = {
        "level": levels[:, 0].copy(),
        "cover": covered[:, 0].copy(),
        "memory": levels[:, 0] + offset,
        "release_us": np.full(size, -1.0),
    }
    block_us = STEPS_PER_BLOCK * config.step_us
    slack_us = math.ceil(2.0 * math.sqrt(3.0) * config.sensor.jitter_us) + 1
    waiting: NDArray[np.int64] = np.zeros(0, np.int64)
    for block in range(-(-(duration_us + slack_us) // block_us)):
        first_step = block * STEPS_PER_BLOCK
        time_s = np.arange(first_step, first_step + STEPS_PER_BLOCK + 1, dtype=np.float64) * (config.step_us * 1e-6)
        pixels = stage.changing(time_s)
        levels, covered = stage.look(pixels, time_s[1:])
        fired = fire(
            levels,
            covered,
            pixels,
            state,
            label_clear=stage.label_clear,
            threshold_on=threshold_on,
            threshold_off=threshold_off,
            width=config.width,
            first_step=first_step,
            step_us=config.step_us,
            refractory_us=config.sensor.refractory_us,
            jitter_us=config.sensor.jitter_us,
            seed=_word(seed),
        )
        noise = noise_keys(config.sensor, config.width, config.height, block_us, block, seed)
        keys = np.sort(np.concatenate([waiting, fired, noise]))
        offset_us = block * block_us
        first, last = np.searchsorted(
            keys, np.array([-offset_us, min(block_us - slack_us, duration_us - offset_us)]) << TIME_SHIFT
        )
        waiting = keys[last:] - (block_us << TIME_SHIFT)
        t, x, y, p, label = unpack(keys[first:last])
        if len(t):
            yield Events(t + (offset_us + start_us), x, y, p, config.width, config.height, label)


def _word(seed: int) -> int:
    """Fold a seed of 64 bits into the 32 that the kernel's hash takes."""
    return int(np.random.default_rng([seed, 0]).integers(0, 2**32))
