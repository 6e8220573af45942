"""Read a gyroscope's samples from a file, whatever its format, and write them as CSV."""

from __future__ import annotations

import csv
from pathlib import Path

from tiegocancel.errors import ConfigError
from tiegocancel.estimation.inertial.edvs_lines import is_edvs_log, read_edvs_log
from tiegocancel.estimation.inertial.gyro import GyroSamples, axes_matrix
from tiegocancel.files.source import first_bytes

__all__ = ["read_gyro", "write_gyro"]

_AEDAT4 = b"#!AER-DAT4"
_START_BYTES = 4096


def read_gyro(path: str | Path, *, axes: str | None = None, keep_going: bool = False) -> GyroSamples:
    """Read AEDAT 4.0, a log of eDVS lines, CSV with units in the column names, or bare ``t ax ay az gx gy gz``.

    They are told by their start. ``axes`` maps the device's axes to the camera's (:func:`axes_matrix`). Without it
    logs, CSV and text are taken to be in the camera's frame, and AEDAT 4.0 in that of iniVation's cameras, see
    :mod:`tiegocancel.estimation.inertial.aedat4`; a note says which. ``keep_going`` turns a fault after the first
    sample into a note, and the samples before it are returned. Raise ``InputError`` naming the place of the first
    fault, ``ConfigError`` for ``axes`` that are no map.
    """
    place = Path(path)
    if axes is not None:
        try:
            axes_matrix(axes)
        except ValueError as error:
            raise ConfigError(str(error)) from None
    start = first_bytes(place, _START_BYTES)
    if start.startswith(_AEDAT4):
        from tiegocancel.estimation.inertial.aedat4 import AXES, read_aedat4_gyro

        samples, default = read_aedat4_gyro(place, keep_going=keep_going), AXES
    elif is_edvs_log(start):
        samples, default = read_edvs_log(place), "x,y,z"
    else:
        from tiegocancel.estimation.inertial.text import read_text_gyro

        samples, default = read_text_gyro(place, keep_going=keep_going), "x,y,z"
    chosen = default if axes is None else axes
    told = "as given" if axes is not None else "by default for this format"
    return samples.rotated(chosen).noted(f"the camera's axes are {chosen} of the gyroscope's, {told}")


def write_gyro(samples: GyroSamples, path: str | Path) -> None:
    """Write ``timestamp`` in s (six decimals, exact) and ``gyro_x_rad_s``, ``gyro_y_rad_s``, ``gyro_z_rad_s``."""
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["timestamp", "gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s"])
        for time, rate in zip(samples.t_us.tolist(), samples.rate_rad_s.tolist(), strict=True):
            seconds, micros = divmod(abs(time), 1_000_000)
            writer.writerow([f"{'-' if time < 0 else ''}{seconds}.{micros:06d}", *map(repr, rate)])
