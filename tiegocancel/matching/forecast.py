"""Predict a whole stream at sub-pixel places, and tell which real events a prediction may meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.config import MAX_TOLERANCE_PX
from tiegocancel.matching.nearest import within
from tiegocancel.matching.reference_config import ReferenceConfig
from tiegocancel.motion.rotation import RotationTrajectory

__all__ = ["Forecast"]


@dataclass(frozen=True, slots=True, eq=False)
class Forecast:
    """The stream as the reference algorithm sees it, columns of one length ``n``.

    ``t_us`` int64, ``x`` ``y`` float64, ``p`` uint8 of the real events; ``ahead_x`` ``ahead_y`` float64 in px and
    ``due_us`` int64 of their predictions (eq. 5.1); ``made`` bool: the prediction lies on the sensor; ``reach_px``
    float64: its spatial gate.
    """

    t_us: NDArray[np.int64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    p: NDArray[np.uint8]
    ahead_x: NDArray[np.float64]
    ahead_y: NDArray[np.float64]
    due_us: NDArray[np.int64]
    made: NDArray[np.bool_]
    reach_px: NDArray[np.float64]

    @classmethod
    def of(cls, events: Events, motion: RotationTrajectory, config: ReferenceConfig) -> Forecast:
        """Rotate every event about the centre of its own time by ``ω·Δt`` (eq. 3.5, 3.6, 5.1).

        A prediction whose pixel, ``floor(v + 0.5)``, lies beyond the sensor is not made.
        """
        cx, cy, theta = motion.turns(events.t, config.horizon_us)
        x, y = events.x.astype(np.float64), events.y.astype(np.float64)
        right, down = x - cx, y - cy
        # From the event's own place and 1 − cos θ = 2 sin²(θ/2): no turn leaves every event exactly where it is.
        sine, half = np.sin(theta), np.sin(0.5 * theta)
        shrink = 2.0 * half * half
        ahead_x, ahead_y = x - shrink * right - sine * down, y + sine * right - shrink * down
        made = (ahead_x >= -0.5) & (ahead_x < events.width - 0.5) & (ahead_y >= -0.5) & (ahead_y < events.height - 0.5)
        reach = np.full(len(events), float(config.tolerance_px))
        if config.adaptive is not None:
            _, _, omega = motion.at(events.t)
            timing_s = config.adaptive.timing_us * 1e-6
            reach = config.adaptive.k * (np.hypot(right, down) * np.abs(omega) * timing_s + config.adaptive.center_px)
            reach = np.minimum(reach, MAX_TOLERANCE_PX)
        return cls(events.t, x, y, events.p, ahead_x, ahead_y, events.t + config.horizon_us, made, reach)

    def __len__(self) -> int:
        return len(self.t_us)

    def admits(
        self, real: NDArray[np.int64], source: NDArray[np.int64], far: NDArray[np.float64], config: ReferenceConfig
    ) -> NDArray[np.bool_]:
        """Tell which pairs of real event and prediction, ``far`` px apart, are candidates at all."""
        fits = np.ones(len(real), np.bool_)
        if config.adaptive is not None:
            fits &= within(far, self.reach_px[source])
        if not config.allow_self_match:
            fits &= real != source
        if config.gate == "pair":
            fits &= np.abs(self.t_us[real] - self.due_us[source]) <= config.tolerance_us
        if config.polarity_first:
            fits &= self.agrees(real, source, config)
        return fits

    def agrees(self, real: NDArray[np.int64], source: NDArray[np.int64], config: ReferenceConfig) -> NDArray[np.bool_]:
        """Apply the polarity rule to pairs of real event and prediction."""
        if config.polarity == "ignore":
            return np.ones(len(real), np.bool_)
        same: NDArray[np.bool_] = self.p[real] == self.p[source]
        return same if config.polarity == "opposite" else ~same
