"""Parse many decimal numbers at once, digit by digit, so that no float ever rounds a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["MAX_DIGITS", "parse_decimals"]

MAX_DIGITS = 17
"""Digits before the point, plus those kept behind it, that an int64 takes."""

_ZERO, _POINT, _MINUS, _PLUS = 48, 46, 45, 43
_Index = NDArray[np.int64]


def parse_decimals(
    text: NDArray[np.uint8], starts: _Index, stops: _Index, places: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]] | None:
    """Parse the numbers ``[+-]digits[.digits]`` at ``text[starts[i]:stops[i]]`` into units of ``10^-places``.

    Digits beyond ``places`` round half away from zero. Return the values int64[n] and whether each was whole
    (nothing but zeros beyond ``places``), or ``None`` when a number is longer than :data:`MAX_DIGITS` or has no
    digit. The caller has made sure that there are only digits, at most one point and a leading sign.
    """
    if not len(starts):
        return np.zeros(0, np.int64), np.zeros(0, np.bool_)
    first = text[starts]
    negative = first == _MINUS
    signed = negative | (first == _PLUS)
    starts = starts + signed
    points = _points(text, starts, stops)
    before, behind = points - starts, np.maximum(stops - points - 1, 0)
    if int(before.max()) + places > MAX_DIGITS or bool((before + behind < 1).any()):
        return None
    values = np.zeros(len(starts), np.int64)
    shortest = int(before.min())
    for place in range(int(before.max())):
        # Counted from the point, so that all numbers have the first digits and only long ones need a test.
        digit = text[points - 1 - place].astype(np.int64) - _ZERO
        if place >= shortest:
            digit *= place < before
        values += digit * 10**place
    most, least = int(behind.max()), int(behind.min())
    rest = np.zeros(len(starts), np.bool_)
    for place in range(most):
        at = points + 1 + place
        digit = text[at if place < least else np.minimum(at, len(text) - 1)].astype(np.int64) - _ZERO
        if place >= least:
            digit *= place < behind
        if place < places:
            values = values * 10 + digit
            continue
        rest |= digit > 0
        if place == places:
            values += digit >= 5
    if most < places:
        values *= 10 ** (places - most)
    return np.where(negative, -values, values), ~rest


def _points(text: NDArray[np.uint8], starts: _Index, stops: _Index) -> _Index:
    """Return where the decimal point of each number is, or its end where there is none."""
    points = np.flatnonzero(text == _POINT)
    if not len(points):
        return stops
    if len(points) == len(starts) and bool(((points >= starts) & (points < stops)).all()):
        return points
    nearest = points[np.minimum(np.searchsorted(points, starts), len(points) - 1)]
    return np.where((nearest >= starts) & (nearest < stops), nearest, stops)
