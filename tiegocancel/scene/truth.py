"""State the motion that the scene really has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiegocancel.scene.config import SceneConfig

if TYPE_CHECKING:
    from tiegocancel.motion.trajectory import RotationTrajectory

__all__ = ["ground_truth"]

SPACING_US = 1000


def ground_truth(config: SceneConfig, *, duration_s: float, start_us: int = 0) -> RotationTrajectory:
    """Return centre and angular velocity of the disc from the start to the end of the recording.

    A steady disc needs its two ends only; otherwise there is one entry a millisecond.
    """
    from tiegocancel.motion.trajectory import RotationTrajectory

    if not duration_s >= 0.0:
        raise ValueError(f"duration_s must be at least 0 s, not {duration_s!r}")
    duration_us = round(duration_s * 1e6)
    spacing_us = max(duration_us, 1) if config.rig.is_steady else SPACING_US
    t_us = np.arange(0, duration_us + 1, spacing_us, dtype=np.int64)
    if t_us[-1] < duration_us:
        t_us = np.append(t_us, np.int64(duration_us))
    return RotationTrajectory(
        t_us=t_us + start_us,
        center_px=np.tile(np.asarray(config.rig.center_px, np.float64), (len(t_us), 1)),
        omega_rad_s=config.rig.omega_at(t_us.astype(np.float64) * 1e-6),
        source="scene",
    )
