"""Write and read a motion schedule as a file that a run, a simulation, a test bench and firmware share.

The text form is for ``$fscanf`` and ``fscanf`` as much as for people: ASCII, whole numbers alone, one blank between
words, ``\\n`` at the end of each line. Six lines of a name and its value come first, in this order, then the entries::

    tiegocancel_schedule 1          version of the format
    fraction_bits 16                of every coefficient
    horizon_us 20000                that the displacements are for; -1 serves any
    entries 2                       lines that follow the header
    columns 7                       t_us a b c d e f
    order t_us_a_b_c_d_e_f
    0 -170 -4715 444682 4715 -170 -550460
    1000 -179 -4845 457594 4845 -179 -565287

An event at ``t`` uses the last entry with ``t_us ≤ t``, the first one before that; with its coefficients
``x' = ((x << 16) + a·x + b·y + c + 32768) >> 16`` and ``y'`` the same with ``d e f`` (arithmetic shift).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from tiegocancel.errors import InputError
from tiegocancel.events import MAX_TIME_US
from tiegocancel.files.short import short
from tiegocancel.motion.schedule import FRACTION_BITS, MAX_COEFFICIENT, MotionSchedule

__all__ = ["coefficient_bits", "is_schedule_file", "read_schedule", "write_memory_image", "write_schedule"]

_COLUMNS = ("t_us", "a", "b", "c", "d", "e", "f")
_ORDER = "_".join(_COLUMNS)
_VERSION = 1
_ANY_HORIZON = -1
_MAX_HORIZON_US = 1 << 60
_WHOLE = re.compile(r"-?[0-9]{1,19}", re.ASCII)


def write_schedule(schedule: MotionSchedule, path: str | Path) -> None:
    """Write the text form; :func:`read_schedule` gives back the same numbers."""
    horizon_us = _ANY_HORIZON if schedule.horizon_us is None else schedule.horizon_us
    lines = [
        f"tiegocancel_schedule {_VERSION}",
        f"fraction_bits {FRACTION_BITS}",
        f"horizon_us {horizon_us}",
        f"entries {len(schedule)}",
        f"columns {len(_COLUMNS)}",
        f"order {_ORDER}",
    ]
    table = np.column_stack([schedule.t_us, schedule.coefficients])
    lines += [" ".join(map(str, row)) for row in table.tolist()]
    Path(path).write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")


def is_schedule_file(path: str | Path) -> bool:
    """Tell by its first word whether a file is a schedule; what cannot be read is none."""
    try:
        with Path(path).open("rb") as file:
            return file.read(21) == b"tiegocancel_schedule "
    except (OSError, ValueError):
        return False


def read_schedule(path: str | Path) -> MotionSchedule:
    """Read the text form; raise ``InputError`` naming row (line of the file) and column of the first fault."""
    lines = _lines(path)
    _header(path, lines, 0, "tiegocancel_schedule", (_VERSION, _VERSION))
    _header(path, lines, 1, "fraction_bits", (FRACTION_BITS, FRACTION_BITS))
    horizon_us = _header(path, lines, 2, "horizon_us", (_ANY_HORIZON, _MAX_HORIZON_US))
    entries = _header(path, lines, 3, "entries", (1, 1 << 40))
    _header(path, lines, 4, "columns", (len(_COLUMNS), len(_COLUMNS)))
    if lines[5:6] != [f"order {_ORDER}"]:
        raise InputError(path, "row 6", f"expected 'order {_ORDER}', found {_found(lines, 5)}")
    rows = lines[6:]
    if len(rows) != entries:
        raise InputError(path, "", f"holds {len(rows)} entries, expected {entries} as its header says")
    table = np.empty((entries, len(_COLUMNS)), np.int64)
    for index, line in enumerate(rows):
        cells = line.split(" ")
        if len(cells) != len(_COLUMNS):
            problem = f"has {len(cells)} fields, expected {len(_COLUMNS)}: {' '.join(_COLUMNS)}"
            raise InputError(path, f"row {index + 7}", problem)
        for column, cell in enumerate(cells):
            bound = MAX_COEFFICIENT if column else MAX_TIME_US
            table[index, column] = _whole(path, f"row {index + 7}, column {_COLUMNS[column]}", cell, (-bound, bound))
        if index and table[index, 0] < table[index - 1, 0]:
            problem = f"is {table[index, 0]} after {table[index - 1, 0]}: times must not decrease"
            raise InputError(path, f"row {index + 7}, column t_us", problem)
    return MotionSchedule(table[:, 0], table[:, 1:], None if horizon_us == _ANY_HORIZON else horizon_us)


def coefficient_bits(schedule: MotionSchedule) -> int:
    """Return the width in bits, with sign, that holds every coefficient in two's complement."""
    return max(_bits(int(schedule.coefficients.min())), _bits(int(schedule.coefficients.max())))


