"""Hold what is wrong with a motion, how sure that is, and take it off."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

from tiegocancel.estimation.diagnosis.coincidence import Ring
from tiegocancel.motion.rotation import RotationTrajectory

__all__ = ["Diagnosis", "Kind"]

Kind = Literal["none", "centre", "omega", "both", "unknown"]
"""Which bias stands out of its spread; ``unknown`` where predictions and real events do not coincide."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """What is wrong with a motion: estimate minus truth, with one standard deviation each.

    ``center_bias_px`` (x, y) and ``omega_bias_rad_s`` are means over the events that were looked at, NaN with ``∞``
    beside it where ``kind`` is ``unknown``. ``share_explained`` is the share of predictions that meet a real event,
    beyond chance, once the biases are taken off. ``correction`` (x, y, ω) is what :meth:`corrected` takes off: the
    biases that ``kind`` names, estimated with the others at 0. ``center_px`` and ``omega_rad_s`` are the motion as it
    was judged; ``text`` says it in one sentence. ``rings`` are eight rings about the centre, each fitted by itself.
    """

    kind: Kind
    text: str
    center_px: tuple[float, float]
    omega_rad_s: float
    horizon_us: int
    center_bias_px: tuple[float, float] = (math.nan, math.nan)
    omega_bias_rad_s: float = math.nan
    center_sigma_px: tuple[float, float] = (math.inf, math.inf)
    omega_sigma_rad_s: float = math.inf
    correction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    share_explained: float = 0.0
    predictions: int = 0
    rings: tuple[Ring, ...] = ()

    def corrected(self, trajectory: RotationTrajectory) -> RotationTrajectory:
        """Return the trajectory without the biases: the same amounts off every row, ``text`` among its notes."""
        if self.correction == (0.0, 0.0, 0.0):
            return trajectory
        right, down, omega = self.correction
        return replace(
            trajectory,
            center_px=trajectory.center_px - [right, down],
            omega_rad_s=trajectory.omega_rad_s - omega,
            source=trajectory.source if trajectory.source.endswith(", refined") else f"{trajectory.source}, refined",
            notes=(*trajectory.notes, f"refined: {self.text}"),
        )

    def summary(self) -> dict[str, Any]:
        """Return the numbers for JSON; ``None`` where nothing is known."""
        known = self.kind != "unknown"
        return {
            "kind": self.kind,
            "text": self.text,
            "center_bias_px": list(self.center_bias_px) if known else None,
            "center_sigma_px": list(self.center_sigma_px) if known else None,
            "omega_bias_rad_s": self.omega_bias_rad_s if known else None,
            "omega_sigma_rad_s": self.omega_sigma_rad_s if known else None,
            "share_explained": self.share_explained,
            "predictions": self.predictions,
            "horizon_us": self.horizon_us,
        }
