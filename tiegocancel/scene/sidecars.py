"""Write what is known of a simulated recording beside it: true motion, gyroscope and calibration."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.camera_config import CameraSceneConfig
from tiegocancel.scene.config import SceneConfig
from tiegocancel.scene.gyro import gyro_samples
from tiegocancel.scene.truth import camera_truth, ground_truth

__all__ = ["write_calibration", "write_rates", "write_sidecars"]


def write_sidecars(
    config: SceneConfig | CameraSceneConfig, recording: str | Path, *, duration_s: float, seed: int = 0
) -> dict[str, Path]:
    """Write the files beside ``recording``, named after its stem, and return their paths by what they hold.

    The disc has ``.motion.csv``, the trajectory that ``RotationTrajectory.from_csv`` reads. The camera has
    ``.motion.csv`` with its true rates (``omega_x_rad_s`` …), ``.gyro.csv`` with what its gyroscope says
    (``gyro_x_rad_s`` …) and ``.calibration.toml``.
    """
    recording = Path(recording)
    paths = {"motion": recording.with_name(recording.stem + ".motion.csv")}
    if isinstance(config, SceneConfig):
        ground_truth(config, duration_s=duration_s).to_csv(paths["motion"])
        return paths
    paths["gyro"] = recording.with_name(recording.stem + ".gyro.csv")
    paths["calibration"] = recording.with_name(recording.stem + ".calibration.toml")
    write_rates(paths["motion"], "omega", *camera_truth(config, duration_s=duration_s))
    write_rates(paths["gyro"], "gyro", *gyro_samples(config, duration_s=duration_s, seed=seed))
    write_calibration(config, paths["calibration"])
    return paths


def write_rates(path: str | Path, name: str, t_us: NDArray[np.int64], rate_rad_s: NDArray[np.float64]) -> None:
    """Write ``timestamp`` in s (six decimals, exact) and ``{name}_x_rad_s``, ``…_y_rad_s``, ``…_z_rad_s``.

    ``t_us`` int64[n] and ``rate_rad_s`` float64[n, 3]; the digits read back as the same numbers.
    """
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["timestamp", *(f"{name}_{axis}_rad_s" for axis in "xyz")])
        for time, rates in zip(t_us.tolist(), rate_rad_s.tolist(), strict=True):
            seconds, micros = divmod(abs(time), 1_000_000)
            writer.writerow([f"{'-' if time < 0 else ''}{seconds}.{micros:06d}", *map(repr, rates)])


def write_calibration(config: CameraSceneConfig, path: str | Path) -> None:
    """Write the pinhole's ``fx``, ``fy``, ``cx``, ``cy`` in px and the sensor's ``width`` and ``height`` as TOML."""
    x, y = config.principal_px
    numbers = {"fx": config.focal_px, "fy": config.focal_px, "cx": x, "cy": y}
    lines = [f"{key} = {float(value)!r}" for key, value in numbers.items()]
    lines += [f"width = {config.width}", f"height = {config.height}"]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
