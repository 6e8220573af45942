"""Describe the turning disc and its motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.check import check_number, check_point, check_whole
from tiegocancel.scene.layout import FIT, FIT_POINT, MAX_SIZE_PX, Layout

__all__ = ["RigConfig"]


@dataclass(frozen=True, kw_only=True, slots=True)
class RigConfig:
    """Set geometry, speed and print of the disc; the defaults follow the thesis's recording (chapter 6).

    Lengths that are not given fit the sensor: on 1280×720 the centre is (664.6, 336.9) px and the radius 264 px.
    ``omega_rad_s`` is the speed at time 0, positive when x turns towards y; ``ripple`` the amplitude of a sinusoidal
    part of it as a share of ``omega_rad_s``; ``ramp_rad_s2`` a constant acceleration. ``line_period_px`` is the
    distance of the contour lines, ``shape_pitch_px`` that of the shapes; ``blur_px`` the deviation of the lens's
    point spread. Reflectances are shares of the light; the log-ratio of paper and ink sets the events an edge makes.
    """

    center_px: tuple[float, float] = FIT_POINT
    radius_px: float = FIT
    omega_rad_s: float = 3.6
    ripple: float = 0.0
    ripple_hz: float = 2.0
    ramp_rad_s2: float = 0.0
    line_period_px: float = FIT
    shape_pitch_px: float = FIT
    blur_px: float = 0.6
    paper_reflectance: float = 0.86
    ink_reflectance: float = 0.545
    pattern_seed: int = 3

    def __post_init__(self) -> None:
        check_point(self, "center_px")
        for name in ("radius_px", "line_period_px", "shape_pitch_px"):
            check_number(self, name, 0.0, MAX_SIZE_PX, above=True, fit=True)
        check_number(self, "ripple_hz", 0.0, 1e6, above=True)
        for name in ("omega_rad_s", "ramp_rad_s2"):
            check_number(self, name, -1e6, 1e6)
        check_number(self, "ripple", 0.0, 1.0)
        check_number(self, "blur_px", 0.0, 20.0)
        for name in ("paper_reflectance", "ink_reflectance"):
            check_number(self, name, 0.01, 1.0)
        check_whole(self, "pattern_seed", 0, 2**32 - 1)

    def fitted(self, layout: Layout) -> RigConfig:
        """Return the rig with every length settled."""
        return replace(
            self,
            center_px=layout.point(self.center_px, (664.6, 336.9)),
            radius_px=layout.length(self.radius_px, 264.0),
            line_period_px=layout.detail(self.line_period_px, 21.0),
            shape_pitch_px=layout.detail(self.shape_pitch_px, 28.0),
        )

    def omega_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the angular velocity in rad/s at each time."""
        swing = 1.0 + self.ripple * np.sin(math.tau * self.ripple_hz * time_s)
        return self.omega_rad_s * swing + self.ramp_rad_s2 * time_s

    def angle_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the disc's angle in rad: the exact integral of :meth:`omega_at` from 0."""
        rate = math.tau * self.ripple_hz
        swing = time_s + self.ripple * (1.0 - np.cos(rate * time_s)) / rate
        return self.omega_rad_s * swing + 0.5 * self.ramp_rad_s2 * time_s**2

    @property
    def is_steady(self) -> bool:
        """Tell whether the angular velocity never changes."""
        return self.ramp_rad_s2 == 0.0 and (self.ripple == 0.0 or self.omega_rad_s == 0.0)

    @property
    def rim_speed_px_s(self) -> float:
        """Speed of the rim at its fastest within the first second."""
        return self.radius_px * (abs(self.omega_rad_s) * (1.0 + self.ripple) + abs(self.ramp_rad_s2))
