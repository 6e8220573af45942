"""Describe the ego-motion: trajectories and the fixed-point schedules that devices run."""

from __future__ import annotations

from tiegocancel.motion.affine import AffineParts, AffineTrajectory
from tiegocancel.motion.approximation import ApproximationError
from tiegocancel.motion.camera import CameraTrajectory
from tiegocancel.motion.intrinsics import CameraIntrinsics
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.schedule import MotionSchedule, rotation_coefficients
from tiegocancel.motion.schedule_file import read_schedule, write_memory_image, write_schedule
from tiegocancel.motion.trajectory import Trajectory
from tiegocancel.motion.trajectory_csv import read_motion

__all__ = [
    "AffineParts",
    "AffineTrajectory",
    "ApproximationError",
    "CameraIntrinsics",
    "CameraTrajectory",
    "MotionSchedule",
    "RotationTrajectory",
    "Trajectory",
    "read_motion",
    "read_schedule",
    "rotation_coefficients",
    "write_memory_image",
    "write_schedule",
]
