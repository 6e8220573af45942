"""Name one measurement: which algorithm, under which motion, in which window, with which parameters."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from tiegocancel.matching.config import CancelConfig, Polarity
from tiegocancel.matching.reference import AdaptiveTolerance, ReferenceConfig
from tiegocancel.motion.rotation import RotationTrajectory

__all__ = ["Algorithm", "MotionKind", "Point"]

Algorithm = Literal["printed", "gated", "stream", "chained"]
"""``printed``: Algorithm 1, line by line. ``gated``: the symmetric gate of eq. (4.4), each pair gated by itself.
``stream``: the streaming canceller. ``chained``: the same with memory for every prediction."""

MotionKind = Literal["true", "zero", "reversed"]

_RING = 1 << 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """``window`` counts from 0. ``own``: an event may meet its own prediction. ``isolated``: the window is cut out.

    ``omega_bias_rad_s`` is added to ω, ``center_bias_px`` to the centre's x. ``adaptive`` uses eq. (5.5).
    ``kept`` thins the events to that share. ``detail`` asks for the profiles by radius and the distances too.
    """

    algorithm: Algorithm
    horizon_us: int
    window: int = 0
    motion: MotionKind = "true"
    own: bool = False
    isolated: bool = False
    tolerance_us: int = 1000
    tolerance_px: float = 2.0
    polarity: Polarity = "opposite"
    omega_bias_rad_s: float = 0.0
    center_bias_px: float = 0.0
    adaptive: bool = False
    kept: float = 1.0
    detail: bool = False

    def job(self) -> dict[str, Any]:
        """Return the point as a job of a sweep."""
        return asdict(self)

    def at(self, **changes: Any) -> Point:
        """Return the same point with other values."""
        return replace(self, **changes)

    def cancel_config(self) -> CancelConfig:
        """Return the streaming canceller's parameters."""
        return CancelConfig(
            horizon_us=self.horizon_us,
            tolerance_us=self.tolerance_us,
            tolerance_px=self.tolerance_px,
            polarity=self.polarity,
            ring_capacity=_RING,
        )

    def reference_config(self) -> ReferenceConfig:
        """Return the reference algorithm's parameters."""
        printed = self.algorithm == "printed"
        return ReferenceConfig(
            horizon_us=self.horizon_us,
            tolerance_us=self.tolerance_us,
            tolerance_px=self.tolerance_px,
            adaptive=AdaptiveTolerance() if self.adaptive else None,
            polarity=self.polarity,
            allow_self_match=self.own,
            release="printed" if printed else "closed",
            gate="batch" if printed else "pair",
        )

    def motion_of(self, truth: RotationTrajectory) -> RotationTrajectory:
        """Return the motion that the algorithm is told."""
        if self.motion == "zero":
            return truth.stopped()
        if self.motion == "reversed":
            return truth.reversed()
        if not self.omega_bias_rad_s and not self.center_bias_px:
            return truth
        return replace(
            truth,
            omega_rad_s=truth.omega_rad_s + self.omega_bias_rad_s,
            center_px=np.add(truth.center_px, (self.center_bias_px, 0.0)),
        )
