"""Gather the settings of the estimate by circle fits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import get_args

import numpy as np

from tiegocancel.estimation.circle.fit import CircleMethod
from tiegocancel.estimation.circle.marker import Differencing

__all__ = ["CircleConfig"]

_MAX_SLICES = 100_000


@dataclass(frozen=True, slots=True, kw_only=True)
class CircleConfig:
    """Set windows, circle fit, differencing, smoothing and what is refused.

    Every ``step_us`` ω is measured on the last ``window_us``. The centre is fitted (``method``, with or without
    ``ransac`` at ``tolerance_px``) to at most ``cloud_events`` events of the last ``window_us``, doubled up to
    ``center_window_us`` until they span nearly a turn; ``least_arc_rad`` of it, run along by the marker, is the least
    that is used. No rim or marker is seen where fewer than ``least_inlier_share`` of the events lie on one circle, or
    their distances from it scatter by more than ``widest_share`` of its radius, or where the two flanks of the band,
    together as wide as itself, hold more than ``most_beside`` of its events. ``differencing`` ``marker`` needs slots
    of ``slot_us`` in which the mean bearing is ``least_resultant`` long; ``events`` is (3.4) as printed.
    ``center_smoothing`` and ``omega_smoothing`` are the α of (3.7), in (0, 1]: 1 does not smooth. Smoothing and window
    delay ω by about ``window_us / 2 + step_us · (1 − α) / α``. Raise ``ValueError`` naming field and value.
    """

    window_us: int = 20_000
    step_us: int = 2_000
    center_window_us: int = 2_000_000
    slot_us: int = 500
    method: CircleMethod = "taubin"
    ransac: bool = True
    tolerance_px: float = 4.0
    differencing: Differencing = "marker"
    center_smoothing: float = 0.2
    omega_smoothing: float = 0.3
    cloud_events: int = 2_000
    least_arc_rad: float = 2.3
    least_inlier_share: float = 0.5
    widest_share: float = 0.1
    most_beside: float = 0.2
    least_resultant: float = 0.7
    max_omega_rad_s: float = 1_000.0

    def __post_init__(self) -> None:
        for name, low, high in (
            ("window_us", 100, 10_000_000),
            ("step_us", 10, self.window_us),
            ("center_window_us", self.window_us, self.step_us * _MAX_SLICES),
            ("slot_us", 1, self.window_us // 4),
            ("cloud_events", 100, 100_000),
        ):
            value = getattr(self, name)
            whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
            if not whole or not low <= value <= high:
                raise ValueError(f"{name} must be an integer from {low} to {high}, not {value!r}")
        for name, top in (
            ("tolerance_px", 1000.0),
            ("center_smoothing", 1.0),
            ("omega_smoothing", 1.0),
            ("least_arc_rad", 2.0 * math.pi),
            ("least_inlier_share", 1.0),
            ("widest_share", 0.5),
            ("most_beside", 10.0),
            ("least_resultant", 1.0),
            ("max_omega_rad_s", 0.5 * math.pi * 1e6 / self.slot_us),
        ):
            if not 0.0 < getattr(self, name) <= top:
                raise ValueError(f"{name} must lie in (0, {top:g}], not {getattr(self, name)!r}")
        for name, choices in (("method", get_args(CircleMethod)), ("differencing", get_args(Differencing))):
            if getattr(self, name) not in choices:
                raise ValueError(f"{name} must be one of {', '.join(choices)}, not {getattr(self, name)!r}")
