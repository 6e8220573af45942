"""Run the canceller and its controls over a stream, chunk by chunk, in constant memory."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Protocol

from tiegocancel.chunks import rechunk
from tiegocancel.errors import ConfigError, TiegoCancelError
from tiegocancel.events import Events
from tiegocancel.interrupt import deferred_interrupt
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
from tiegocancel.study.controls import CONTROLS, Control, ShuffledControl
from tiegocancel.study.result import INTERRUPTED, RunResult
from tiegocancel.study.settings import Settings
from tiegocancel.study.stretch import Densest
from tiegocancel.units import rate_text

__all__ = ["run_stream"]

MAX_ENTRIES = 1 << 20
MAX_PIXELS = 1 << 28


class _Sink(Protocol):
    """Take residual events; an ``EventWriter`` does."""

    def write(self, events: Events) -> None: ...


def run_stream(
    chunks: Iterable[Events],
    settings: Settings,
    trajectory: RotationTrajectory,
    *,
    sink: _Sink | None = None,
    disc_radius_px: float | None = None,
    expected_us: int | None = None,
    progress: Callable[[Events], None] | None = None,
) -> RunResult | None:
    """Cancel a stream, write what remains to ``sink``, measure it; return ``None`` for a stream without events.

    ``disc_radius_px`` is used where the settings leave it open; pictures are taken half-way through ``expected_us`` of
    stream, or after the warm-up where that is unknown. When ``chunks`` raises a :class:`TiegoCancelError`, what came
    before counts and the error's line stands in ``RunResult.fault``; so it is when the user interrupts, who is heard
    between chunks.
    """
    run: _Run | None = None
    fault: str | None = None
    source = iter(rechunk(chunks, settings.report.chunk_events))
    with deferred_interrupt() as interrupt:
        while fault is None:
            try:
                chunk = next(source)
            except StopIteration:
                break
            except (TiegoCancelError, KeyboardInterrupt) as error:
                if run is None:
                    raise
                fault = INTERRUPTED if isinstance(error, KeyboardInterrupt) else str(error)
                break
            if run is None:
                run = _Run(settings, trajectory, chunk, disc_radius_px, expected_us)
            residual = run.process(chunk)
            if sink is not None:
                sink.write(residual)
            if progress is not None:
                progress(chunk)
            fault = INTERRUPTED if interrupt.wanted else None
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
        if self.width * self.height > MAX_PIXELS:
            raise ConfigError(f"a sensor of {self.width}×{self.height} px is beyond the 2^28 px that a run holds")
        self.first_us, self.last_us = int(first.t[0]), int(first.t[-1])
        self.notes: list[str] = []
        counted_from_us = self.first_us + config.warm_up_us
        center, _ = trajectory.mean(start_us=self.first_us, stop_us=self.last_us)
        radius_px, self.disc_seen = self._radius(first, center, disc_radius_px)
        self.region = DiscRegion(self.width, self.height, center_px=center, radius_px=radius_px)
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
        for control in self.controls.values():
            control.finish()
        self.notes += self._doubts()
        if not self.tally.share().events:
            self.notes.append(
                f"no event lies beyond the warm-up of {self.settings.cancel.warm_up_us / 1000:g} ms: every ratio is 0; "
                "a shorter --horizon-us leaves more"
            )
        return RunResult(
            settings=self.settings,
            trajectory=self.trajectory,
            region=self.region,
            disc_seen=self.disc_seen,
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

    def _doubts(self) -> list[str]:
        """Say where the motion was not known, and where the shuffle was too short to tell chance."""
        doubts = []
        known = self.trajectory.t_us
        before = min(max(int(known[0]) - self.first_us, 0), self.last_us - self.first_us)
        after = min(max(self.last_us - int(known[-1]), 0), self.last_us - self.first_us)
        if len(known) > 1 and before + after > 0:
            share = (before + after) / max(self.last_us - self.first_us, 1)
            seconds = [int(t) / 1e6 for t in (known[0], known[-1], self.first_us, self.last_us)]
            doubts.append(
                f"the motion of {self.trajectory.source} is known from {seconds[0]:.6f} to {seconds[1]:.6f} s, "
                f"the events lie from {seconds[2]:.6f} to {seconds[3]:.6f} s: for {share:.0%} of that time the "
                "nearest known value was held"
            )
        shuffled = self.controls.get("time_shuffled")
        shortest_us = shuffled.shortest_us if isinstance(shuffled, ShuffledControl) else None
        if shortest_us is not None and shortest_us < 2 * self.settings.cancel.warm_up_us:
            doubts.append(
                f"times were shuffled within {shortest_us / 1000:.1f} ms, not much longer than the horizon: "
                "the control keeps some structure and stands too high"
            )
        return doubts

    def _radius(self, first: Events, center: tuple[float, float], given: float | None) -> tuple[float, bool]:
        """Take the declared radius, the scene's, or a guess from the first chunk; say whether it is a disc at all."""
        declared = self.settings.report.disc_radius_px
        radius = given if declared is None else declared
        if radius is not None:
            return radius, True
        guess, edge_seen = estimate_radius_px(first, center)
        if edge_seen:
            self.notes.append(
                f"disc radius {guess:g} px guessed from the radial density (--disc-radius-px declares it)"
            )
        else:
            self.notes.append("no disc is seen in the density of events: ratios are of the whole sensor")
        return guess, edge_seen

    def _slice_rows(self) -> tuple[int, int]:
        """Choose rows half-way down to the rim, where a rotation moves edges sideways at one speed."""
        row = round(self.region.center_px[1] + self.region.radius_px / 2)
        row = min(max(row, 0), self.height - 1)
        return max(row - 1, 0), min(row + 1, self.height - 1)

    def _motion(self, trajectory: RotationTrajectory) -> MotionSchedule | RotationTrajectory:
        """Give the canceller the path that the settings ask for."""
        if self.settings.motion.path == "float":
            return trajectory
        step_us = self.settings.motion.schedule_step_us
        start_us = min(max(self.first_us, int(trajectory.t_us[0])), int(trajectory.t_us[-1]))
        entries = (int(trajectory.t_us[-1]) - start_us) // step_us + 1
        if entries > MAX_ENTRIES:
            raise ConfigError(
                f"the motion of {trajectory.source} needs {entries:,} schedule entries, at most {MAX_ENTRIES:,} fit: "
                f"make --schedule-step-us longer than {step_us}, or --motion-path float"
            )
        return trajectory.schedule(self.settings.cancel.horizon_us, start_us=start_us, step_us=step_us)

    def _wanted_controls(self) -> tuple[str, ...]:
        return tuple(CONTROLS) if self.settings.report.controls else ()

    def _control(self, name: str, counted_from_us: int) -> Control:
        """Build one control: the same canceller under another motion, or the same motion over shuffled pixels."""
        motion = self.motion
        if name == "zero_motion":
            motion = MotionSchedule.still()
        elif name == "reversed_motion":
            motion = self._motion(self.trajectory.reversed())
        canceller = Canceller(self.settings.cancel, motion, width=self.width, height=self.height, track_source=False)
        tally = Tally(self.region, counted_from_us)
        if name == "time_shuffled":
            return ShuffledControl(canceller, tally, self.settings.report.shuffle_seed)
        return Control(canceller, tally)
