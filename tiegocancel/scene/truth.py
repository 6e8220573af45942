"""State the motion that the scene really has."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.camera_config import CameraSceneConfig
from tiegocancel.scene.config import SceneConfig

if TYPE_CHECKING:
    from tiegocancel.motion.rotation import RotationTrajectory
    from tiegocancel.motion.trajectory import Trajectory

__all__ = ["camera_truth", "ground_truth", "true_motion"]

SPACING_US = 1000


def ground_truth(config: SceneConfig, *, duration_s: float, start_us: int = 0) -> RotationTrajectory:
    """Return instantaneous centre and angular velocity of the disc from the start to the end of the recording.

    A steady disc needs its two ends only; otherwise there is one entry a millisecond. The centre is the point that
    stands still for an instant, which for a wobbling disc is not its middle (``RigConfig.motion_at``).
    """
    from tiegocancel.motion.rotation import RotationTrajectory

    t_us = _times(duration_s, only_ends=config.rig.is_steady)
    center_px, omega_rad_s = config.rig.motion_at(t_us.astype(np.float64) * 1e-6)
    return RotationTrajectory(t_us=t_us + start_us, center_px=center_px, omega_rad_s=omega_rad_s, source="scene")


def camera_truth(
    config: CameraSceneConfig, *, duration_s: float, start_us: int = 0
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return times int64[K] in µs, one a millisecond, and the camera's rates float64[K, 3] in rad/s about its own axes.

    x points right, y down, z forward, and turns are right-handed: a far point in direction d moves at −Ω × d.
    """
    t_us = _times(duration_s, only_ends=False)
    return t_us + start_us, config.motion.omega_at(t_us.astype(np.float64) * 1e-6)


def true_motion(config: SceneConfig | CameraSceneConfig, *, duration_s: float, start_us: int = 0) -> Trajectory:
    """Return the motion of either kind of scene as the best that a causal prediction could know.

    A disc's rotation, where it is unsteady with its angular acceleration of the moment, one row a millisecond
    (``causal``: a horizon turns by the integral of ω as it is carried on); a calibrated camera's rates otherwise.
    """
    if isinstance(config, SceneConfig):
        return _accelerated(ground_truth(config, duration_s=duration_s, start_us=start_us), config, start_us)
    from tiegocancel.motion.camera import CameraTrajectory
    from tiegocancel.motion.intrinsics import CameraIntrinsics

    t_us, omega_rad_s = camera_truth(config, duration_s=duration_s, start_us=start_us)
    x, y = config.principal_px
    lens = CameraIntrinsics(
        fx=config.focal_px, fy=config.focal_px, cx=x, cy=y, width=config.width, height=config.height
    )
    return CameraTrajectory(t_us=t_us, omega_rad_s=omega_rad_s, intrinsics=lens, source="scene")


def _accelerated(motion: RotationTrajectory, config: SceneConfig, start_us: int) -> RotationTrajectory:
    """Return the motion with its angular acceleration, where that is ever other than 0."""
    if len(motion.t_us) < 3:
        return motion
    time_s = (motion.t_us - start_us).astype(np.float64) * 1e-6
    ahead, behind = (config.rig.motion_at(time_s + shift_s)[1] for shift_s in (0.5e-6, -0.5e-6))
    return replace(motion, interpolation="causal", omega_dot_rad_s2=(ahead - behind) / 1e-6)


def _times(duration_s: float, *, only_ends: bool) -> NDArray[np.int64]:
    """Return the times of the entries, the two ends among them."""
    if not 0.0 <= duration_s <= 1e6:
        raise ValueError(f"duration_s must be at least 0 s and at most 1e6 s, not {duration_s!r}")
    duration_us = round(duration_s * 1e6)
    spacing_us = max(duration_us, 1) if only_ends else SPACING_US
    t_us = np.arange(0, duration_us + 1, spacing_us, dtype=np.int64)
    return t_us if t_us[-1] == duration_us else np.append(t_us, np.int64(duration_us))
