"""State the plain rule, one event at a time: the model that every implementation must equal bit for bit."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from tiegocancel.events import Events
from tiegocancel.matching.ahead import ahead
from tiegocancel.matching.canceller import Counters, Decisions
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.selective import Schedules
from tiegocancel.matching.selective_oracle import SelectiveOracle
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.motion.trajectory import Trajectory

__all__ = ["OracleCanceller"]


@dataclass(slots=True)
class _Prediction:
    """Expect an event of polarity ``p`` at pixel ``(x, y)`` and time ``t_us``, caused by event ``source``."""

    t_us: int
    x: int
    y: int
    p: int
    source: int


class OracleCanceller:
    """Decide as ``semantics.md`` says, in plain Python: slow, readable, with the interface of ``Canceller``.

    Every configuration is served; what goes beyond the plain rule is :class:`SelectiveOracle`'s.
    """

    def __init__(
        self, config: CancelConfig, motion: MotionSchedule | Schedules | Trajectory, *, width: int, height: int
    ) -> None:
        self.config, self.motion, self.width, self.height = config, motion, width, height
        self._selective = None if config.is_plain else SelectiveOracle(config, motion, width=width, height=height)
        self._ring: deque[_Prediction] = deque()
        self._table: dict[tuple[int, int], _Prediction] = {}
        self._counts = dict(Counters())

    @property
    def counters(self) -> Counters:
        """Return the counts so far."""
        return Counters(**self._counts) if self._selective is None else self._selective.counters

    @property
    def pending(self) -> int:
        """Number of predictions in the ring."""
        return len(self._ring) if self._selective is None else self._selective.pending

    @property
    def most_held(self) -> tuple[int, ...]:
        """Most entries that each ring ever held."""
        return (self._counts["ring_high_water"],) if self._selective is None else self._selective.most_held

    def process(self, events: Events) -> Decisions:
        """Decide every event of a chunk; chunks may be cut anywhere."""
        if self._selective is not None:
            self._selective.motion = self.motion
            return self._selective.process(events)
        suppressed = np.zeros(len(events), np.bool_)
        source = np.full(len(events), -1, np.int64)
        for i in range(len(events)):
            t, x, y, p = int(events.t[i]), int(events.x[i]), int(events.y[i]), int(events.p[i])
            self._drain(t)
            met = self._match(t, x, y, p)
            if met is not None:
                suppressed[i], source[i] = True, met.source
                self._counts["suppressed"] += 1
            self._predict(t, x, y, p, self._counts["events"])
            self._counts["events"] += 1
        return Decisions(suppressed=suppressed, source=source)

    def _drain(self, t: int) -> None:
        """Move every prediction whose gate has opened from the ring to its pixel's cell."""
        gate = self.config.tolerance_us
        while self._ring and self._ring[0].t_us - gate <= t:
            due = self._ring.popleft()
            old = self._table.get((due.x, due.y))
            if old is not None and t <= old.t_us + gate:
                self._counts["overwritten"] += 1
            self._table[due.x, due.y] = due

    def _match(self, t: int, x: int, y: int, p: int) -> _Prediction | None:
        """Take the nearest live prediction inside both gates out of the table."""
        for dx, dy in self.config.offsets:
            cell = self._table.get((x + dx, y + dy))
            if cell is None or abs(t - cell.t_us) > self.config.tolerance_us:
                continue
            same = cell.p == p
            if self.config.polarity == "ignore" or same == (self.config.polarity == "opposite"):
                del self._table[x + dx, y + dy]
                return cell
        return None

    def _predict(self, t: int, x: int, y: int, p: int, index: int) -> None:
        """Expect the same edge one horizon later, unless it leaves the sensor or the ring is full."""
        motion = self.motion[0] if isinstance(self.motion, tuple) else self.motion
        ahead_x, ahead_y = ahead(motion, t, x, y, self.config.horizon_us)
        if not (0 <= ahead_x < self.width and 0 <= ahead_y < self.height):
            self._counts["outside"] += 1
        elif len(self._ring) == self.config.ring_capacity:
            self._counts["overflow"] += 1
        else:
            self._ring.append(_Prediction(t + self.config.horizon_us, ahead_x, ahead_y, p, index))
            self._counts["predicted"] += 1
            self._counts["ring_high_water"] = max(self._counts["ring_high_water"], len(self._ring))
