"""Read and write trajectories as CSV: the file a tracker, an encoder or an estimator leaves behind."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import InputError
from tiegocancel.motion.affine import RATE_BOUNDS, RATE_DOT_BOUNDS, AffineTrajectory
from tiegocancel.motion.csv_table import CsvTable, merged_rows, quoted, sorted_rows, time_cell
from tiegocancel.motion.rotation import MAX_CENTER_PX, MAX_OMEGA_DOT_RAD_S2, MAX_OMEGA_RAD_S, RotationTrajectory

__all__ = ["read_affine", "read_motion", "read_trajectory", "write_affine", "write_trajectory"]

_OTHER_UNITS = ("rpm", "rev", "rev_s", "rps", "hz", "deg", "deg_s", "dps", "degrees_s", "mrad_s", "krad_s")
_NOT_OMEGA = ("omega_dot_rad_s2", "omega_sigma_rad_s")
_RATES = tuple(f"rate_{letter}" for letter in "abcdef")
_DOTS = tuple(f"rate_dot_{letter}" for letter in "abcdef")
_EXPECTED = "timestamp, center_x, center_y, omega_rad_s"


def read_motion(path: str | Path) -> RotationTrajectory | AffineTrajectory:
    """Read either kind of file: affine where the header names ``rate_a``, a rotation otherwise."""
    table = CsvTable.read(path, f"{_EXPECTED}, or timestamp, {', '.join(_RATES)}")
    return _rotation(table) if table.place("rate_a") is None else _affine(table)


def read_trajectory(path: str | Path) -> RotationTrajectory:
    """Read time, centre and angular velocity by column name; other columns are ignored.

    Time: ``timestamp``, ``time`` or ``t`` in s, or with the unit in the name (``t_us``, ``timestamp_ms`` …).
    Centre: ``center_x``, ``center_y`` in px (``_px`` may follow); rows with an empty one are skipped. Angular velocity:
    ``omega_rad_s``, or else the only column whose name starts with ``omega``; a name that ends in another unit is
    refused. ``omega_dot_rad_s2`` makes the trajectory ``causal``. ``confident`` (0 or 1) is counted. Separators are
    comma, semicolon or tab. Rows are sorted by time, and rows of one instant (several blobs of one tracker; of one
    time alone in a causal file) become their median. ``notes`` of the result say all of that. Raise ``InputError``
    naming row and column of the first fault.
    """
    return _rotation(CsvTable.read(path, _EXPECTED))


def read_affine(path: str | Path) -> AffineTrajectory:
    """Read time and ``rate_a … rate_f`` (1/s, px/s); ``rate_dot_a … rate_dot_f`` per s make it ``causal``.

    Times, order, merging and faults are those of :func:`read_trajectory`.
    """
    return _affine(CsvTable.read(path, f"timestamp, {', '.join(_RATES)}"))


def write_trajectory(trajectory: RotationTrajectory, path: str | Path) -> None:
    """Write ``timestamp`` in s (six decimals, exact), ``center_x``, ``center_y`` in px and ``omega_rad_s``.

    ``omega_dot_rad_s2`` follows where the interpolation is ``causal``; that it is ``spline`` is not kept.
    """
    names = ["center_x", "center_y", "omega_rad_s"]
    columns: list[Any] = [*trajectory.center_px.T, trajectory.omega_rad_s]
    if trajectory.interpolation == "causal":
        names.append("omega_dot_rad_s2")
        columns.append(trajectory.omega_dot_rad_s2)
    _write(path, names, trajectory.t_us, np.column_stack(columns))


def write_affine(trajectory: AffineTrajectory, path: str | Path) -> None:
    """Write ``timestamp`` in s and ``rate_a … rate_f``, with their slopes where the interpolation is ``causal``."""
    if trajectory.interpolation == "linear":
        _write(path, _RATES, trajectory.t_us, trajectory.rates)
        return
    assert trajectory.rates_dot is not None  # filled in __post_init__
    _write(path, (*_RATES, *_DOTS), trajectory.t_us, np.hstack([trajectory.rates, trajectory.rates_dot]))


def _rotation(table: CsvTable) -> RotationTrajectory:
    """Make a rotation of a table's rows."""
    time = table.time_place()
    centers = (table.needed("center_x", "center_x_px"), table.needed("center_y", "center_y_px"))
    omega = _omega_place(table)
    slope = table.place("omega_dot_rad_s2")
    t_us = table.times_us(time)
    notes = [f"times from column {table.names[time]}, angular velocity in rad/s from column {table.names[omega]}"]
    known = np.array([i for i in range(len(t_us)) if all(table.cell(i, place) for place in centers)], np.int64)
    if not len(known):
        raise InputError(table.path, "", f"knows a centre in none of {len(t_us)} rows")
    if len(known) < len(t_us):
        notes.append(f"{len(t_us) - len(known)} of {len(t_us)} rows have no centre and were skipped")
    places = [(centers[0], MAX_CENTER_PX), (centers[1], MAX_CENTER_PX), (omega, MAX_OMEGA_RAD_S)]
    if slope is not None:
        places.append((slope, MAX_OMEGA_DOT_RAD_S2))
        notes.append("causal: each row holds from its own time on, carried on along omega_dot_rad_s2")
    columns = [table.numbers(place, bound, known) for place, bound in places]
    _count_doubtful(table, known, notes)
    times, values = sorted_rows(t_us[known], np.column_stack(columns), notes)
    times, values = merged_rows(times, values, notes, equal_only=slope is not None)
    return RotationTrajectory(
        t_us=times,
        center_px=values[:, :2],
        omega_rad_s=values[:, 2],
        omega_dot_rad_s2=None if slope is None else values[:, 3],
        interpolation="linear" if slope is None else "causal",
        source=Path(table.path).name,
        notes=tuple(notes),
    )