def write_memory_image(schedule: MotionSchedule, path: str | Path, *, width_bits: int = 32) -> None:
    """Write the coefficients as a memory image for ``$readmemh``: one word of ``6 × width_bits`` bits an entry.

    ``{a, b, c, d, e, f}``, ``a`` in the highest bits, each in two's complement with 16 fractional bits; hexadecimal,
    as many digits as the word needs. Times go into a comment before each word, for they belong to the host that
    switches entries. Raise ``ValueError`` for a width that is not from 2 to 64 and, naming row and column, for a
    coefficient that does not fit.
    """
    if not 2 <= width_bits <= 64:
        raise ValueError(f"width_bits must be from 2 to 64, not {width_bits}")
    digits = -(-6 * width_bits // 4)
    horizon = "any horizon" if schedule.horizon_us is None else f"a horizon of {schedule.horizon_us} us"
    lines = [
        f"// {len(schedule)} words of 6 x {width_bits} bits: {{a, b, c, d, e, f}}, {FRACTION_BITS} fraction bits, "
        f"for {horizon}"
    ]
    mask = (1 << width_bits) - 1
    for row, (time, values) in enumerate(zip(schedule.t_us.tolist(), schedule.coefficients.tolist(), strict=True)):
        word = 0
        for name, value in zip(_COLUMNS[1:], values, strict=True):
            if _bits(value) > width_bits:
                raise ValueError(
                    f"row {row} has {name} = {value}, which needs {_bits(value)} bits with its sign, not {width_bits}"
                )
            word = word << width_bits | value & mask
        lines += [f"// t_us {time}", f"{word:0{digits}x}"]
    Path(path).write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")


def _bits(value: int) -> int:
    """Return the width of ``value`` in two's complement."""
    return (value if value >= 0 else ~value).bit_length() + 1


def _lines(path: str | Path) -> list[str]:
    """Return the lines of an ASCII file."""
    try:
        text = Path(path).read_bytes().decode("ascii")
    except (OSError, ValueError) as error:
        if isinstance(error, UnicodeDecodeError):
            raise InputError(path, f"byte {error.start}", "is not ASCII; expected a schedule file") from None
        raise InputError(path, "", f"cannot be read: {getattr(error, 'strerror', None) or error}") from None
    lines = text.replace("\r\n", "\n").split("\n")
    return lines[:-1] if lines[-1] == "" else lines


def _header(path: str | Path, lines: list[str], index: int, name: str, span: tuple[int, int]) -> int:
    """Return the value of one line of the header."""
    cells = lines[index].split(" ") if index < len(lines) else []
    if len(cells) != 2 or cells[0] != name:
        raise InputError(
            path, f"row {index + 1}", f"expected '{name} {span[0]}' or alike, found {_found(lines, index)}"
        )
    return _whole(path, f"row {index + 1}, {name}", cells[1], span)


def _whole(path: str | Path, where: str, cell: str, span: tuple[int, int]) -> int:
    """Read one whole number within a span."""
    low, high = span
    if _WHOLE.fullmatch(cell) is None or not low <= int(cell) <= high:
        expected = str(low) if low == high else f"a whole number from {low} to {high}"
        raise InputError(path, where, f"expected {expected}, found {short(repr(cell))}")
    return int(cell)


def _found(lines: list[str], index: int) -> str:
    """Show a line of the file for a message."""
    return short(repr(lines[index])) if index < len(lines) else "the end of the file"
