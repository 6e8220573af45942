"""Find the circle of a rim or marker in the events of the past, and say when there is none (thesis §3.6, step 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.circle.cloud import EventCloud
from tiegocancel.estimation.circle.config import CircleConfig
from tiegocancel.estimation.circle.fit import CircleFit, NoCircle, arc_rad, fit_circle
from tiegocancel.estimation.circle.ransac import RansacConfig, fit_circle_among
from tiegocancel.estimation.circle.ring import Ring

__all__ = ["WHOLE_ARC_RAD", "CircleSearch"]

WHOLE_ARC_RAD = 5.5
"""Arc beyond which a longer cloud adds nothing: the rest of a turn."""

_OUTLIER = 4.5
"""Residual, in units of their root mean square, that no event of a band has; the robust fit leaves none beyond 3."""


class CircleSearch:
    """Fit one circle an update to the accumulated cloud, over the shortest stretch that spans about a turn.

    The stretch begins at the window and is doubled from update to update while the arc is too short, or while it
    shows no rim (what is none over one stretch may be one over the next longer), and shrinks when less would do.
    """

    def __init__(self, config: CircleConfig, rng: np.random.Generator) -> None:
        self._config = config
        self._rng = rng
        self._ransac = RansacConfig(tolerance_px=config.tolerance_px, widest_share=min(2.0 * config.widest_share, 0.99))
        slice_events = -(-config.cloud_events * config.step_us // config.window_us)
        self._cloud = EventCloud(span_us=config.center_window_us, slice_events=slice_events)
        self._spans_us = [config.window_us]
        while self._spans_us[-1] < config.center_window_us:
            self._spans_us.append(min(2 * self._spans_us[-1], config.center_window_us))
        self._span = 0

    def add(self, stop_us: int, x: NDArray[np.uint16], y: NDArray[np.uint16]) -> None:
        """Take the events of the step that ends before ``stop_us``."""
        self._cloud.add(stop_us, x, y)

    def fit(self, t_us: int) -> tuple[CircleFit | NoCircle, int]:
        """Return the circle at ``t_us``, or why the events show neither rim nor marker, and the stretch used in µs."""
        span_us = self._spans_us[self._span]
        age_us = self._cloud.age_us(t_us) + self._config.step_us
        longer = self._span + 1 < len(self._spans_us) and age_us > span_us
        points = self._cloud.after(t_us - span_us, self._config.cloud_events)
        if self._config.ransac:
            found = fit_circle_among(points, rng=self._rng, method=self._config.method, config=self._ransac)
        else:
            found = fit_circle(points, method=self._config.method)
        fault = found.reason if isinstance(found, NoCircle) else self._fault(found, points)
        if isinstance(found, NoCircle) or fault:
            self._span = self._span + 1 if longer else 0
            return NoCircle(reason=fault), span_us
        if found.arc_rad < WHOLE_ARC_RAD:
            self._span += longer
        elif self._span:
            shorter = self._cloud.after(t_us - self._spans_us[self._span - 1], self._config.cloud_events)
            bearings = Ring.of(found, t_us, least_reach_px=self._config.tolerance_px).near(shorter)[1]
            self._span -= arc_rad(bearings) >= WHOLE_ARC_RAD
        return found, min(span_us, age_us)

    def _fault(self, fit: CircleFit, points: NDArray[np.float64]) -> str:
        """Return why the events are no rim and no marker, empty if they are."""
        config = self._config
        if fit.inlier_share < config.least_inlier_share:
            return f"no rim or marker: {fit.inlier_share:.0%} of the events lie near one circle"
        if fit.rms_px > config.widest_share * fit.radius_px:
            return f"no rim: events {fit.rms_px:.0f} px from a circle of {fit.radius_px:.0f} px"
        if fit.worst_px > _OUTLIER * fit.rms_px:
            return f"outliers up to {fit.worst_px:.0f} px from the circle pull a fit without RANSAC"
        beside = Ring.of(fit, 0, least_reach_px=config.tolerance_px).beside(points)
        if beside > config.most_beside:
            return f"no rim: beside the circle lie {beside:.0%} as many events as on it"
        return ""
