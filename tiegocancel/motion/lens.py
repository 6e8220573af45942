"""Bend and straighten directions as a lens does: two distortion models, in normalised coordinates."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["COEFFICIENTS", "LensModel", "bend", "straighten"]

LensModel = Literal["radtan", "equidistant"]

COEFFICIENTS: dict[LensModel, tuple[str, ...]] = {
    "radtan": ("k1", "k2", "p1", "p2", "k3"),
    "equidistant": ("k1", "k2", "k3", "k4"),
}
"""Names of the coefficients of each model, in the order of calibration files."""

Floats = NDArray[np.float64]

_WIDEST = {"radtan": 1e3, "equidistant": 0.5 * np.pi - 1e-3}
_STEPS = 12
_CLOSE = 1e-10
"""Largest error of an inverse; at a focal length of 10^4 px that is 10^-6 px."""


def bend(model: LensModel, coefficients: tuple[float, ...], x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return where the lens shows the directions ``(x, y)`` float64[n] = (X/Z, Y/Z); NaN beyond its field.

    ``radtan`` (Brown; ROS ``plumb_bob``): with ``s = x² + y²`` and ``L = 1 + k1·s + k2·s² + k3·s³``,
    ``(x·L + 2·p1·x·y + p2·(s + 2x²), y·L + p1·(s + 2y²) + 2·p2·x·y)``. ``equidistant`` (Kannala and Brandt 2006): a
    direction at the angle θ from the axis appears at the radius ``θ·(1 + k1·θ² + k2·θ⁴ + k3·θ⁶ + k4·θ⁸)``. The field
    ends where that radius would shrink again, because past it two directions share one place.
    """
    limit, _, _ = _field(model, coefficients)
    with np.errstate(all="ignore"):
        radius = np.hypot(x, y)
        if model == "radtan":
            outside = ~(radius <= limit)
            bent_x, bent_y = _radtan(coefficients, x, y)[:2]
        else:
            # NumPy's arctangent may treat a whole vector differently when one lane holds no number.
            angle = np.arctan(np.where(np.isnan(radius), 0.0, radius))
            outside = ~(angle <= limit)
            scale = np.where(radius > 0.0, _radial(coefficients, angle)[0] / radius, 1.0)
            bent_x, bent_y = x * scale, y * scale
        return np.where(outside, np.nan, bent_x), np.where(outside, np.nan, bent_y)


def straighten(model: LensModel, coefficients: tuple[float, ...], x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the directions that the lens shows at ``(x, y)`` float64[n]: the inverse of :func:`bend`, to 10^-10.

    NaN where no direction of the field is shown. The radius is looked up and refined by Newton's method, then both
    coordinates with the tangential terms, all in a fixed number of steps: each element depends on itself alone.
    """
    limit, grid, shown = _field(model, coefficients)
    with np.errstate(all="ignore"):
        radius = np.hypot(x, y)
        reach = np.interp(radius, shown, grid)
        for _ in range(_STEPS):
            value, slope = _radial(_radial_of(model, coefficients), reach)
            reach = np.clip(reach - (value - radius) / slope, 0.0, limit)
        scale = np.where(radius > 0.0, (np.tan(reach) if model == "equidistant" else reach) / radius, 1.0)
        straight_x, straight_y = x * scale, y * scale
        if model == "radtan" and (coefficients[2] or coefficients[3]):
            for _ in range(_STEPS):
                bent_x, bent_y, xx, xy, yy = _radtan(coefficients, straight_x, straight_y)
                miss_x, miss_y, size = bent_x - x, bent_y - y, xx * yy - xy * xy
                straight_x = straight_x - (yy * miss_x - xy * miss_y) / size
                straight_y = straight_y - (xx * miss_y - xy * miss_x) / size
        bent_x, bent_y = bend(model, coefficients, straight_x, straight_y)
        lost = ~(np.hypot(bent_x - x, bent_y - y) <= _CLOSE)
        return np.where(lost, np.nan, straight_x), np.where(lost, np.nan, straight_y)


def _radtan(coefficients: tuple[float, ...], x: Floats, y: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return the place ``(x, y)`` and its derivatives ∂x/∂x, ∂x/∂y = ∂y/∂x, ∂y/∂y."""
    k1, k2, p1, p2, k3 = coefficients
    square = x * x + y * y
    stretch = 1.0 + square * (k1 + square * (k2 + square * k3))
    change = 2.0 * (k1 + square * (2.0 * k2 + square * (3.0 * k3)))
    cross = x * y
    return (
        x * stretch + 2.0 * p1 * cross + p2 * (square + 2.0 * x * x),
        y * stretch + p1 * (square + 2.0 * y * y) + 2.0 * p2 * cross,
        stretch + x * x * change + 2.0 * p1 * y + 6.0 * p2 * x,
        cross * change + 2.0 * p1 * x + 2.0 * p2 * y,
        stretch + y * y * change + 6.0 * p1 * y + 2.0 * p2 * x,
    )


def _radial_of(model: LensModel, coefficients: tuple[float, ...]) -> tuple[float, ...]:
    """Return the coefficients of the radial polynomial alone."""
    return (coefficients[0], coefficients[1], coefficients[4]) if model == "radtan" else coefficients


def _radial(coefficients: tuple[float, ...], reach: Floats) -> tuple[Floats, Floats]:
    """Return ``v·(1 + k1·v² + k2·v⁴ + …)`` and its derivative."""
    square = reach * reach
    value, slope = np.zeros_like(reach), np.zeros_like(reach)
    for power in range(len(coefficients), 0, -1):
        value = square * (value + coefficients[power - 1])
        slope = square * (slope + (2 * power + 1) * coefficients[power - 1])
    return reach * (1.0 + value), 1.0 + slope


@lru_cache(maxsize=16)
def _field(model: LensModel, coefficients: tuple[float, ...]) -> tuple[float, Floats, Floats]:
    """Return how far the field reaches (radius, or angle for ``equidistant``), and a table of what is shown where."""
    radial = _radial_of(model, coefficients)
    # The derivative 1 + 3·k1·v² + 5·k2·v⁴ + … is zero where v⁻² is a root of the reversed polynomial, whose leading
    # coefficient is one: coefficients that are all but zero do no harm there.
    roots = np.roots([1.0, *((2 * power + 3) * value for power, value in enumerate(radial))])
    turns = [float(root.real) ** -0.5 for root in roots if abs(root.imag) < 1e-9 * abs(root) and root.real > 1e-12]
    limit = min([*turns, _WIDEST[model]])
    # Even steps of the angle from the axis: fine near the axis, and few far out.
    far = np.arctan(limit) if model == "radtan" else limit
    angles = np.linspace(0.0, far, 4097)
    grid = np.tan(angles) if model == "radtan" else angles
    grid[-1] = limit
    return limit, grid, _radial(radial, grid)[0]
