"""Describe a second mover that moves nearly with the background: a hand that rides on the disc."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.check import check_number
from tiegocancel.scene.layout import FIT, MAX_SIZE_PX, Layout
from tiegocancel.scene.mover import MoverConfig
from tiegocancel.scene.rig import RigConfig

__all__ = ["CompanionConfig", "Ride"]


@dataclass(frozen=True, kw_only=True, slots=True)
class CompanionConfig:
    """Set a hand of ``size_px`` length that turns about the disc's middle as the disc does, and a little faster.

    At its own middle, ``radius_px`` from the disc's, it passes over the print at ``relative_px_s`` (positive in the
    sense of a positive ω); elsewhere on it in proportion to the distance from the disc's middle. At 0 it is a part of
    the disc in all but its label. ``phase_rad`` is where it starts. Lengths that are not given fit the sensor: on
    1280×720 the hand measures 72 px and rides 150 px from the middle.
    """

    enabled: bool = False
    size_px: float = FIT
    radius_px: float = FIT
    relative_px_s: float = 100.0
    phase_rad: float = -2.0
    reflectance: float = 0.30

    def __post_init__(self) -> None:
        check_number(self, "size_px", 0.0, MAX_SIZE_PX, above=True, fit=True)
        check_number(self, "radius_px", 0.0, MAX_SIZE_PX, above=True, fit=True)
        check_number(self, "relative_px_s", -1e6, 1e6)
        check_number(self, "phase_rad", -1e6, 1e6)
        check_number(self, "reflectance", 0.01, 1.0)

    def fitted(self, layout: Layout) -> CompanionConfig:
        """Return the companion with every length settled."""
        return replace(
            self,
            size_px=layout.length(self.size_px, 72.0),
            radius_px=layout.length(self.radius_px, 150.0),
        )

    @property
    def hand(self) -> MoverConfig:
        """The picture that is drawn."""
        return MoverConfig(enabled=self.enabled, size_px=self.size_px, reflectance=self.reflectance)

    def speed_px_s(self, rim_px_s: float, rim_radius_px: float) -> float:
        """Return a bound of the speed of any of its points while the disc's rim moves at ``rim_px_s`` at most."""
        reach = self.radius_px + 0.8 * self.size_px + 6.0
        return reach * (rim_px_s / rim_radius_px + abs(self.relative_px_s) / self.radius_px)


class Ride:
    """Carry the companion along with the disc, whatever that does."""

    def __init__(self, config: CompanionConfig, rig: RigConfig) -> None:
        self._config, self._rig = config, rig

    def angle_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return by how much the hand is turned, float64[n] in rad: it points along its way."""
        return self._phase(time_s) + 0.5 * math.pi

    def center_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the position of the hand's middle float64[n, 2] in px."""
        phase = self._phase(time_s)
        arm = self._config.radius_px * np.stack([np.cos(phase), np.sin(phase)], axis=-1)
        center: NDArray[np.float64] = self._rig.center_at(time_s) + arm
        return center

    def _phase(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the angle of the arm from the disc's middle."""
        ahead = self._config.relative_px_s / self._config.radius_px * time_s
        return self._config.phase_rad + self._rig.angle_at(time_s) + ahead
