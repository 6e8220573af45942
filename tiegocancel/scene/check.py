"""Check the values of a config: one line that names the key, the value and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

__all__ = ["check_number", "check_point", "check_whole"]

MAX_PLACE_PX = 1e6


def check_number(
    config: Any, name: str, low: float, high: float = math.inf, *, above: bool = False, fit: bool = False
) -> None:
    """Raise ``ValueError`` unless the field is a finite number from ``low`` (or above it) to ``high``.

    ``fit`` admits not-a-number besides, which stands for "fit it to the sensor".
    """
    value = getattr(config, name)
    if fit and isinstance(value, float) and math.isnan(value):
        return
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    if good and low <= value <= high and not (above and value == low):
        return
    upper = "" if math.isinf(high) else f" and at most {high:g}"
    lower = "" if math.isinf(low) else f" {'above' if above else 'of at least'} {low:g}"
    raise ValueError(f"{name} must be a finite number{lower}{upper}, not {value!r}")


def check_whole(config: Any, name: str, low: int, high: int) -> None:
    """Raise ``ValueError`` unless the field is an integer from ``low`` to ``high``."""
    value = getattr(config, name)
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise ValueError(f"{name} must be an integer from {low} to {high}, not {value!r}")


def check_point(config: Any, name: str) -> None:
    """Turn the field into two floats; raise ``ValueError`` unless it holds two numbers within ±1e6, or two NaN."""
    value = getattr(config, name)
    pair = tuple(value) if isinstance(value, Sequence) and not isinstance(value, str) else ()
    numbers = len(pair) == 2 and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in pair)
    if not numbers or not (all(abs(v) <= MAX_PLACE_PX for v in pair) or all(map(math.isnan, pair))):
        raise ValueError(f"{name} must be two numbers within ±1e6, x and y, not {value!r}")
    object.__setattr__(config, name, (float(pair[0]), float(pair[1])))
