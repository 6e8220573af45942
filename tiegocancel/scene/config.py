"""Gather every setting of the built-in scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tiegocancel.events import MAX_SIDE_PX
from tiegocancel.scene.check import check_number, check_whole
from tiegocancel.scene.companion import CompanionConfig
from tiegocancel.scene.layout import Layout
from tiegocancel.scene.mover import MoverConfig
from tiegocancel.scene.rig import RigConfig
from tiegocancel.scene.sensor import SensorConfig
from tiegocancel.scene.steps import BLOCK_SPAN_S, step_for

__all__ = ["SceneConfig"]

STEPS_PER_FLICKER = 25


@dataclass(frozen=True, kw_only=True, slots=True)
class SceneConfig:
    """Set sensor size, disc, movers, pixel model, light and time step.

    ``mover`` passes before ``companion``, which is off unless it is enabled, and that before the disc of ``rig``. All
    are fitted to the sensor: lengths left open get their values here. ``step_px`` is the
    farthest that anything moves between two samples of the intensity; ``flicker_depth`` the amplitude of the light's
    modulation at ``flicker_hz`` as a share of its mean (0: steady light). Raise ``ValueError`` for values out of range.
    """

    width: int = 1280
    height: int = 720
    rig: RigConfig = field(default_factory=RigConfig)
    mover: MoverConfig = field(default_factory=MoverConfig)
    companion: CompanionConfig = field(default_factory=CompanionConfig)
    sensor: SensorConfig = field(default_factory=SensorConfig)
    flicker_depth: float = 0.0
    flicker_hz: float = 100.0
    step_px: float = 0.5

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            check_whole(self, name, 1, MAX_SIDE_PX)
        if self.width * self.height > 1 << 26:
            raise ValueError(f"the scene holds at most 2^26 pixels, not {self.width} × {self.height}")
        kinds = {"rig": RigConfig, "mover": MoverConfig, "companion": CompanionConfig, "sensor": SensorConfig}
        for name, kind in kinds.items():
            if not isinstance(getattr(self, name), kind):
                raise TypeError(f"{name} must be a {kind.__name__}, not {type(getattr(self, name)).__name__}")
        layout = Layout(width=self.width, height=self.height)
        object.__setattr__(self, "rig", self.rig.fitted(layout))
        object.__setattr__(self, "mover", self.mover.fitted(layout))
        object.__setattr__(self, "companion", self.companion.fitted(layout))
        check_number(self, "flicker_depth", 0.0, 0.95)
        check_number(self, "flicker_hz", 0.1, 4000.0)
        check_number(self, "step_px", 0.05, 2.0)

    @classmethod
    def disc(cls, *, width: int = 1280, height: int = 720, omega_rad_s: float = 3.6, mover: bool = True) -> SceneConfig:
        """Return the thesis's rig, fitted to the sensor, with the two settings that change most often."""
        rig, hand = RigConfig(omega_rad_s=omega_rad_s), MoverConfig(enabled=mover)
        return cls(width=width, height=height, rig=rig, mover=hand)

    def step_us(self, start_s: float = 0.0) -> int:
        """Return the time between two samples in the block that begins at ``start_s``.

        It is short enough for ``step_px`` at the fastest that the disc gets within the block, and for the flicker.
        """
        rim_px_s = self.rig.rim_speed_px_s(start_s, start_s + BLOCK_SPAN_S)
        speed_px_s = max(rim_px_s, self.mover.speed_px_s if self.mover.enabled else 0.0)
        if self.companion.enabled:
            speed_px_s = max(speed_px_s, self.companion.speed_px_s(rim_px_s, self.rig.radius_px))
        longest_us = 1e6 / (STEPS_PER_FLICKER * self.flicker_hz) if self.flicker_depth > 0.0 else math.inf
        return step_for(self.step_px, speed_px_s, longest_us)
