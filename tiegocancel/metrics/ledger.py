"""Follow each event until its fate is final: whether it was suppressed, whether its prediction was used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.canceller import Decisions
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules, schedules_for
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.motion.trajectory import Trajectory

__all__ = ["Ledger", "Matches", "Settled"]


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """Events whose fate is final: ``suppressed`` bool[n], ``used`` bool[n] (their prediction suppressed another)."""

    events: Events
    suppressed: NDArray[np.bool_]
    used: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Residuals of the matches of one chunk, real event minus prediction.

    ``t_us`` int64[m] time of the suppressed event; ``dx`` ``dy`` int64[m] px; ``late_us`` int64[m]; ``ahead_x``
    ``ahead_y`` int64[m] px, the pixel that was predicted.
    """

    t_us: NDArray[np.int64]
    dx: NDArray[np.int64]
    dy: NDArray[np.int64]
    late_us: NDArray[np.int64]
    ahead_x: NDArray[np.int64]
    ahead_y: NDArray[np.int64]


class Ledger:
    """Keep the events of the last ``Δt + ε_t``: only their predictions can still be used.

    ``motion`` may be replaced between chunks, when it still says the same of the events that are held.
    """

    def __init__(self, config: CancelConfig, motion: MotionSchedule | Schedules | Trajectory) -> None:
        self._config, self.motion = config, motion
        self._held: Settled | None = None
        self._first = 0  # index in the stream of the first event held

    @property
    def oldest_us(self) -> int | None:
        """Time of the oldest event held."""
        return int(self._held.events.t[0]) if self._held is not None and len(self._held.events) else None

    def add(self, events: Events, decisions: Decisions) -> tuple[Settled, Matches]:
        """Take a chunk with its decisions (``source`` tracked); return what became final, and the chunk's matches."""
        if decisions.source is None:
            raise ValueError("the ledger needs decisions with source: Canceller(..., track_source=True)")
        offset = 0
        unused = np.zeros(len(events), np.bool_)
        held = Settled(events, decisions.suppressed, unused)
        if self._held is not None:
            offset = len(self._held.events)
            held = Settled(
                Events.concatenate([self._held.events, events]),
                np.concatenate([self._held.suppressed, decisions.suppressed]),
                np.concatenate([self._held.used, unused]),
            )
        met = np.flatnonzero(decisions.suppressed)
        made = decisions.source[met] - self._first
        held.used[made] = True
        which = None if decisions.horizon is None else decisions.horizon[met]
        matches = self._matches(held.events, met + offset, made, which)
        config = self._config
        horizon = config.horizons_us[-1] + config.late_gate_us + (1 << config.tick_bits) - 1
        done = 0
        if len(held.events):
            done = int(np.searchsorted(held.events.t, held.events.t[-1] - horizon, side="left"))
        self._held = Settled(held.events[done:], held.suppressed[done:].copy(), held.used[done:].copy())
        self._first += done
        return Settled(held.events[:done], held.suppressed[:done], held.used[:done]), matches

    def close(self) -> Settled | None:
        """Return the events that were still open, final now because the stream has ended."""
        held, self._held = self._held, None
        return held

    def _matches(
        self, events: Events, met: NDArray[np.int64], made: NDArray[np.int64], which: NDArray[np.uint8] | None
    ) -> Matches:
        """Compare each suppressed event with the prediction that it met, ``which`` naming its horizon."""
        t, x, y = events.t[made], events.x[made], events.y[made]
        ahead_x, ahead_y, horizon_us = (np.zeros(len(made), np.int64) for _ in range(3))
        for index, horizon in enumerate(self._config.horizons_us):
            rows = np.arange(len(made)) if which is None else np.flatnonzero(which == index)
            ahead_x[rows], ahead_y[rows] = self._ahead(t[rows], x[rows], y[rows], index)
            horizon_us[rows] = horizon
        return Matches(
            t_us=events.t[met],
            dx=events.x[met].astype(np.int64) - ahead_x,
            dy=events.y[met].astype(np.int64) - ahead_y,
            late_us=events.t[met] - (t + horizon_us),
            ahead_x=ahead_x,
            ahead_y=ahead_y,
        )

    def _ahead(
        self, t: NDArray[np.int64], x: NDArray[np.uint16], y: NDArray[np.uint16], index: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where events were expected by one of the horizons."""
        config = self._config
        horizon_us = config.horizons_us[index]
        asked = t + (horizon_us - config.early_gate_us) if config.motion_at == "gate" else t
        if isinstance(self.motion, MotionSchedule | tuple):
            return schedules_for(config, self.motion)[index].predict(asked, x, y, horizon_us)
        return self.motion.predict(asked, x, y, horizon_us)
