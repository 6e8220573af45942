"""Choose how finely time is sampled: blocks of steps, short enough for whatever moves."""

from __future__ import annotations

import math

__all__ = ["BLOCK_SPAN_S", "LONGEST_STEP_US", "STEPS_PER_BLOCK", "step_for"]

SHORTEST_STEP_US, LONGEST_STEP_US = 10, 1000

STEPS_PER_BLOCK = 25
"""Samples that are rendered at once; they are equally spaced, and the next block may have another spacing."""

BLOCK_SPAN_S = STEPS_PER_BLOCK * LONGEST_STEP_US * 1e-6
"""No block is longer than this."""


def step_for(step_px: float, speed_px_s: float, longest_us: float = math.inf) -> int:
    """Return the step in µs within which ``speed_px_s`` covers at most ``step_px``, from 10 to 1000 µs."""
    step_us = min(step_px * 1e6 / speed_px_s if speed_px_s > 0.0 else math.inf, longest_us)
    return int(min(max(step_us, SHORTEST_STEP_US), LONGEST_STEP_US))
