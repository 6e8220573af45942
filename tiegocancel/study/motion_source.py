"""Turn the settings of the motion into a feed for a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from tiegocancel.errors import ConfigError, InputError
from tiegocancel.estimation.contrast.fit import RotationFit
from tiegocancel.estimation.diagnosis.diagnosis import Diagnosis
from tiegocancel.estimation.source import trajectory_from
from tiegocancel.events import Events
from tiegocancel.motion.camera import CameraTrajectory
from tiegocancel.motion.camera_csv import names_turns, read_camera
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.schedule_file import is_schedule_file, read_schedule
from tiegocancel.motion.trajectory import Trajectory
from tiegocancel.study.estimators import build_estimator, camera_motion, gyro_of, intrinsics_of
from tiegocancel.study.feed import FixedMotion, MotionFeed, ScheduledMotion, TrackedMotion
from tiegocancel.study.settings import Settings

__all__ = ["Found", "motion_inputs", "open_motion"]


@dataclass(frozen=True, slots=True)
class Found:
    """The feed of a run, with the fit behind it and what its residuals on the sample say, where there are such."""

    feed: MotionFeed
    fit: RotationFit | None = None
    diagnoses: tuple[Diagnosis, ...] = ()


def open_motion(settings: Settings, *, sample: Callable[[], Events], width: int, height: int) -> Found:
    """Return the motion that ``settings.motion.source`` names for a sensor of ``width`` × ``height`` px.

    ``sample`` returns events to look at beforehand, and is called only where the source or ``refine`` asks for them.
    Raise ``ConfigError`` for a source that is none and for settings that contradict each other, ``InputError`` for a
    fault in a file.
    """
    source = settings.motion.source.strip()
    estimate = settings.estimate
    if source.lower() in ("track", "gyro"):
        if settings.motion.refine:
            raise ConfigError(f"--refine: {source} follows the motion by itself; it serves fit, CX,CY,OMEGA and files")
        if settings.motion.interpolation != "file":
            raise ConfigError(f"--motion-interpolation {settings.motion.interpolation}: serves CSV files, not {source}")
        if estimate.calibration is not None and source.lower() == "track" and estimate.method != "gyro":
            raise ConfigError(f"--calibration {estimate.calibration}: serves a gyroscope alone (--motion gyro)")
        return Found(_estimated(settings, source.lower(), width, height))
    if estimate.gyro is not None:
        raise ConfigError(f"--gyro {estimate.gyro}: serves --motion track and --motion gyro, not {source}")
    turns = names_turns(source) if _is_file(source) and not is_schedule_file(source) else "no"
    if estimate.calibration is not None and turns == "no":
        raise ConfigError(
            f"--calibration {estimate.calibration}: serves --motion gyro and CSV files of three axes, not {source}"
        )
    if turns == "only" or estimate.calibration is not None:
        return Found(FixedMotion(_turning_camera(settings, source, width, height)))
    if is_schedule_file(source):
        if settings.motion.path == "float" or settings.motion.refine or settings.motion.interpolation != "file":
            raise ConfigError(
                f"--motion {source}: a schedule file is run as it is, without --motion-path float, --refine or "
                "--motion-interpolation"
            )
        schedule = read_schedule(source)
        if schedule.horizon_us not in (None, settings.cancel.horizon_us):
            raise ConfigError(
                f"--motion {source}: made for a horizon of {schedule.horizon_us} µs, the run has "
                f"{settings.cancel.horizon_us} µs (--horizon-us)"
            )
        try:
            return Found(ScheduledMotion(schedule, settings.cancel.horizon_us, source=Path(source).name))
        except ValueError as error:
            raise InputError(source, "", f"cannot be run backwards, as a control is: {error}") from None
    trajectory: Trajectory
    trajectory, fit = trajectory_from(source, sample=sample, width=width, height=height)
    if turns == "too":
        trajectory = trajectory.noted("the file has turns about three axes too; --calibration makes use of them")
    if settings.motion.interpolation != "file":
        trajectory = _interpolated(trajectory, settings)
    if not settings.motion.refine:
        return Found(FixedMotion(trajectory), fit)
    if not isinstance(trajectory, RotationTrajectory):
        raise ConfigError(f"--refine: {source} is no rotation, and only rotations are refined")
    from tiegocancel.estimation.diagnosis.diagnose import refine_rotation

    trajectory, diagnoses = refine_rotation(sample(), trajectory, settings.cancel)
    return Found(FixedMotion(trajectory), fit, tuple(diagnoses))


def motion_inputs(settings: Settings) -> list[Path]:
    """Name the files that the motion is read from, for the manifest."""
    names = (settings.motion.source, settings.estimate.gyro, settings.estimate.calibration)
    return [Path(name) for name in names if name is not None and _is_file(name)]


def _estimated(settings: Settings, source: str, width: int, height: int) -> MotionFeed:
    """Return the feed of an estimator, or of a gyroscope with calibration, which needs none."""
    estimate = settings.estimate
    gyro = gyro_of(estimate)
    if source == "gyro":
        if gyro is None:
            raise ConfigError("--motion gyro: no gyroscope is given; name its file with --gyro")
        if estimate.calibration is not None:
            undistorted = settings.read.undistort is not None
            camera = camera_motion(estimate, gyro, width=width, height=height, undistorted=undistorted)
            return FixedMotion(camera.reported(settings.cancel.horizon_us))
        estimate = replace(estimate, method="gyro")
    estimator = build_estimator(estimate, width=width, height=height, gyro=gyro)
    label = {"contrast": "track", "circle": "track, circle fit", "gyro": "gyro"}[estimate.method]
    if gyro is not None:
        label = f"{label}, {gyro.source}"
    return TrackedMotion(estimator, source=label, notes=() if gyro is None else gyro.notes)


def _turning_camera(settings: Settings, source: str, width: int, height: int) -> CameraTrajectory:
    """Return the motion of a CSV file of three axes; refuse what serves rotations alone."""
    if settings.estimate.calibration is None:
        raise ConfigError(
            f"--motion {source}: turns about three axes move the image as the lens has it; name the camera's "
            "intrinsics with --calibration"
        )
    if settings.motion.refine:
        raise ConfigError(f"--refine: {source} is no rotation, and only rotations are refined")
    if settings.motion.interpolation != "file":
        raise ConfigError(f"--motion-interpolation {settings.motion.interpolation}: serves files of rotations")
    undistorted = settings.read.undistort is not None
    intrinsics = intrinsics_of(settings.estimate, width=width, height=height, undistorted=undistorted)
    return read_camera(source, intrinsics, width=width, height=height).reported(settings.cancel.horizon_us)


def _interpolated(trajectory: Trajectory, settings: Settings) -> Trajectory:
    """Return the trajectory with the interpolation that was asked for."""
    wanted = settings.motion.interpolation
    try:
        return replace(trajectory, interpolation=wanted)  # type: ignore[type-var]
    except ValueError as error:
        raise ConfigError(f"--motion-interpolation {wanted}: {error}") from error


def _is_file(name: str) -> bool:
    try:
        return Path(name).is_file()
    except OSError:  # too long a name for the file system
        return False
