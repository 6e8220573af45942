"""Turn the value of ``--motion`` into a motion that is known beforehand: ``fit``, three numbers or a CSV file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from tiegocancel.errors import ConfigError
from tiegocancel.estimation.contrast.fit import RotationFit, fit_rotation
from tiegocancel.events import Events
from tiegocancel.motion.affine import AffineTrajectory
from tiegocancel.motion.rotation import MAX_CENTER_PX, MAX_OMEGA_RAD_S, RotationTrajectory
from tiegocancel.motion.trajectory_csv import read_motion

__all__ = ["trajectory_from"]

_EXPECTED = "expected fit, track, gyro, CX,CY,OMEGA in px and rad/s, a CSV file or a schedule file"


def trajectory_from(
    text: str, *, sample: Callable[[], Events], width: int, height: int
) -> tuple[RotationTrajectory | AffineTrajectory, RotationFit | None]:
    """Return the trajectory that ``text`` names, and the fit behind it where there is one.

    ``fit`` fits a rotation to the events that ``sample`` returns, which is called in that case only;
    ``CX,CY,OMEGA`` is a constant rotation in px and rad/s; anything else is the path of a CSV file, of a rotation or an
    affine field. A centre outside
    the sensor of ``width`` × ``height`` px is allowed, and a note of the trajectory says so. Raise ``ConfigError``
    for text that is none of the three and ``InputError`` for a fault in the file.
    """
    value = text.strip()
    if value.lower() == "fit":
        fit = fit_rotation(sample())
        return fit.trajectory(), fit
    numbers = _numbers(value)
    if numbers is not None:
        cx, cy, omega = numbers
        trajectory = RotationTrajectory.constant(center_px=(cx, cy), omega_rad_s=omega)
    elif _is_file(value):
        read = read_motion(value)
        if isinstance(read, AffineTrajectory):
            return read, None
        trajectory = read
    else:
        raise ConfigError(f"--motion {text!r}: there is no such file; {_EXPECTED}")
    return _with_center_note(trajectory, width, height), None


def _numbers(value: str) -> tuple[float, float, float] | None:
    """Read ``CX,CY,OMEGA``; return nothing when the text looks like a path instead."""
    cells = [cell.strip() for cell in value.split(",")]
    if _is_file(value) or not any(_is_number(cell) for cell in cells):
        return None
    if len(cells) != 3:
        raise ConfigError(f"--motion {value!r}: {len(cells)} numbers; {_EXPECTED}")
    for cell, name, bound in zip(
        cells, ("CX", "CY", "OMEGA"), (MAX_CENTER_PX, MAX_CENTER_PX, MAX_OMEGA_RAD_S), strict=True
    ):
        if not _is_number(cell):
            raise ConfigError(f"--motion {value!r}: {name} is {cell!r}, not a number; {_EXPECTED}")
        # Written with "not", because a comparison with NaN is false.
        if not abs(float(cell)) <= bound:
            raise ConfigError(f"--motion {value!r}: {name} is {cell}, expected a finite number within ±{bound:g}")
    return float(cells[0]), float(cells[1]), float(cells[2])


def _is_file(value: str) -> bool:
    try:
        return Path(value).is_file()
    except OSError:  # too long a name for the file system
        return False


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _with_center_note(trajectory: RotationTrajectory, width: int, height: int) -> RotationTrajectory:
    """Add a note when the centre leaves the sensor: often the sizes or the axes are swapped."""
    x, y = trajectory.center_px[:, 0], trajectory.center_px[:, 1]
    outside = (x < 0) | (x > width - 1) | (y < 0) | (y > height - 1)
    if not outside.any():
        return trajectory
    row = int(outside.argmax())
    note = f"the centre ({x[row]:.1f}, {y[row]:.1f}) px lies outside the sensor of {width} × {height} px"
    return replace(trajectory, notes=(*trajectory.notes, note))
