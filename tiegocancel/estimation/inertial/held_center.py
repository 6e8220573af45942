"""Hold the last centre that events gave: a gyroscope measures how fast the image turns, never about what."""

from __future__ import annotations

import math

from tiegocancel.estimation.estimate import MotionEstimate

__all__ = ["HeldCenter"]


class HeldCenter:
    """Remember centre, its deviation and the quality of the last estimate from events that was fit for use."""

    def __init__(self, center_px: tuple[float, float], sigma_px: float = math.inf) -> None:
        self._center_px = center_px
        self._sigma_px = sigma_px
        self._sharpness = math.nan

    def take(self, estimate: MotionEstimate) -> None:
        """Take the centre of a confident estimate, or of any until there is one."""
        if estimate.confident:
            self._sharpness = estimate.sharpness
        if estimate.has_center and (estimate.confident or not math.isfinite(self._center_px[0])):
            self._center_px = estimate.center_px
            self._sigma_px = estimate.center_sigma_px

    def row(
        self, t_us: int, *, omega_rad_s: float, omega_sigma_rad_s: float, confident: bool, doubt: str
    ) -> MotionEstimate:
        """Return an estimate with the centre that is held."""
        return MotionEstimate(
            t_us=t_us,
            center_px=self._center_px,
            omega_rad_s=omega_rad_s,
            center_sigma_px=self._sigma_px,
            omega_sigma_rad_s=omega_sigma_rad_s,
            sharpness=self._sharpness,
            confident=confident,
            doubt=doubt,
        )
