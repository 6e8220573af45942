"""Build the estimator that the settings ask for."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from tiegocancel.errors import ConfigError
from tiegocancel.estimation.estimate import Estimator

if TYPE_CHECKING:
    from tiegocancel.estimation.inertial.gyro import GyroSamples
    from tiegocancel.motion.camera import CameraTrajectory
    from tiegocancel.motion.intrinsics import CameraIntrinsics
    from tiegocancel.study.settings import EstimateSettings

__all__ = ["agile_estimator", "build_estimator", "camera_motion", "gyro_of", "intrinsics_of"]

_GYRO_ROW_US = 1000


def build_estimator(
    settings: EstimateSettings, *, width: int, height: int, gyro: GyroSamples | None = None
) -> Estimator:
    """Return the estimator for a sensor of ``width`` × ``height`` px, fused with ``gyro`` where one is given.

    Raise ``ConfigError`` where settings contradict each other or lie out of range.
    """
    try:
        estimator = _events_estimator(settings, width, height, gyro)
    except ValueError as error:
        raise ConfigError(f"[estimate] {error}") from error
    if gyro is None or settings.method == "gyro":
        return estimator
    from tiegocancel.estimation.inertial.bias import RestConfig
    from tiegocancel.estimation.inertial.fusion import (
        ExponentialConfig,
        ExponentialFusion,
        FusedEstimator,
        Fusion,
        KalmanFusion,
    )

    fusion: Fusion = KalmanFusion()
    if settings.fusion == "exponential":
        fusion = ExponentialFusion(ExponentialConfig(alpha=settings.alpha, event_alpha=settings.alpha))
    rest = RestConfig() if settings.gyro_bias == "rest" else None
    return FusedEstimator(estimator, gyro, fusion, row_us=_GYRO_ROW_US, rest=rest)


def agile_estimator(settings: EstimateSettings, *, width: int, height: int) -> Estimator:
    """Return an estimator whose ω is noisy rather than late, to be compared with a gyroscope in time.

    Windows that grow and a filter that expects a steady motion trail a shaken camera by 10 ms and more.
    """
    if settings.method != "contrast":
        return build_estimator(settings, width=width, height=height)
    from tiegocancel.estimation.contrast.track import RotationTracker, TrackConfig
    from tiegocancel.estimation.contrast.twist_filter import FilterConfig

    config = TrackConfig(
        step_us=5_000,
        window_us=10_000,
        longest_window_us=20_000,
        max_omega_rad_s=settings.max_omega_rad_s,
        seed=settings.seed,
        filter=FilterConfig(jerk_share=1_000.0),
    )
    return RotationTracker(config, width=width, height=height)


def gyro_of(settings: EstimateSettings) -> GyroSamples | None:
    """Read the gyroscope that the settings name, on the events' clock and in the camera's axes."""
    if settings.gyro is None:
        return None
    from tiegocancel.estimation.inertial.files import read_gyro

    try:
        samples = read_gyro(settings.gyro, axes=settings.gyro_axes)
    except ConfigError as error:
        raise ConfigError(f"--gyro-axes: {error}") from None
    return samples.shifted(settings.gyro_offset_us)


def camera_motion(
    settings: EstimateSettings, gyro: GyroSamples, *, width: int, height: int, undistorted: bool = False
) -> CameraTrajectory:
    """Return the turn about three axes that gyroscope and calibration give; each time uses samples before it.

    The lens of the calibration plays no part where the events are ``undistorted``.
    """
    from tiegocancel.motion.camera import CameraTrajectory

    intrinsics = intrinsics_of(settings, width=width, height=height, undistorted=undistorted)
    free = _without_bias(gyro, settings)
    return CameraTrajectory(
        t_us=free.t_us,
        omega_rad_s=free.rate_rad_s,
        intrinsics=intrinsics,
        width=width,
        height=height,
        interpolation="causal",
        source=gyro.source,
        notes=free.notes,
    )


def intrinsics_of(
    settings: EstimateSettings, *, width: int, height: int, undistorted: bool = False
) -> CameraIntrinsics:
    """Read the calibration that the settings name, without its lens where the events are ``undistorted``.

    Raise ``ConfigError`` where its size is not that of the events.
    """
    from tiegocancel.motion.intrinsics import CameraIntrinsics

    assert settings.calibration is not None
    intrinsics = CameraIntrinsics.from_file(settings.calibration)
    for name, side in (("width", width), ("height", height)):
        given = getattr(intrinsics, name)
        if given is not None and given != side:
            raise ConfigError(f"{settings.calibration}: {name} is {given} px, that of the events {side} px")
    return intrinsics.pinhole() if undistorted else intrinsics


def _events_estimator(settings: EstimateSettings, width: int, height: int, gyro: GyroSamples | None) -> Estimator:
    """Return the estimator alone."""
    given: dict[str, Any] = {
        name: getattr(settings, name) for name in ("step_us", "window_us") if getattr(settings, name)
    }
    if settings.method == "circle":
        from tiegocancel.estimation.circle.estimator import CircleConfig, CircleEstimator

        config = CircleConfig(**given, max_omega_rad_s=settings.max_omega_rad_s)
        return CircleEstimator(config, width=width, height=height, seed=settings.seed)
    if settings.method == "gyro":
        from tiegocancel.estimation.inertial.estimator import GyroEstimator

        if gyro is None:
            raise ConfigError("--method gyro: no gyroscope is given; name its file with --gyro")
        bias: Literal["causal"] | None = "causal" if settings.gyro_bias == "rest" else None
        return GyroEstimator(
            gyro, _principal_point(settings, width, height), bias=bias, row_us=settings.step_us or _GYRO_ROW_US
        )  # fmt: skip
    from tiegocancel.estimation.contrast.track import RotationTracker, TrackConfig

    if settings.max_events:
        given["max_events"] = settings.max_events
    if "window_us" in given:
        given["longest_window_us"] = 4 * settings.window_us
    config_ = TrackConfig(**given, max_omega_rad_s=settings.max_omega_rad_s, seed=settings.seed)
    return RotationTracker(config_, width=width, height=height)


def _principal_point(settings: EstimateSettings, width: int, height: int) -> tuple[float, float]:
    """Return where the optical axis meets the image: the calibration's, or the middle of the sensor."""
    if settings.calibration is None:
        return (0.5 * (width - 1), 0.5 * (height - 1))
    from tiegocancel.motion.intrinsics import CameraIntrinsics

    intrinsics = CameraIntrinsics.from_file(settings.calibration)
    return (intrinsics.cx, intrinsics.cy)


def _without_bias(gyro: GyroSamples, settings: EstimateSettings) -> GyroSamples:
    """Take off the bias, as far as rests until each sample tell it."""
    if settings.gyro_bias == "none":
        return gyro
    from tiegocancel.estimation.inertial.bias import RestingBias

    follower = RestingBias()
    rates = gyro.rate_rad_s - follower.process(gyro.t_us, gyro.rate_rad_s)
    if follower.found:
        said = ", ".join(f"{value:+.4f}" for value in follower.bias_rad_s.tolist())
        note = f"bias of the gyroscope at rest: ({said}) rad/s"
    else:
        note = "the bias of the gyroscope is unknown: it never rests"
    return replace(gyro, rate_rad_s=rates, notes=(*gyro.notes, note))
