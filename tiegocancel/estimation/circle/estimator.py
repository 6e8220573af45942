"""Estimate the rotation by circle fits and angle differencing, the method of the thesis (§3.3.2, §3.6)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tiegocancel.estimation.circle.config import CircleConfig
from tiegocancel.estimation.circle.fit import NoCircle, arc_rad
from tiegocancel.estimation.circle.marker import MarkerTurn, NoTurn, turn_of_events, turn_of_marker
from tiegocancel.estimation.circle.ring import Ring
from tiegocancel.estimation.circle.search import WHOLE_ARC_RAD, CircleSearch
from tiegocancel.estimation.estimate import MotionEstimate
from tiegocancel.events import Events

__all__ = ["CircleConfig", "CircleEstimator"]

_FEWEST_EVENTS = 30
_TURN_EVENTS = 16_000
"""A window is thinned to about so many events; the angles of a marker need no more."""
_LEAST_SIGMA_RAD_S, _SIGMA_SHARE = 1.0, 0.1
"""ω is doubted when its deviation exceeds both 1 rad/s and a tenth of ω."""


class CircleEstimator:
    """Find centre and ω of a marker that runs along a circle: an estimator as in :mod:`.estimate`.

    It needs what the thesis calls a coherent rim or marker: one blob on a turning disc. A rim that looks the same all
    round tells the centre but no ω, a textured disc neither, and is refused. One row every ``step_us`` from
    ``start_us`` (the first event) plus ``window_us`` on; a stretch without events gets one row. An estimate that the
    window does not support repeats the last values known with infinite deviation, ``confident`` false and the reason
    in ``doubt``; before any was known ω is 0 and the centre NaN. When only the arc is too short, a centre known from
    the last ``center_window_us`` is held, and ω measured about it. Deviations are those of the window, before
    smoothing; sharpness is not measured. Memory is bounded by the events of a window and the thinned cloud.
    """

    def __init__(
        self, config: CircleConfig | None = None, *, width: int, height: int, start_us: int | None = None, seed: int = 0
    ) -> None:
        self.config = config = config or CircleConfig()
        self._search = CircleSearch(config, np.random.default_rng(seed))
        self._start_us = start_us
        self._next_us: int | None = None
        self._last_us: int | None = None
        self._idle = False
        self._pending = [Events.empty(width, height)]
        self._ring: Ring | None = None
        self._omega_rad_s: float | None = None

    def process(self, events: Events) -> list[MotionEstimate]:
        """Take a chunk; return the estimates that became due, each of events before its ``t_us`` alone.

        An estimate is due once an event at or after its time was seen; events before ``start_us`` are left out. Raise
        ``ValueError`` for another sensor size or a chunk that begins before the last one ended.
        """
        size = self._pending[0].width, self._pending[0].height
        if (events.width, events.height) != size:
            raise ValueError(f"events must come from a sensor of {size} px, not {(events.width, events.height)}")
        if not len(events):
            return []
        if self._last_us is not None and int(events.t[0]) < self._last_us:
            raise ValueError(f"chunks must follow each other: one begins at {events.t[0]} µs, after {self._last_us} µs")
        self._last_us = int(events.t[-1])
        if self._start_us is None:
            self._start_us = int(events.t[0])
        events = events[int(np.searchsorted(events.t, self._start_us)) :]
        if self._next_us is None:
            self._next_us = self._start_us + self.config.step_us
        if len(events):
            self._pending.append(Events(events.t, events.x, events.y, events.p, *size))
        if self._last_us < self._next_us:  # also while all events are before the start
            return []
        stream = Events.concatenate(self._pending)
        estimates = []
        while self._next_us <= self._last_us:
            t_us = self._next_us
            window = stream.between(t_us - self.config.window_us, t_us)
            fresh = window.between(t_us - self.config.step_us, t_us)
            self._search.add(t_us, fresh.x, fresh.y)
            if t_us - self._start_us >= self.config.window_us and (len(window) or not self._idle):
                estimates.append(self._estimate(t_us, window))
            self._idle = not len(window)
            self._next_us += self.config.step_us
            if self._idle:  # go straight to the first time after the next event
                waiting_us = int(stream.t[int(np.searchsorted(stream.t, t_us))]) - t_us
                self._next_us += waiting_us // self.config.step_us * self.config.step_us
        self._pending = [stream[int(np.searchsorted(stream.t, self._next_us - self.config.window_us)) :]]
        return estimates

    def _estimate(self, t_us: int, window: Events) -> MotionEstimate:
        """Find circle and turn of the marker, and judge both."""
        seen = len(window)
        if seen < _FEWEST_EVENTS:
            return self._row(t_us, doubt=f"{seen} events in the window are too few" if seen else "no events", seen=seen)
        found, stretch_us = self._search.fit(t_us)
        if isinstance(found, NoCircle):
            return self._row(t_us, doubt=found.reason, seen=seen)
        old = self._ring
        if old is not None and t_us - old.fitted_us > self.config.center_window_us:
            old = None
        ring = Ring.of(found, t_us, least_reach_px=self.config.tolerance_px)
        ring = old.followed_by(ring, self.config.center_smoothing) if old else ring
        turn, used, span_rad = self._turn(window, ring)
        if isinstance(turn, NoTurn):
            if found.arc_rad < WHOLE_ARC_RAD or span_rad < WHOLE_ARC_RAD:
                return self._row(t_us, doubt=turn.reason, seen=seen, used=used)
            self._ring = ring  # a rim seen all round tells the centre without turning
            return self._row(
                t_us, doubt=f"a rim tells the centre, no ω: {turn.reason}", seen=seen, used=used, sigma_px=ring.sigma_px
            )
        # A broad marker spans an arc before it has moved: what it ran along counts.
        arc = min(found.arc_rad, abs(turn.omega_rad_s) * stretch_us * 1e-6)
        held = ""
        if arc >= self.config.least_arc_rad:
            self._ring = ring
        else:
            doubt = f"arc too short: {math.degrees(arc):.0f}° do not constrain the centre"
            if old is None:
                return self._row(t_us, doubt=doubt, seen=seen)
            ring, held = old, f"centre held, {doubt}"
            turn, used, _ = self._turn(window, ring)
        if self.config.differencing == "events" and isinstance(turn, MarkerTurn):
            near, bearings = ring.near(_points(window))
            turn = turn_of_events(window.t[near], bearings, max_omega_rad_s=self.config.max_omega_rad_s)
        return self._measured(t_us, turn, ring, held=held, seen=seen, used=used)

    def _turn(self, window: Events, ring: Ring) -> tuple[MarkerTurn | NoTurn, int, float]:
        """Return the turn of the marker in the window, the events used, all on the ring, and the arc they span."""
        config = self.config
        window = window[:: len(window) // _TURN_EVENTS + 1]
        near, bearings = ring.near(_points(window))
        share = len(bearings) / len(window)
        if share < config.least_inlier_share:
            reason = f"no marker: {share:.0%} of the window's events lie on the circle"
            return NoTurn(reason=reason), len(bearings), arc_rad(bearings)
        turn = turn_of_marker(
            window.t[near],
            bearings,
            slot_us=config.slot_us,
            least_resultant=config.least_resultant,
            max_omega_rad_s=config.max_omega_rad_s,
        )
        return turn, len(bearings), arc_rad(bearings)

    def _measured(
        self, t_us: int, turn: MarkerTurn | NoTurn, ring: Ring, *, held: str, seen: int, used: int
    ) -> MotionEstimate:
        """Smooth ω and return its row, unless it is not constrained."""
        sigma_px = math.inf if held else ring.sigma_px
        if isinstance(turn, MarkerTurn):
            omega, before = turn.omega_rad_s, self._omega_rad_s
            sigma = math.hypot(turn.omega_sigma_rad_s, omega * ring.sigma_px / ring.radius_px)
            if sigma <= max(_LEAST_SIGMA_RAD_S, _SIGMA_SHARE * abs(omega)):
                smooth = omega if before is None else before + self.config.omega_smoothing * (omega - before)
                self._omega_rad_s = smooth
                return self._row(
                    t_us, doubt=held, seen=seen, used=used, sigma_px=sigma_px, sigma_rad_s=sigma, confident=True
                )
            turn = NoTurn(reason=f"ω is not constrained: {omega:.3g} ± {sigma:.2g} rad/s")
        doubt = f"{turn.reason}; {held}" if held else turn.reason
        return self._row(t_us, doubt=doubt, seen=seen, used=used, sigma_px=sigma_px)

    def _row(
        self,
        t_us: int,
        *,
        doubt: str,
        seen: int,
        used: int = 0,
        sigma_px: float = math.inf,
        sigma_rad_s: float = math.inf,
        confident: bool = False,
    ) -> MotionEstimate:
        return MotionEstimate(
            t_us=t_us,
            center_px=self._ring.center_px if self._ring else (math.nan, math.nan),
            omega_rad_s=self._omega_rad_s or 0.0,
            center_sigma_px=sigma_px,
            omega_sigma_rad_s=sigma_rad_s,
            confident=confident,
            doubt=doubt,
            events_used=used,
            events_seen=seen,
        )


def _points(events: Events) -> NDArray[np.float64]:
    return np.column_stack([events.x, events.y]).astype(np.float64)
