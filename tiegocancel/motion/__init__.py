"""Describe the ego-motion: trajectories, their fit to events, and the fixed-point schedules that devices run."""

from __future__ import annotations

from tiegocancel.motion.fit import FitConfig, RotationFit, fit_rotation
from tiegocancel.motion.schedule import MotionSchedule, rotation_coefficients
from tiegocancel.motion.source import trajectory_from
from tiegocancel.motion.trajectory import RotationTrajectory

__all__ = [
    "FitConfig",
    "MotionSchedule",
    "RotationFit",
    "RotationTrajectory",
    "fit_rotation",
    "rotation_coefficients",
    "trajectory_from",
]