def _affine(table: CsvTable) -> AffineTrajectory:
    """Make an affine motion of a table's rows."""
    time = table.time_place()
    names = _RATES if table.place("rate_dot_a") is None else (*_RATES, *_DOTS)
    notes = [f"times from column {table.names[time]}, rates in 1/s and px/s from columns {_RATES[0]} to {_RATES[-1]}"]
    causal = len(names) > len(_RATES)
    if causal:
        notes.append("causal: each row holds from its own time on, carried on along rate_dot_a to rate_dot_f")
    bounds = np.concatenate([RATE_BOUNDS, RATE_DOT_BOUNDS]).tolist()
    places = [table.needed(name) for name in names]
    t_us = table.times_us(time)
    columns = [table.numbers(place, bound) for place, bound in zip(places, bounds, strict=False)]
    times, values = sorted_rows(t_us, np.column_stack(columns), notes)
    times, values = merged_rows(times, values, notes, equal_only=causal)
    return AffineTrajectory(
        t_us=times,
        rates=values[:, :6],
        rates_dot=values[:, 6:] if causal else None,
        interpolation="causal" if causal else "linear",
        source=Path(table.path).name,
        notes=tuple(notes),
    )


def _omega_place(table: CsvTable) -> int:
    """Find the one column of angular velocity."""
    lower = [name.lower() for name in table.names]
    omegas = [name for name in lower if name.startswith("omega") and name not in _NOT_OMEGA]
    if "omega_rad_s" in omegas:
        omegas = ["omega_rad_s"]
    if len(omegas) != 1:
        found = "more than one: " + quoted(omegas) if omegas else quoted(table.names)
        raise InputError(table.path, "header", f"lacks the column omega_rad_s, or one omega column: found {found}")
    place = lower.index(omegas[0])
    if any(omegas[0].endswith(f"_{unit}") for unit in _OTHER_UNITS):
        raise InputError(table.path, "header", f"gives {table.names[place]!r}; expected rad/s, as omega_rad_s")
    return place


def _count_doubtful(table: CsvTable, rows: NDArray[np.int64], notes: list[str]) -> None:
    """Note how many of the rows their estimator does not trust."""
    place = table.place("confident")
    if place is None:
        return
    doubtful = sum(table.cell(index, place).lower() in ("0", "false") for index in rows.tolist())
    if doubtful:
        notes.append(f"{doubtful} of {len(rows)} rows are marked doubtful")


def _write(path: str | Path, names: Sequence[str], t_us: NDArray[np.int64], values: NDArray[np.float64]) -> None:
    """Write times in s, and values with digits enough to read back the same numbers."""
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["timestamp", *names])
        for time, row in zip(t_us.tolist(), values.tolist(), strict=True):
            writer.writerow([time_cell(time), *map(repr, row)])
