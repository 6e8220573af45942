"""Hold everything that one pass over a stream accumulates: canceller, controls, tallies, pictures."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np

from tiegocancel.errors import ConfigError
from tiegocancel.estimation.diagnosis.diagnosis import Diagnosis
from tiegocancel.events import Events
from tiegocancel.matching.canceller import Canceller, Decisions
from tiegocancel.matching.selective import Schedules
from tiegocancel.metrics import (
    DiscRegion,
    DisplacementHistogram,
    Ledger,
    RateProfile,
    ResidualProfile,
    Tally,
    estimate_radius_px,
)
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.motion.times import EXTRAPOLATE_US
from tiegocancel.motion.trajectory import Trajectory
from tiegocancel.study.controls import CONTROLS, Control, ShuffledControl
from tiegocancel.study.feed import MotionFeed
from tiegocancel.study.guard import Guard
from tiegocancel.study.result import RunResult
from tiegocancel.study.settings import Settings
from tiegocancel.study.stretch import Densest
from tiegocancel.units import rate_text

__all__ = ["OnePass"]

MAX_PIXELS = 1 << 28
_WORTH_TELLING = 0.005
"""Share of the time for which a held value is worth a remark."""
_LIVE_SHUFFLE_US = 250_000
"""Times of a live stream are shuffled within so much of it at least, and the motion is kept for as long."""


class OnePass:
    """Everything that one pass accumulates; the first events, given beforehand, decide start time and disc.

    :meth:`process` decides a chunk and counts it everywhere. Where decisions are urgent, :meth:`decide` alone runs the
    canceller and the guard, and :meth:`settle` does all the counting and the controls later, for many chunks at once;
    no number changes by that. ``live``: what comes is not known beforehand, so that a disc is not guessed from the
    first events and times are shuffled within a bounded time.
    """

    def __init__(
        self,
        settings: Settings,
        feed: MotionFeed,
        first: Events,
        disc_radius_px: float | None,
        expected_us: int | None,
        *,
        live: bool = False,
    ) -> None:
        config = settings.cancel
        self.settings, self.feed, self.live = settings, feed, live
        self.pending: list[tuple[Events, Decisions]] = []  # decided and not yet counted
        self.step_us = settings.motion.schedule_step_us
        self.width, self.height = first.width, first.height
        if self.width * self.height > MAX_PIXELS:
            raise ConfigError(f"a sensor of {self.width}×{self.height} px is beyond the 2^28 px that a run holds")
        self.first_us, self.last_us = int(first.t[0]), int(first.t[-1])
        self.notes: list[str] = []
        counted_from_us = self.first_us + config.warm_up_us
        feed.advance(first)
        self.ahead = len(first)  # events that the feed has looked at and nobody has decided yet
        center = self._center()
        radius_px, self.disc_seen = self._radius(first, center, disc_radius_px)
        middle = (0.5 * (self.width - 1), 0.5 * (self.height - 1))
        self.region = DiscRegion(self.width, self.height, center_px=center or middle, radius_px=radius_px)
        self.motion, self.backwards = self._motions(self.first_us)
        self.canceller = Canceller(config, self.motion, width=self.width, height=self.height)
        self.ledger = Ledger(config, self.motion)
        self.tally = Tally(self.region, counted_from_us)
        self.displacement = DisplacementHistogram(config, counted_from_us)
        self.residuals = ResidualProfile(self.region.center_px, self.region.ring_edges_px, counted_from_us)
        self.rate = RateProfile(self.first_us)
        pictured_us = max(counted_from_us, self.first_us + (expected_us or 0) // 2)
        self.picture = Densest(pictured_us, span_us=10_000, longest_us=250_000, enough=40_000, most=400_000)
        self.slice = Densest(
            pictured_us, span_us=60_000, longest_us=1_000_000, enough=1500, most=60_000, rows=self._slice_rows()
        )
        # A motion that is found on the way is diagnosed once it has settled.
        self.sample = Densest(
            counted_from_us if feed.changes else self.first_us,
            span_us=5 * config.warm_up_us,
            longest_us=2_000_000,
            enough=200_000,
            most=1_000_000,
        )
        self.controls = {name: self._control(name, counted_from_us) for name in self._wanted_controls()}
        self.guard = self._guard()
        self.canceller.prepare()
        self.seconds = 0.0

    def process(self, chunk: Events) -> Events:
        """Decide a chunk, count it everywhere, return what remains of it."""
        decisions = self.decide(chunk)
        self.settle()
        return chunk.select(~decisions.suppressed)

    def decide(self, chunk: Events) -> Decisions:
        """Decide a chunk, guard included; it is counted at the next :meth:`settle`."""
        self._follow(chunk)
        started = time.perf_counter()
        decisions = self.canceller.process(chunk)
        if self.guard is not None:
            suppressed = self.guard.process(chunk, decisions.suppressed, decisions.support)
            decisions = replace(decisions, suppressed=suppressed)
        self.seconds += time.perf_counter() - started
        self.pending.append((chunk, decisions))
        return decisions

    def settle(self) -> None:
        """Count what was decided since the last time, and let the controls decide it too."""
        if not self.pending:
            return
        chunk, decisions = _joined(self.pending)
        self._lay_motion(int(chunk.t[0]))
        self.pending = []
        settled, matches = self.ledger.add(chunk, decisions)
        self.tally.add(settled.events, settled.suppressed, settled.used)
        self.displacement.add(matches)
        self.residuals.add(matches)
        self.sample.add(chunk, decisions.suppressed)
        self.rate.add(chunk, decisions.suppressed)
        self.picture.add(chunk, decisions.suppressed)
        self.slice.add(chunk, decisions.suppressed)
        for control in self.controls.values():
            control.process(chunk)

    def finish(self, fault: str | None) -> RunResult:
        """Settle the last events and return what the run found."""
        self.settle()
        rest = self.ledger.close()
        if rest is not None:
            self.tally.add(rest.events, rest.suppressed, rest.used)
        counters = self.canceller.counters
        if self.guard is not None:
            counters = replace(counters, suppressed=counters.suppressed - self.guard.counters.passed)
        if counters.overflow:
            window_s = max(self.settings.cancel.horizons_us[-1] - self.settings.cancel.early_gate_us, 0) * 1e-6
            self.notes.append(
                f"{counters.overflow:,} predictions did not fit the ring of "
                f"{' + '.join(f'{ring:,}' for ring in self.settings.cancel.ring_capacities)}: "
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
            trajectory=self.feed.trajectory or _nothing(self.first_us),
            region=self.region,
            disc_seen=self.disc_seen,
            width=self.width,
            height=self.height,
            first_us=self.first_us,
            last_us=self.last_us,
            tally=self.tally,
            controls={name: control.tally for name, control in self.controls.items()},
            displacement=self.displacement,
            residuals=self.residuals,
            diagnosis=self._diagnosis(),
            rate=self.rate,
            picture=self.picture,
            slice=self.slice,
            counters=counters,
            guard=None if self.guard is None else self.guard.summary(),
            seconds=self.seconds,
            estimates=tuple(getattr(self.feed, "estimates", ())),
            fault=fault,
            notes=tuple(self.notes),
        )

    def _diagnosis(self) -> Diagnosis | None:
        """Tell a wrong centre from a wrong ω on the densest stretch, where the motion is a rotation."""
        trajectory, sample = self.feed.trajectory, self.sample.events()
        if not self.settings.report.diagnose or sample is None or not isinstance(trajectory, RotationTrajectory):
            return None
        from tiegocancel.estimation.diagnosis.diagnose import diagnose_rotation

        return diagnose_rotation(sample, trajectory, self.settings.cancel)

    def _doubts(self) -> list[str]:
        """Say where the motion was not known, and where the shuffle was too short to tell chance."""
        doubts = []
        trajectory = self.feed.trajectory
        if trajectory is None:
            return ["no motion was found: nothing was predicted, and nothing suppressed"]
        known = trajectory.t_us
        before = min(max(int(known[0]) - self.first_us, 0), self.last_us - self.first_us)
        after = min(max(self.last_us - int(known[-1]), 0), self.last_us - self.first_us)
        if before > 0 and self.feed.waits and self.settings.motion.path == "integer":
            doubts.append(
                f"the motion is known from {before / 1e6:.3f} s after the first event on; nothing before is suppressed"
            )
            before, after = 0, max(after - EXTRAPOLATE_US, 0)
        share = (before + after) / max(self.last_us - self.first_us, 1)
        if len(known) > 1 and share >= _WORTH_TELLING and not self.feed.changes:
            seconds = [int(t) / 1e6 for t in (known[0], known[-1], self.first_us, self.last_us)]
            doubts.append(
                f"the motion of {trajectory.source} is known from {seconds[0]:.6f} to {seconds[1]:.6f} s, "
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

    def _radius(self, first: Events, center: tuple[float, float] | None, given: float | None) -> tuple[float, bool]:
        """Take the declared radius, the scene's, or a guess from the first chunk; say whether it is a disc at all."""
        declared = self.settings.report.disc_radius_px
        radius = given if declared is None else declared
        if radius is not None and center is not None:
            return radius, True
        if center is None:
            self.notes.append("the motion has no centre on the sensor: ratios are of the whole sensor")
            return math.hypot(self.width, self.height), False
        if self.live:
            self.notes.append("no disc is declared (--disc-radius-px): ratios are of the whole sensor")
            return math.hypot(self.width, self.height), False
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

    def _center(self) -> tuple[float, float] | None:
        """Return the mean centre of the motion, ``None`` where nothing stands still or nothing is known."""
        trajectory = self.feed.trajectory
        return None if trajectory is None else trajectory.mean(start_us=self.first_us, stop_us=self.last_us)[0]

    def _motions(self, from_us: int) -> tuple[Schedules | Trajectory, Schedules | Trajectory]:
        """Return the motion as the settings ask for it, and the same run the other way."""
        if self.settings.motion.path == "float":
            trajectory = self.feed.trajectory
            if self.feed.changes or trajectory is None:
                raise ConfigError("--motion-path float: a motion that is found on the way has an integer schedule only")
            if not self.settings.cancel.is_plain:
                raise ConfigError("--motion-path float: serves the plain rule only, and [cancel] asks for more")
            return trajectory, trajectory.reversed()
        return self._along(from_us), tuple(
            self.feed.backwards(horizon_us, start_us=from_us, stop_us=self.last_us, step_us=self.step_us)
            for horizon_us in self.settings.cancel.horizons_us
        )

    def _along(self, from_us: int) -> Schedules:
        """Return the schedule of each horizon from a time on."""
        return tuple(
            self.feed.schedule(horizon_us, start_us=from_us, stop_us=self.last_us, step_us=self.step_us)
            for horizon_us in self.settings.cancel.horizons_us
        )

    def _follow(self, chunk: Events) -> None:
        """Give the canceller the motion that this chunk is decided with."""
        self.last_us = int(chunk.t[-1])
        if not self.feed.changes:
            return
        fresh = chunk[self.ahead :]
        self.ahead = max(self.ahead - len(chunk), 0)
        if len(fresh):
            self.feed.advance(fresh)
        self.canceller.motion = self._along(int(chunk.t[0]) - self._reach_us)

    def _lay_motion(self, from_us: int) -> None:
        """Give ledger and controls the motion back to the oldest event that one of them holds or is about to take."""
        if not self.feed.changes:
            return
        holders = [self.ledger.oldest_us, *(control.oldest_us for control in self.controls.values())]
        oldest_us = min([from_us, *(held for held in holders if held is not None)]) - self._reach_us
        self.motion, self.backwards = self._motions(oldest_us)
        self.ledger.motion = self.motion
        for name, control in self.controls.items():
            control.canceller.motion = self._motion_of(name)

    @property
    def _reach_us(self) -> int:
        """How much older than an event the entries in the rings may be: the longest horizon and its gate."""
        return self.settings.cancel.horizons_us[-1] + self.settings.cancel.late_gate_us

    def _guard(self) -> Guard | None:
        """Return the guard, if it is wanted."""
        if not self.settings.guard.enabled:
            return None
        guard = Guard(self.settings.guard, self.settings.cancel, width=self.width, height=self.height)
        guard.prepare()
        return guard

    def _wanted_controls(self) -> tuple[str, ...]:
        return tuple(CONTROLS) if self.settings.report.controls else ()

    def _control(self, name: str, counted_from_us: int) -> Control:
        """Build one control: the same canceller under another motion, or the same motion over shuffled pixels."""
        motion = self._motion_of(name)
        config = self.settings.cancel
        if name == "zero_motion":
            config = config.without_motion()
        canceller = Canceller(config, motion, width=self.width, height=self.height, track_source=False)
        tally = Tally(self.region, counted_from_us)
        if name == "time_shuffled":
            block_us = max(_LIVE_SHUFFLE_US, 4 * config.warm_up_us) if self.live else None
            return ShuffledControl(canceller, tally, self.settings.report.shuffle_seed, block_us=block_us)
        return Control(canceller, tally)

    def _motion_of(self, name: str) -> MotionSchedule | Schedules | Trajectory:
        """Return the motion of a control."""
        if name == "zero_motion":
            return MotionSchedule.still()
        return self.backwards if name == "reversed_motion" else self.motion


def _nothing(t_us: int) -> Trajectory:
    """Return a motion at rest, for reports of a run that found none."""
    return RotationTrajectory.constant(center_px=(0.0, 0.0), omega_rad_s=0.0, t_us=t_us, source="none found")


def _joined(parts: list[tuple[Events, Decisions]]) -> tuple[Events, Decisions]:
    """Join consecutive chunks with their decisions."""
    if len(parts) == 1:
        return parts[0]
    decisions = [part[1] for part in parts]
    sources = [d.source for d in decisions if d.source is not None]
    horizons = [d.horizon for d in decisions if d.horizon is not None]
    return Events.concatenate([part[0] for part in parts]), Decisions(
        suppressed=np.concatenate([d.suppressed for d in decisions]),
        source=np.concatenate(sources) if sources else None,
        horizon=np.concatenate(horizons) if horizons else None,
    )
