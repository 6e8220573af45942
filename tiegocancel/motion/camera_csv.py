"""Read the turning of a camera about its three axes from CSV: a true motion, or what another program estimated."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from tiegocancel.errors import InputError
from tiegocancel.motion.camera import CameraTrajectory
from tiegocancel.motion.csv_table import CsvTable, merged_rows, sorted_rows
from tiegocancel.motion.intrinsics import CameraIntrinsics
from tiegocancel.motion.rotation import MAX_OMEGA_RAD_S

__all__ = ["names_turns", "read_camera"]

_RATES = ("omega_x_rad_s", "omega_y_rad_s", "omega_z_rad_s")
_EXPECTED = f"timestamp, {', '.join(_RATES)}"


def names_turns(path: str | Path) -> Literal["no", "too", "only"]:
    """Tell whether a CSV file names turns about three axes, ``too`` beside a centre; ``no`` for no table at all."""
    try:
        table = CsvTable.read(path, _EXPECTED)
    except InputError:
        return "no"
    if table.place(_RATES[0]) is None:
        return "no"
    return "only" if table.place("center_x") is None else "too"


def read_camera(
    path: str | Path, intrinsics: CameraIntrinsics, *, width: int | None = None, height: int | None = None
) -> CameraTrajectory:
    """Read time and ``omega_x_rad_s``, ``omega_y_rad_s``, ``omega_z_rad_s`` about right, down and forward.

    The camera's own angular velocity, as :class:`CameraTrajectory` has it; other columns are ignored, but
    ``omega_dot_rad_s2``, which causal estimates have, makes each row hold from its own time on. Times, order, merging
    and faults are those of :func:`tiegocancel.motion.trajectory_csv.read_trajectory`.
    """
    table = CsvTable.read(path, _EXPECTED)
    time = table.time_place()
    places = [table.needed(name) for name in _RATES]
    t_us = table.times_us(time)
    notes = [f"times from column {table.names[time]}, turns of the camera from columns {_RATES[0]} to {_RATES[-1]}"]
    columns = [table.numbers(place, MAX_OMEGA_RAD_S) for place in places]
    times, values = sorted_rows(t_us, np.column_stack(columns), notes)
    causal = table.place("omega_dot_rad_s2") is not None
    if causal:
        notes.append("causal: each row holds from its own time on")
    times, values = merged_rows(times, values, notes, equal_only=causal)
    return CameraTrajectory(
        t_us=times,
        omega_rad_s=values,
        intrinsics=intrinsics,
        width=width,
        height=height,
        interpolation="causal" if causal else "linear",
        source=Path(path).name,
        notes=tuple(notes),
    )
