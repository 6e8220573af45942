"""Describe the turning disc and its motion: its path, and the clock that runs it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tiegocancel.scene.check import check_number, check_point, check_whole
from tiegocancel.scene.clock import halting_pace, halting_time
from tiegocancel.scene.layout import FIT, FIT_POINT, MAX_SIZE_PX, Layout

__all__ = ["RigConfig"]

MAX_WOBBLE_PX = 512.0

FAR_PX = float(1 << 20)
"""Where a disc that moves sideways without turning has its instantaneous centre: too far away to tell."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RigConfig:
    """Set geometry, speed and print of the disc; the defaults follow the thesis's recording (chapter 6).

    Lengths that are not given fit the sensor: on 1280×720 the centre is (664.6, 336.9) px and the radius 264 px.
    ``omega_rad_s`` is the speed at time 0, positive when x turns towards y; ``ripple`` the amplitude of a sinusoidal
    part of it as a share of ``omega_rad_s``; ``ramp_rad_s2`` a constant acceleration. ``wobble_px`` are the half-axes,
    in x and y, of the ellipse about ``center_px`` that the centre of the disc runs along, starting at its right end,
    ``wobble_hz`` times a second (positive turns x towards y). ``stop_go_hz`` times a second the whole rig, wobble
    included, slows down within ``stop_ramp_s``, rests for ``stop_share`` of the period and starts again as smoothly
    (0: it never stops); its ripple, ramp and wobble go by a clock of its own that rests meanwhile.
    Without ``pages`` the disc is bare wood but for its markers and the hub.
    ``line_period_px`` is the distance of the contour lines, ``shape_pitch_px`` that of the shapes; ``blur_px`` the
    deviation of the lens's point spread. Reflectances are shares of the light; the log-ratio of paper and ink sets
    the events an edge makes.
    """

    center_px: tuple[float, float] = FIT_POINT
    radius_px: float = FIT
    omega_rad_s: float = 3.6
    ripple: float = 0.0
    ripple_hz: float = 2.0
    ramp_rad_s2: float = 0.0
    wobble_px: tuple[float, float] = (0.0, 0.0)
    wobble_hz: float = 2.0
    stop_go_hz: float = 0.0
    stop_share: float = 0.3
    stop_ramp_s: float = 0.02
    pages: bool = True
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
        check_point(self, "wobble_px")
        if not all(0.0 <= axis <= MAX_WOBBLE_PX for axis in self.wobble_px):
            raise ValueError(f"wobble_px must be two numbers from 0 to {MAX_WOBBLE_PX:g}, not {self.wobble_px!r}")
        check_number(self, "wobble_hz", -1e3, 1e3)
        check_number(self, "stop_go_hz", 0.0, 1e3)
        check_number(self, "stop_share", 0.0, 1.0)
        check_number(self, "stop_ramp_s", 1e-4, 1e3)
        if self.stop_go_hz * 2.0 * self.stop_ramp_s + self.stop_share > 1.0 and self.stop_go_hz > 0.0:
            raise ValueError(
                f"stop_ramp_s {self.stop_ramp_s!r}, twice, and stop_share {self.stop_share!r} of the period must fit "
                f"into the {1.0 / self.stop_go_hz:g} s of stop_go_hz {self.stop_go_hz!r}"
            )
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
        return self._pace(time_s) * self._own_omega(self._own_time(time_s))

    def angle_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the disc's angle in rad: the exact integral of :meth:`omega_at` from 0."""
        own_s = self._own_time(time_s)
        rate = math.tau * self.ripple_hz
        swing = own_s + self.ripple * (1.0 - np.cos(rate * own_s)) / rate
        return self.omega_rad_s * swing + 0.5 * self.ramp_rad_s2 * own_s**2

    def center_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the middle of the disc float64[n, 2] in px."""
        phase = math.tau * self.wobble_hz * self._own_time(time_s)
        path = np.stack([np.cos(phase), np.sin(phase)], axis=-1)
        center: NDArray[np.float64] = np.asarray(self.center_px) + np.asarray(self.wobble_px) * path
        return center

    def motion_at(self, time_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the instantaneous centre of rotation float64[n, 2] in px and the angular velocity float64[n].

        A point x of the disc moves at ω·J(x − c) + ċ, with J(x, y) = (−y, x) and c the middle of the disc. That is the
        turn ω·J(x − q) about q = c + J ċ / ω, the place where the velocity is 0: what an observer of the motion finds
        and a predictor needs. Both ċ and ω carry the pace of a stop, so q stays where it is while the rig rests. A
        disc that drifts without turning is stated as the turn about a point ``FAR_PX`` away that moves it alike.
        """
        own_s = self._own_time(time_s)
        omega = self._own_omega(own_s)
        rate = math.tau * self.wobble_hz
        axis_x, axis_y = self.wobble_px
        drift_x, drift_y = -rate * axis_x * np.sin(rate * own_s), rate * axis_y * np.cos(rate * own_s)
        slowest = np.hypot(drift_x, drift_y) / FAR_PX
        omega = np.where(np.abs(omega) >= slowest, omega, np.copysign(slowest, omega))
        arm = np.stack([-drift_y, drift_x], -1) / np.where(omega == 0.0, 1.0, omega)[:, None]
        return self.center_at(time_s) + arm, self._pace(time_s) * omega

    @property
    def wobbles(self) -> bool:
        """Tell whether the middle of the disc ever leaves its place."""
        return any(self.wobble_px)

    @property
    def is_steady(self) -> bool:
        """Tell whether centre and angular velocity never change."""
        turns = self.omega_rad_s != 0.0
        even = self.ramp_rad_s2 == 0.0 and not (turns and (self.ripple > 0.0 or self.stop_go_hz > 0.0))
        return even and (not self.wobbles or self.wobble_hz == 0.0)

    def rim_speed_px_s(self, start_s: float, stop_s: float) -> float:
        """Return a bound of the speed of any point of the disc from ``start_s`` to ``stop_s``."""
        ends_s = self._own_time(np.array([start_s, stop_s]))
        fastest = (
            float(np.abs(self.omega_rad_s + self.ramp_rad_s2 * ends_s).max()) + abs(self.omega_rad_s) * self.ripple
        )
        return self.radius_px * fastest + math.tau * abs(self.wobble_hz) * max(self.wobble_px)

    def _own_omega(self, own_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the angular velocity per second of the rig's own clock."""
        swing = 1.0 + self.ripple * np.sin(math.tau * self.ripple_hz * own_s)
        return self.omega_rad_s * swing + self.ramp_rad_s2 * own_s

    def _own_time(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the rig's own clock shows."""
        return halting_time(time_s, **self._halt) if self.stop_go_hz > 0.0 else time_s

    def _pace(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how fast the rig's own clock runs."""
        return halting_pace(time_s, **self._halt) if self.stop_go_hz > 0.0 else np.ones(np.shape(time_s))

    @property
    def _halt(self) -> dict[str, float]:
        """Lengths of a stop for the clock."""
        period_s = 1.0 / self.stop_go_hz
        return {"period_s": period_s, "rest_s": self.stop_share * period_s, "ramp_s": self.stop_ramp_s}
