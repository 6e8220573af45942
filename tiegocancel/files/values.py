"""Turn the numbers of a file into event columns: times to whole microseconds, polarities to 0 and 1."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import InputError
from tiegocancel.events import MAX_TIME_US
from tiegocancel.files.block import Block

__all__ = ["MICROSECONDS", "RowMaker", "UndecidedError", "decide_columns"]

MICROSECONDS = {"s": 1_000_000, "ms": 1_000, "us": 1}
"""Microseconds in a unit; nanoseconds are divided by 1000, halves away from zero."""

_Checked = tuple[NDArray[Any], NDArray[np.bool_] | None]


class UndecidedError(ValueError):
    """Say why content alone does not decide which column is which."""


class RowMaker:
    """Make blocks from raw columns, and remember how the file writes an OFF event."""

    def __init__(self, path: Path, time_unit: str) -> None:
        self._path = path
        self._unit = time_unit
        self._off: int | None = None

    def block(
        self,
        t: NDArray[Any],
        x: NDArray[Any],
        y: NDArray[Any],
        p: NDArray[Any],
        where: Callable[[int], str],
        label: NDArray[Any] | None = None,
    ) -> tuple[Block, InputError | None]:
        """Convert columns [n] of any numeric type; return the rows before the first fault, and the fault."""
        converted: dict[str, NDArray[Any]] = {}
        faults: list[tuple[int, str]] = []
        given = {"t": t, "x": x, "y": y, "p": p} | ({} if label is None else {"label": label})
        for name, column in given.items():
            if column.dtype == np.bool_:
                # A file may hold any byte where a truth value is meant.
                column = column.view(np.uint8)
            values, wrong = _times_us(column, self._unit) if name == "t" else _whole(column)
            if name == "p":
                values, wrong = self._polarity(values, wrong)
            converted[name] = values
            if wrong is not None:
                row = int(np.argmax(wrong))
                faults.append((row, f"{name} is {column[row]}, expected {_EXPECTED[name]}"))
        block = Block(converted["t"], converted["x"], converted["y"], converted["p"], where, converted.get("label"))
        if not faults:
            return block, None
        row, problem = min(faults)
        return block.head(row), InputError(self._path, where(row), problem)

    def _polarity(self, values: NDArray[Any], fraction: NDArray[np.bool_] | None) -> _Checked:
        """Map {0, 1} or {−1, 1} to {0, 1}; the first value below 1 decides which of the two the file uses.

        Rows where ``fraction`` [n] is set hold no whole number: they are wrong, and decide nothing.
        """
        if fraction is not None:
            values = np.where(fraction, 1, values)
        low = values < 1
        if self._off is None and low.any():
            self._off = int(values[np.argmax(low)])
        wrong = (values > 1) | (values < -1)
        if self._off is not None:
            wrong |= low & (values != self._off)
        if fraction is not None:
            wrong |= fraction
        return (values > 0).astype(np.uint8), wrong if wrong.any() else None


_EXPECTED = {
    "t": "a finite time within ±2^60 µs",
    "x": "a whole number",
    "y": "a whole number",
    "p": "a polarity of 0 or 1, or else of -1 or 1 throughout",
    "label": "a whole number",
}


def _times_us(values: NDArray[Any], unit: str) -> _Checked:
    """Convert times to int64 µs; floats are rounded to the nearest, nanoseconds with halves away from zero.

    A float64 of seconds written with up to six decimals comes back exactly while ``|t| < 2^32 s``: half a step of
    the float (2^-22 s) and half a step of the product (2^-2 µs) stay below half a microsecond.
    """
    if values.dtype.kind == "f":
        scaled = _doubles(values)
        with np.errstate(over="ignore"):
            scaled = scaled / 1_000 if unit == "ns" else scaled * MICROSECONDS[unit]
        wrong = ~(np.abs(scaled) <= MAX_TIME_US)
        if wrong.any():
            return np.rint(np.where(wrong, 0, scaled)).astype(np.int64), wrong
        return np.rint(scaled).astype(np.int64), None
    limit = MAX_TIME_US * 1_000 if unit == "ns" else MAX_TIME_US // MICROSECONDS[unit]
    limit = min(limit, (1 << 63) - 1_000)
    wrong = values > limit if values.dtype.kind == "u" else (values > limit) | (values < -limit)
    whole = np.where(wrong, 0, values).astype(np.int64) if wrong.any() else values.astype(np.int64, copy=False)
    if unit == "ns":
        whole = np.sign(whole) * ((np.abs(whole) + 500) // 1_000)
    elif unit != "us":
        whole = whole * MICROSECONDS[unit]
    return whole, wrong if wrong.any() else None


def _whole(values: NDArray[Any]) -> _Checked:
    """Convert floats that are whole to int64; integers stay as they are."""
    if values.dtype.kind != "f":
        return values, None
    numbers = _doubles(values)
    wrong = ~(np.abs(numbers) <= 2**31)
    wrong |= numbers != np.floor(numbers)
    if wrong.any():
        return np.where(wrong, 0, numbers).astype(np.int64), wrong
    return numbers.astype(np.int64), None


def _doubles(values: NDArray[Any]) -> NDArray[np.float64]:
    """Widen floats, so that no bound overflows their type; one that is wider and too large becomes infinite."""
    with np.errstate(over="ignore"):
        return values.astype(np.float64, copy=False)


def decide_columns(sample: NDArray[Any]) -> str:
    """Decide from rows [n, k], k ≥ 4, whether they are ``xypt`` (the thesis) or ``txyp`` (public data sets).

    A candidate needs coordinates that are whole and below 65536 and polarities of {0, 1} or {−1, 1}; if both
    candidates pass, only one may have times that never decrease. Otherwise raise :class:`UndecidedError`.
    """
    if sample.dtype.kind == "f":
        sample = _doubles(sample)
    passing = [order for order in ("xypt", "txyp") if _could_be(sample, order)]
    if len(passing) == 2:
        passing = [order for order in passing if len(sample) > 1 and _never_decreases(sample[:, order.index("t")])]
    if len(passing) != 1:
        found = "both orders x,y,p,t and t,x,y,p fit" if passing else "neither order x,y,p,t nor t,x,y,p fits"
        raise UndecidedError(f"{found} the first {len(sample)} rows")
    return passing[0]


def _could_be(sample: NDArray[Any], order: str) -> bool:
    """Say whether rows make sense as events in this order of columns."""
    polarity = set(np.unique(sample[:, order.index("p")]).tolist())
    sides = sample[:, [order.index("x"), order.index("y")]]
    coordinates = bool(((sides >= 0) & (sides < 65_536)).all()) and bool((sides == np.floor(sides)).all())
    return coordinates and (polarity <= {0, 1} or polarity <= {-1, 1})


def _never_decreases(times: NDArray[Any]) -> bool:
    """Compare neighbours: a difference of unsigned numbers would wrap."""
    return bool((times[1:] >= times[:-1]).all())
