"""Hold what a run found, and give it as one JSON object."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tiegocancel.estimation.diagnosis.diagnosis import Diagnosis
from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.filters import FilterCounters, FilterStateBits
from tiegocancel.firmware_sim.state import StateBits, state_bits
from tiegocancel.matching.canceller import Counters
from tiegocancel.metrics import DiscRegion, DisplacementHistogram, RateProfile, ResidualProfile, Tally
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.trajectory import Trajectory
from tiegocancel.study.prefilter import filter_numbers
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
    ``region`` is the circle that holds 99 % of the events. ``estimates`` are the rows of a motion that was found on the
    way, ``diagnosis`` what the events say of one that was known before. ``filtered`` and ``filter_state`` are of the
    filters that events passed first, ``guard`` is the summary of the guard, ``None`` where there is none.
    """

    settings: Settings
    trajectory: Trajectory
    region: DiscRegion
    disc_seen: bool
    width: int
    height: int
    first_us: int
    last_us: int
    tally: Tally
    controls: dict[str, Tally]
    displacement: DisplacementHistogram
    residuals: ResidualProfile
    rate: RateProfile
    picture: Densest
    slice: Densest
    counters: Counters
    seconds: float
    estimates: tuple[MotionEstimate, ...] = ()
    diagnosis: Diagnosis | None = None
    filtered: FilterCounters | None = None
    filter_state: FilterStateBits | None = None
    guard: dict[str, Any] | None = None
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
        """How far the rim of the disc moves within the horizon: the chord ``2·r·|sin(ωΔt/2)|`` (eq. 4.7).

        Of a motion that is no rotation, how far a grid of pixels moves on average, half-way through the stream.
        """
        if not isinstance(self.trajectory, RotationTrajectory):
            return self._mean_displacement_px()
        angle = self.omega_rad_s * self.settings.cancel.horizon_us * 1e-6
        return abs(2 * self.region.radius_px * math.sin(angle / 2))

    def _mean_displacement_px(self) -> float:
        """Return the mean length of the displacement over a grid of pixels."""
        x, y = (
            grid.ravel()
            for grid in np.meshgrid(
                *(np.linspace(0, side - 1, 9).astype(np.uint16) for side in (self.width, self.height))
            )
        )
        middle = np.full(len(x), (self.first_us + self.last_us) // 2, np.int64)
        ahead_x, ahead_y = self.trajectory.predict(middle, x, y, self.settings.cancel.horizon_us)
        return float(np.hypot(ahead_x - x.astype(np.int64), ahead_y - y.astype(np.int64)).mean())

    @property
    def omega_rad_s(self) -> float:
        """Mean angular velocity over the events' span."""
        return self.trajectory.mean(start_us=self.first_us, stop_us=self.last_us)[1]

    def _estimate_numbers(self) -> dict[str, Any]:
        """Count the rows of a motion that was found on the way."""
        if not self.estimates:
            return {}
        confident = sum(estimate.confident for estimate in self.estimates)
        return {"estimates": len(self.estimates), "estimates_confident": confident}

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
                "center_px": None if center is None else [float(center[0]), float(center[1])],
                "omega_rad_s": float(omega),
                "source": self.trajectory.source,
                "rim_displacement_px": self.rim_displacement_px,
                "described": self.trajectory.described(start_us=self.first_us, stop_us=self.last_us),
                **self._estimate_numbers(),
            },
            "diagnosis": None if self.diagnosis is None else self.diagnosis.summary(),
            "selectivity": self.tally.selectivity(),
            "selectivity_of_controls": {name: control.selectivity() for name, control in self.controls.items()},
            "displacement": self.displacement.summary(),
            "residual_profile": self.residuals.summary(),
            "counters": dict(self.counters),
            "filter": filter_numbers(self.filtered, self.filter_state),
            "guard": self.guard,
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
                "entry_bits": self.state.ring_entry,
                "entries": sum(self.settings.cancel.ring_capacities),
                "cell_bits": self.state.cell,
                "cells": self.state.cells,
                "tag_bits": self.state.tag,
                "support_bits": self.state.support,
                "index_bits": self.state.index,
                "sweep_ticks": self.state.sweep_ticks,
                "kib": self.state.total_kib,
            },
            "seconds": self.seconds,
            "events_per_second": self.counters.events / self.seconds if self.seconds else 0.0,
            "fault": self.fault,
            "notes": list(self.notes),
        }
