"""Run the canceller and its controls over a stream, chunk by chunk, in constant memory."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Protocol

import numpy as np

from tiegocancel.chunks import rechunk
from tiegocancel.errors import TiegoCancelError
from tiegocancel.events import Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.metrics import (
    DiscRegion,
    DisplacementHistogram,
    Ledger,
    RateProfile,
    Tally,
    estimate_radius_px,
)
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.motion.trajectory import RotationTrajectory
from tiegocancel.study.result import INTERRUPTED, RunResult
from tiegocancel.study.settings import Settings
from tiegocancel.study.stretch import Densest
from tiegocancel.units import rate_text

__all__ = ["CONTROLS", "run_stream"]

CONTROLS = ("zero_motion", "reversed_motion", "time_shuffled")


class _Sink(Protocol):
    """Take residual events; an ``EventWriter`` does."""

    def write(self, events: Events) -> None: ...


class _Control:
    """Run one control on the events that the main run sees."""

    def __init__(self, canceller: Canceller, tally: Tally, rng: np.random.Generator | None) -> None:
        self.canceller, self.tally, self._rng = canceller, tally, rng

    def process(self, events: Events) -> None:
        """Decide and count a chunk, its pixels permuted against its times when this control shuffles."""
        if self._rng is not None:
            order = self._rng.permutation(len(events))
            label = None if events.label is None else events.label[order]
            events = Events(
                events.t, events.x[order], events.y[order], events.p[order], events.width, events.height, label
            )
        self.tally.add(events, self.canceller.process(events).suppressed)


def run_stream(
    chunks: Iterable[Events],
    settings: Settings,
    trajectory: RotationTrajectory,
    *,
    width: int,
    height: int,
    sink: _Sink | None = None,
    disc_radius_px: float | None = None,
    expected_us: int | None = None,
    progress: Callable[[Events], None] | None = None,
) -> RunResult | None:
    """Cancel a stream, write what remains to ``sink``, measure it; return ``None`` for a stream without events.

    ``disc_radius_px`` is used where the settings leave it open; pictures are taken half-way through ``expected_us`` of
    stream, or after the warm-up where that is unknown. When ``chunks`` raises a :class:`TiegoCancelError`,
    what came before counts and the error's line stands in ``RunResult.fault``; so it is when the user interrupts.
    """
    run: _Run | None = None
    fault: str | None = None
    try:
        for chunk in rechunk(chunks, settings.report.chunk_events):
            if run is None:
                run = _Run(settings, trajectory, chunk, disc_radius_px, expected_us)
            residual = run.process(chunk)
            if sink is not None:
                sink.write(residual)
            if progress is not None:
                progress(chunk)
    except (TiegoCancelError, KeyboardInterrupt) as error:
        if run is None:
            raise
        interrupted = isinstance(error, KeyboardInterrupt)
        fault = INTERRUPTED if interrupted else str(error)
    return None if run is None else run.finish(fault)


class _Run:
    """Everything that one pass accumulates; begins with the first chunk, which decides start time and disc."""

    def __init__(
        self,
        settings: Settings,
        trajectory: RotationTrajectory,
        first: Events,
        disc_radius_px: float | None,
        expected_us: int | None,
    ) -> None:
        config = settings.cancel
        self.settings, self.trajectory = settings, trajectory
        self.width, self.height = first.width, first.height
        self.first_us, self.last_us = int(first.t[0]), int(first.t[-1])
        self.notes: list[str] = []
        counted_from_us = self.first_us + config.warm_up_us
        center, _ = trajectory.mean(start_us=self.first_us, stop_us=self.last_us)
        self.region = DiscRegion(
            self.width, self.height, center_px=center, radius_px=self._radius(first, center, disc_radius_px)
        )
        self.motion = self._motion(trajectory)
        self.canceller = Canceller(config, self.motion, width=self.width, height=self.height)
        self.ledger = Ledger(config, self.motion)
        self.tally = Tally(self.region, counted_from_us)
        self.displacement = DisplacementHistogram(config, counted_from_us)
        self.rate = RateProfile(self.first_us)
        pictured_us = max(counted_from_us, self.first_us + (expected_us or 0) // 2)
        self.picture = Densest(pictured_us, span_us=10_000, longest_us=250_000, enough=40_000, most=400_000)
        self.slice = Densest(
            pictured_us, span_us=60_000, longest_us=1_000_000, enough=1500, most=60_000, rows=self._slice_rows()
        )
        self.controls = {name: self._control(name, counted_from_us) for name in self._wanted_controls()}
        self.canceller.prepare()
        self.seconds = 0.0

    def process(self, chunk: Events) -> Events:
        """Decide a chunk, count it everywhere, return what remains of it."""
        started = time.perf_counter()
        decisions = self.canceller.process(chunk)
        self.seconds += time.perf_counter() - started
        settled, matches = self.ledger.add(chunk, decisions)
        self.tally.add(settled.events, settled.suppressed, settled.used)
        self.displacement.add(matches)
        self.rate.add(chunk, decisions.suppressed)
        self.picture.add(chunk, decisions.suppressed)
        self.slice.add(chunk, decisions.suppressed)
        for control in self.controls.values():
            control.process(chunk)
        self.last_us = int(chunk.t[-1])
        return chunk.select(~decisions.suppressed)

    def finish(self, fault: str | None) -> RunResult:
        """Settle the last events and return what the run found."""
        rest = self.ledger.close()
        if rest is not None:
            self.tally.add(rest.events, rest.suppressed, rest.used)
        counters = self.canceller.counters
        if counters.overflow:
            window_s = max(self.settings.cancel.horizon_us - self.settings.cancel.tolerance_us, 0) * 1e-6
            self.notes.append(
                f"{counters.overflow:,} predictions did not fit the ring of {self.settings.cancel.ring_capacity:,}: "
                f"at the peak of {rate_text(self.rate.peak_hz())} it needs about "
                f"{int(self.rate.peak_hz() * window_s):,} (--ring-capacity)"
            )
        if not self.tally.share().events:
            self.notes.append(
                f"no event lies beyond the warm-up of {self.settings.cancel.warm_up_us / 1000:g} ms: every ratio is 0; "
                "a shorter --horizon-us leaves more"
            )
        return RunResult(
            settings=self.settings,
            trajectory=self.trajectory,
            region=self.region,
            width=self.width,
            height=self.height,
            first_us=self.first_us,
            last_us=self.last_us,
            tally=self.tally,
            controls={name: control.tally for name, control in self.controls.items()},
            displacement=self.displacement,
            rate=self.rate,
            picture=self.picture,
            slice=self.slice,
            counters=counters,
            seconds=self.seconds,
            fault=fault,
            notes=tuple(self.notes),
        )

    def _radius(self, first: Events, center: tuple[float, float], given: float | None) -> float:
        """Take the declared radius, the scene's, or a guess from the first chunk."""
        declared = self.settings.report.disc_radius_px
        radius = given if declared is None else declared
        if radius is None:
            radius, edge_seen = estimate_radius_px(first, center)
            told = "guessed from the radial density" if edge_seen else "of the circle that holds 99 % of the events"
            self.notes.append(f"disc radius {radius:g} px {told} (--disc-radius-px declares it)")
        return radius

    def _slice_rows(self) -> tuple[int, int]:
        """Choose rows half-way down to the rim, where a rotation moves edges sideways at one speed."""
        row = round(self.region.center_px[1] + self.region.radius_px / 2)
        row = min(max(row, 0), self.height - 1)
        return max(row - 1, 0), min(row + 1, self.height - 1)

    def _motion(self, trajectory: RotationTrajectory) -> MotionSchedule | RotationTrajectory:
        """Give the canceller the path that the settings ask for."""
        if self.settings.motion.path == "float":
            return trajectory
        return trajectory.schedule(self.settings.cancel.horizon_us, step_us=self.settings.motion.schedule_step_us)

    def _wanted_controls(self) -> tuple[str, ...]:
        return CONTROLS if self.settings.report.controls else ()

    def _control(self, name: str, counted_from_us: int) -> _Control:
        """Build one control: the same canceller under another motion, or the same motion over shuffled pixels."""
        motions = {
            "zero_motion": MotionSchedule.still(),
            "reversed_motion": self._motion(self.trajectory.reversed()),
            "time_shuffled": self.motion,
        }
        canceller = Canceller(
            self.settings.cancel, motions[name], width=self.width, height=self.height, track_source=False
        )
        shuffled = name == "time_shuffled"
        rng = np.random.default_rng(self.settings.report.shuffle_seed) if shuffled else None
        return _Control(canceller, Tally(self.region, counted_from_us), rng)
