"""Track the rotation of a stream causally: contrast maximisation on past windows, warm-started, filtered."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.contrast.acquire import COARSE_CELLS, FINE_CELLS, SMALL_SUPPORT, hunted, scanned
from tiegocancel.estimation.contrast.ascent import Ascent, ascend
from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.thinning import thinned, thinned_by_place
from tiegocancel.estimation.contrast.twist_filter import FilterConfig, TwistFilter
from tiegocancel.estimation.contrast.window import Scratch, Window
from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.events import Events
from tiegocancel.motion.rotation import MAX_CENTER_PX, MAX_OMEGA_RAD_S

__all__ = ["RotationTracker", "TrackConfig"]

_LONGEST_TURN_RAD = 1.5
_LEAST_MOVE_PX, _DOUBTED_MOVE_PX = 6.0, 5.0
_MOST_MOVE_PX = 120.0
_LEAST_CORRELATION = 0.25
_WORST_PX, _WORST_SMALL_PX = 1.0, 2.5
_LEAST_KEPT = 0.15
_LEAST_SUPPORT = 0.25
_UNSURE_PX = 2.0
_CLEAR_CENTER_PX = 1.0
_AGILE = 10.0
_SHORT_US = 8_000
_FLOOR_PX = 0.02
_DEAD_PX, _DEAD_S = 0.6, 0.002
_REST_SHARE = 0.3
_LONGEST_PAUSE_US = 10_000_000
_SEARCH_PAUSE_US = 300_000
_SEARCH_EVENTS = 100_000


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackConfig:
    """Bound the tracker's work and what it may assume.

    An estimate every ``step_us`` from the last ``window_us``, which grows up to ``longest_window_us`` where little
    moves and shrinks where a window would turn by more than 1.5 rad. About ``max_events`` of a window, drawn with
    ``seed``, take part; fewer than ``fewest_events`` say nothing. ``|ω| ≤ max_omega_rad_s``. A centre less certain than
    ``max_center_sigma_px`` is doubted.
    """

    step_us: int = 10_000
    window_us: int = 20_000
    longest_window_us: int = 80_000
    max_events: int = 20_000
    fewest_events: int = 300
    max_omega_rad_s: float = 200.0
    max_center_sigma_px: float = 5.0
    seed: int = 0
    filter: FilterConfig = field(default_factory=FilterConfig)

    def __post_init__(self) -> None:
        if not 100 <= self.step_us <= 10_000_000:
            raise ValueError(f"step_us must be from 100 to 10,000,000 µs, not {self.step_us}")
        if not 100 <= self.window_us <= self.longest_window_us <= 10_000_000:
            raise ValueError(
                f"window_us and longest_window_us must rise from 100 to 10,000,000 µs, not {self.window_us} and "
                f"{self.longest_window_us}"
            )
        if not 100 <= self.fewest_events <= self.max_events <= 250_000:
            raise ValueError(
                f"fewest_events and max_events must rise from 100 to 250,000, not {self.fewest_events} and "
                f"{self.max_events}"
            )
        if not 0.0 < self.max_omega_rad_s <= MAX_OMEGA_RAD_S:
            raise ValueError(f"max_omega_rad_s must lie in (0, {MAX_OMEGA_RAD_S:g}], not {self.max_omega_rad_s}")
        if self.seed < 0:
            raise ValueError(f"seed must be at least 0, not {self.seed}")
        if not self.max_center_sigma_px > 0.0:
            raise ValueError(f"max_center_sigma_px must be above 0 px, not {self.max_center_sigma_px}")


class RotationTracker:
    """Estimate ``(cx, cy, ω)`` every step from events before it: an :class:`Estimator`.

    Each window is climbed from where the filter expects it. When that peak is not there (stop-and-go, a jump), ω is
    scanned about the known centre, and as a last resort the motion is searched from scratch, at most every 0.3 s and
    sooner at the beginning; the first estimates come after that. A peak counts when early and late events meet there,
    when it is narrow, and when it spreads over much of what moved before: a hand does not pass for a disc that has
    stopped. While only one object is followed, the rest is searched now and then for what moves at large. Chunk borders
    change nothing; the same events and seed give the same estimates.
    """

    def __init__(self, config: TrackConfig, *, width: int, height: int) -> None:
        self.config, self._width, self._height = config, width, height
        self._middle = (0.5 * (width - 1), 0.5 * (height - 1))
        self._scale_px = 0.25 * math.hypot(width, height)
        self._filter = self._new_filter()
        self._scratch = Scratch()
        self._held = Events.empty(width, height)
        self._next_us: int | None = None
        self._paused = False
        self._begun_us = self._oldest_us = self._search_us = 0
        self._pause_us = _SEARCH_PAUSE_US
        self._window_us = config.window_us
        self._usual = _Usual()
        self._center = self._middle
        self._small = False
        self._count = 0

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the estimates that became due. Raise ``ValueError`` for another sensor size."""
        if (events.width, events.height) != (self._width, self._height):
            raise ValueError(
                f"events of {events.width}×{events.height} px do not fit a tracker of {self._width}×{self._height} px"
            )
        if not len(events):
            return []
        if self._next_us is None:
            self._begun_us = self._oldest_us = self._search_us = int(events.t[0])
            self._next_us = self._begun_us + self.config.step_us
        held = Events.concatenate([self._held, events]) if len(self._held) else events
        last_us = int(events.t[-1])
        estimates = []
        while self._next_us <= last_us:
            now_us, following = self._next_us, int(np.searchsorted(held.t, self._next_us, side="left"))
            silent_us = max(self.config.window_us, self.config.step_us)
            silent = following == 0 or int(held.t[following - 1]) < now_us - silent_us
            if not silent:
                estimates.append(self._estimate(held, now_us))
            elif not self._paused:
                estimates.append(self._row(now_us, math.nan, 0, 0, f"no event for {silent_us / 1000:.4g} ms"))
            else:
                # Nothing is learnt in a pause of the stream, and one row that says so is enough.
                resumed_us = int(held.t[following])
                self._next_us += (resumed_us - now_us) // self.config.step_us * self.config.step_us
                self._oldest_us, self._usual.rate = resumed_us, 0.0
            self._paused = silent
            self._next_us += self.config.step_us
            # What is let go is let go after every estimate alike: it must not depend on where chunks end.
            self._oldest_us = max(self._oldest_us, self._next_us - self._reach_us() - self.config.step_us)
        self._held = held[int(np.searchsorted(held.t, self._oldest_us, side="left")) :]
        return estimates

    def _estimate(self, held: Events, now_us: int) -> MotionEstimate:
        """Look at the window that ends at ``now_us``."""
        config = self.config
        self._count += 1
        start_us, seen = self._cut(held, now_us, self._window_us)
        if len(seen) < config.fewest_events or seen.span_us < 2:
            self._window_us = min(2 * self._window_us, config.longest_window_us)
            few = len(seen) < config.fewest_events
            reason = f"only {len(seen)} events in the window" if few else f"all {len(seen)} events are at one time"
            return self._row(now_us, math.nan, 0, len(seen), reason)
        found = self._follow(start_us, now_us, seen) if self._filter.started else None
        if found is None:
            found = self._reacquire(start_us, now_us, seen)
        elif self._usual.support < SMALL_SUPPORT:
            found = self._beyond_the_object(held, now_us, found)
        if found is None:
            return self._lost(start_us, now_us, seen)
        window, ascent = found.window, found.ascent
        overlap = max((now_us - window.start_us) / config.step_us, 1.0)
        covariance = ascent.covariance * overlap + _floor(window)
        self._filter.update(self._elapsed_s(window.middle_us), ascent.twist, window.anchor_px, covariance)
        self._usual.take(ascent.correlation, found.support, len(seen) / (now_us - start_us))
        self._small = ascent.support < SMALL_SUPPORT
        moved_px = self._plan(window, ascent.twist)
        # In a few ms the dead time of pixels that have just fired shows more than such a motion does.
        short = now_us - window.start_us < _SHORT_US and moved_px < _DOUBTED_MOVE_PX
        doubt = f"the window shows {moved_px:.1f} px of motion only" if short else ""
        row = self._row(now_us, ascent.gain, len(window.events), len(seen), doubt)
        return replace(row, window=(round(float(window.events.t.mean())), ascent.twist.omega_rad_s))

    def _longest_us(self) -> int:
        """Return the longest window that the motion allows: one that swings is not the same for long."""
        agile = self._filter.agility > _AGILE
        return min(2 * self.config.window_us, self.config.longest_window_us) if agile else self.config.longest_window_us

    def _reach_us(self) -> int:
        """Return how far back the next window may look."""
        longest = self.config.longest_window_us
        return longest if self._usual.support < SMALL_SUPPORT else min(2 * self._window_us, longest)

    def _cut(self, held: Events, now_us: int, window_us: int) -> tuple[int, Events]:
        """Return start and events of the window; it grows backwards while it holds too few events."""
        stop = int(np.searchsorted(held.t, now_us, side="left"))
        start_us = now_us - window_us
        first = int(np.searchsorted(held.t, start_us, side="left"))
        if stop - first < self.config.fewest_events and stop > first:
            first = max(stop - self.config.fewest_events, 0)
            start_us = max(int(held.t[first]), now_us - min(2 * window_us, self._reach_us()))
        start_us = max(start_us, self._oldest_us)
        return start_us, held[int(np.searchsorted(held.t, start_us, side="left")) : stop]

    def _follow(self, start_us: int, now_us: int, seen: Events) -> _Found | None:
        """Climb from where the filter expects the peak."""
        middle_us, anchor = (start_us + now_us) // 2, _middle_of(seen)
        middle_s = self._elapsed_s(middle_us)
        expected = self._filter.expected(middle_s, anchor)
        used = thinned_by_place(seen, expected, anchor, middle_us, self.config.max_events, self._rng(0))
        window = self._window(used, start_us, now_us, anchor)
        spread = np.diag(self._filter.at(middle_s).covariance)[:3] * (1.0, 1.0, window.radius_px**2)
        unsure_px = math.sqrt(max(float(spread.sum()), 0.0)) * window.half_s
        for cells in (FINE_CELLS, COARSE_CELLS) if unsure_px < _UNSURE_PX else (COARSE_CELLS,):
            found = _Found(window, ascend(window, expected, cells_px=cells), len(seen) / len(used))
            if self._good(found) and found.ascent.correlation >= 0.5 * self._usual.correlation:
                return found
        return None

    def _reacquire(self, start_us: int, now_us: int, seen: Events) -> _Found | None:
        """Scan ω about the known centre, and search from scratch when that is due.

        Where the motion is not known, places cannot be followed: events are drawn one by one.
        """
        anchor = _middle_of(seen)
        if self._filter.started:
            window = self._window(thinned(seen, self.config.max_events, self._rng(1)), start_us, now_us, anchor)
            found = self._widest(window, scanned(window, self._center, self.config.max_omega_rad_s, self._rng(2)))
            if found is not None:
                return found
        if now_us < self._search_us:
            return None
        self._search_us = now_us + min(max(now_us - self._begun_us, 0), _SEARCH_PAUSE_US)
        window = self._window(thinned(seen, _SEARCH_EVENTS, self._rng(1)), start_us, now_us, anchor)
        return self._widest(window, hunted(window, self.config.max_omega_rad_s, self._rng(3)))

    def _beyond_the_object(self, held: Events, now_us: int, found: _Found) -> _Found:
        """Search the longest window for a motion that more of the image shares; it restarts the filter."""
        if now_us < self._search_us:
            return found
        self._search_us = now_us + min(max(now_us - self._begun_us, 0), self._pause_us)
        if self._search_us == now_us + self._pause_us:
            self._pause_us = min(2 * self._pause_us, _LONGEST_PAUSE_US)
        start_us, seen = self._cut(held, now_us, self.config.longest_window_us)
        window = self._window(thinned(seen, _SEARCH_EVENTS, self._rng(1)), start_us, now_us, _middle_of(seen))
        wider = self._widest(window, hunted(window, self.config.max_omega_rad_s, self._rng(3)))
        if wider is None or wider.support < max(SMALL_SUPPORT, 2.0 * found.support):
            return found
        self._filter = self._new_filter()
        return wider

    def _lost(self, start_us: int, now_us: int, seen: Events) -> MotionEstimate:
        """Say that the motion is not known now; at rest, when events have all but stopped, it is nil."""
        # Since the first of the events: the rest of the window may be a pause that has just ended.
        rate = len(seen) / (now_us - int(seen.t[0]))
        if self._filter.started and rate < _REST_SHARE * self._usual.rate:
            self._window_us = self.config.window_us
            self._filter = self._new_filter()
            window = self._window(seen[:1], start_us, now_us, self._middle)
            self._filter.update(self._elapsed_s(window.middle_us), Twist(0.0, 0.0, 0.0), self._middle, _floor(window))
            share = rate / self._usual.rate
            return self._row(now_us, 1.0, 0, len(seen), f"at rest: events fell to {share:.0%} of what they were")
        self._window_us = min(self._window_us * 5 // 4, self.config.longest_window_us)
        return self._row(now_us, 1.0, len(seen), len(seen), "no motion makes most of the events meet")

    def _window(self, used: Events, start_us: int, now_us: int, anchor_px: tuple[float, float]) -> Window:
        """Prepare the events of one window."""
        return Window(used, start_us=start_us, stop_us=now_us, anchor_px=anchor_px, scratch=self._scratch)

    def _elapsed_s(self, time_us: int) -> float:
        """Return the filter's time: seconds since the first event, which float64 holds to the µs whatever the clock."""
        return (time_us - self._begun_us) * 1e-6

    def _rng(self, purpose: int) -> np.random.Generator:
        """Return a generator for one purpose of one window, the same for any chunking."""
        return np.random.default_rng([self.config.seed, self._count, purpose])

    def _new_filter(self) -> TwistFilter:
        """Return a filter that knows nothing."""
        return TwistFilter(self.config.filter, anchor_px=self._middle, scale_px=self._scale_px)

    def _widest(self, window: Window, peaks: list[Ascent]) -> _Found | None:
        """Return the good peak that most of the image shares: the camera's own motion, not that of one object."""
        good = [found for found in (_Found(window, peak, 1.0) for peak in peaks) if self._good(found)]
        return max(good, key=lambda found: found.support) if good else None

    def _good(self, found: _Found) -> bool:
        """Tell whether a peak is one: early and late events meet there, narrowly, over much of what moved before."""
        window, ascent = found.window, found.ascent
        spread = np.diag(ascent.covariance) * window.half_s**2
        worst_px = math.sqrt(max(float(spread[0] + spread[1] + spread[2] * window.radius_px**2), 0.0))
        return (
            ascent.converged
            and ascent.correlation >= _LEAST_CORRELATION
            and worst_px <= (_WORST_PX if ascent.support >= SMALL_SUPPORT else _WORST_SMALL_PX)
            and ascent.kept_share >= _LEAST_KEPT
            and found.support >= _LEAST_SUPPORT * self._usual.support
            and abs(ascent.twist.omega_rad_s) <= self.config.max_omega_rad_s
        )

    def _plan(self, window: Window, twist: Twist) -> float:
        """Choose the next window: long enough for some motion, short enough for a simple one.

        Return the motion that this one shows, in px.
        """
        speed_px_s = math.hypot(twist.vx_px_s, twist.vy_px_s, twist.omega_rad_s * window.radius_px)
        least_s = _LEAST_MOVE_PX / max(speed_px_s, 1e-9)
        most_s = min(_LONGEST_TURN_RAD / max(abs(twist.omega_rad_s), 1e-9), _MOST_MOVE_PX / max(speed_px_s, 1e-9))
        wanted_us = min(max(self.config.window_us * 1e-6, least_s), most_s) * 1e6
        longest = min(2 * self._window_us, self._longest_us())
        self._window_us = int(min(max(wanted_us, 500.0), longest))
        return 2.0 * speed_px_s * window.half_s

    def _row(self, now_us: int, sharpness: float, used: int, seen: int, doubt: str = "") -> MotionEstimate:
        """Say what is known at ``now_us``."""
        followed = not doubt
        if not self._filter.started:
            return MotionEstimate(
                t_us=now_us,
                center_px=(math.nan, math.nan),
                omega_rad_s=0.0,
                sharpness=sharpness,
                confident=False,
                doubt=doubt,
                events_used=used,
                events_seen=seen,
            )
        state = self._filter.at(self._elapsed_s(now_us))
        sigma = state.center_sigma_px()
        known = sigma <= self.config.max_center_sigma_px
        if known:
            self._center = state.twist.center_px(self._filter.anchor_px)
        elif not doubt:
            doubt = f"the centre is not constrained (σ {sigma:.1f} px)"
        if not doubt and self._small and sigma > _CLEAR_CENTER_PX:
            doubt = f"few places alone tell the centre (σ {sigma:.1f} px)"
        # A straight motion is a turn about a centre far away.
        least = math.hypot(*state.twist[:2]) / (0.5 * MAX_CENTER_PX)
        omega = math.copysign(max(abs(state.twist.omega_rad_s), least), state.twist.omega_rad_s)
        return MotionEstimate(
            t_us=now_us,
            center_px=state.twist._replace(omega_rad_s=omega).center_px(self._filter.anchor_px),
            omega_rad_s=omega,
            omega_dot_rad_s2=omega * state.growth_1_s(self._scale_px),
            center_sigma_px=sigma,
            omega_sigma_rad_s=math.sqrt(max(float(state.covariance[2, 2]), 0.0)),
            sharpness=sharpness,
            confident=followed,
            doubt=doubt,
            events_used=used,
            events_seen=seen,
        )


@dataclass(frozen=True, slots=True)
class _Found:
    """A peak with its window; ``share`` is how many events of the window stand for one that took part."""

    window: Window
    ascent: Ascent
    share: float

    @property
    def support(self) -> float:
        """Effective number of tiles that move so, in the whole window."""
        return self.ascent.support * self.share


@dataclass(slots=True)
class _Usual:
    """What the windows of late were like: correlation, tiles in support, events a µs."""

    correlation: float = 0.0
    support: float = 0.0
    rate: float = 0.0

    def take(self, correlation: float, support: float, rate: float) -> None:
        """Take a window in; support rises at once and falls slowly, so that what moved at large is remembered."""
        self.correlation += 0.2 * (correlation - self.correlation)
        rise = 0.2 if support > self.support else 0.02
        self.support += (rise if self.support else 1.0) * (support - self.support)
        self.rate += (0.1 if self.rate else 1.0) * (rate - self.rate)


def _middle_of(events: Events) -> tuple[float, float]:
    return (float(events.x.mean()), float(events.y.mean()))


def _floor(window: Window) -> NDArray[np.float64]:
    """Return the covariance of what no window can beat, however many events it has.

    Pixels differ, and always alike: some hundredths of a px. And a pixel that has fired rests for a while, so that
    short windows see too fast a motion: a real disc by 45 % in 2 ms, by 9 % in 4 ms, by 2 % in 9 ms.
    """
    dead_px = _DEAD_PX * (0.5 * _DEAD_S / window.half_s) ** 2
    share = math.hypot(_FLOOR_PX, dead_px) / window.half_s
    return np.diag([share**2, share**2, (share / window.radius_px) ** 2])
