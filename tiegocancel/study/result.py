"""Hold what a run found, and give it as one JSON object."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from tiegocancel.firmware_sim.state import StateBits, state_bits
from tiegocancel.matching.canceller import Counters
from tiegocancel.metrics import DiscRegion, DisplacementHistogram, RateProfile, Tally
from tiegocancel.motion.trajectory import RotationTrajectory
from tiegocancel.study.settings import Settings
from tiegocancel.study.stretch import Densest

__all__ = ["INTERRUPTED", "RunResult"]

INTERRUPTED = "interrupted"
"""What ``fault`` says when the user ended the run."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunResult:
    """One pass over a stream: the canceller's tally, its controls beside it, and what the figures need.

    ``fault`` is the line of the error that ended the stream early, if one did; the rest describes what came before.
    ``seconds`` is the time inside ``Canceller.process``; ``disc_seen``: a disc was declared or found, otherwise
    ``region`` is the circle that holds 99 % of the events.
    """

    settings: Settings
    trajectory: RotationTrajectory
    region: DiscRegion
    disc_seen: bool
    width: int
    height: int
    first_us: int
    last_us: int
    tally: Tally
    controls: dict[str, Tally]
    displacement: DisplacementHistogram
    rate: RateProfile
    picture: Densest
    slice: Densest
    counters: Counters
    seconds: float
    fault: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Time from the first to the last event in s."""
        return (self.last_us - self.first_us) * 1e-6

    @property
    def lead_region(self) -> bool | None:
        """Which region the headline is about: the disc (``True``), or everything (``None``) where none is seen."""
        return True if self.disc_seen and self.tally.share(on_disc=True).events else None

    @property
    def state(self) -> StateBits:
        """What a device must hold for this configuration and sensor."""
        return state_bits(self.settings.cancel, width=self.width, height=self.height)

    @property
    def rim_displacement_px(self) -> float:
        """How far the rim of the disc moves within the horizon: the chord ``2·r·|sin(ωΔt/2)|`` (eq. 4.7)."""
        angle = self.omega_rad_s * self.settings.cancel.horizon_us * 1e-6
        return abs(2 * self.region.radius_px * math.sin(angle / 2))

    @property
    def omega_rad_s(self) -> float:
        """Mean angular velocity over the events' span."""
        return self.trajectory.mean(start_us=self.first_us, stop_us=self.last_us)[1]

    def to_json(self) -> dict[str, Any]:
        """Return the numbers of the report, warm-up excluded from every ratio."""
        center, omega = self.trajectory.mean(start_us=self.first_us, stop_us=self.last_us)
        share = self.tally.share()
        return {
            "events": self.counters.events,
            "suppressed": self.counters.suppressed,
            "residual": self.counters.events - self.counters.suppressed,
            "cancellation_ratio": share.ratio,
            "cancellation_ratio_pairs": share.ratio_pairs,
            "controls": {name: control.share().ratio for name, control in self.controls.items()},
            "regions": {
                name: {
                    "events": self.tally.share(on_disc=on_disc).events,
                    "cancellation_ratio": self.tally.share(on_disc=on_disc).ratio,
                    "cancellation_ratio_pairs": self.tally.share(on_disc=on_disc).ratio_pairs,
                    "controls": {key: tally.share(on_disc=on_disc).ratio for key, tally in self.controls.items()},
                    **self.tally.densities()[name],
                }
                for name, on_disc in (("disc", True), ("background", False))
            },
            "disc_center_px": [float(value) for value in self.region.center_px],
            "disc_radius_px": self.region.radius_px,
            "disc_seen": self.disc_seen,
            "radial_profile": {
                "ring_edges_px": self.region.ring_edges_px.tolist(),
                **dict(zip(("area_px", "events", "residual"), (c.tolist() for c in self.tally.radial()), strict=True)),
            },
            "signal_to_noise": self.tally.signal_to_noise(),
            "motion": {
                "center_px": [float(center[0]), float(center[1])],
                "omega_rad_s": float(omega),
                "source": self.trajectory.source,
                "rim_displacement_px": self.rim_displacement_px,
            },
            "selectivity": self.tally.selectivity(),
            "selectivity_of_controls": {name: control.selectivity() for name, control in self.controls.items()},
            "displacement": self.displacement.summary(),
            "counters": dict(self.counters),
            "warm_up": {
                "us": self.settings.cancel.warm_up_us,
                "events_left_out": self.tally.warm_up_events,
                "events_counted": share.events,
            },
            "sensor": {"width": self.width, "height": self.height},
            "first_us": self.first_us,
            "last_us": self.last_us,
            "duration_s": self.duration_s,
            "state": {
                "ring_bits": self.state.ring,
                "table_bits": self.state.table,
                "time_bits": self.state.time,
                "kib": self.state.total_kib,
            },
            "seconds": self.seconds,
            "events_per_second": self.counters.events / self.seconds if self.seconds else 0.0,
            "fault": self.fault,
            "notes": list(self.notes),
        }
