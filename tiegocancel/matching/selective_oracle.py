"""State the whole rule plainly, one event at a time: several horizons, carried support, shared and latched cells."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tiegocancel.events import Events
from tiegocancel.matching.ahead import ahead, displacement
from tiegocancel.matching.canceller import Counters, Decisions
from tiegocancel.matching.config import MAX_SHIFT_PX, CancelConfig
from tiegocancel.matching.selective import Schedules, schedules_for
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.motion.trajectory import Trajectory

__all__ = ["SelectiveOracle"]

Bin = tuple[int, int]


@dataclass(slots=True, frozen=True)
class _Entry:
    """Remember event ``index`` until its last prediction has fallen due."""

    t_us: int
    x: int
    y: int
    p: int
    support: int
    index: int


@dataclass(slots=True)
class _Cell:
    """Expect events of polarity ``p`` in ``bin`` at tick ``due``, as ``horizons`` say; no horizons, no cell."""

    bin: Bin = (0, 0)
    due: int = 0
    p: int = 0
    horizons: set[int] = field(default_factory=set)
    uses: int = 0
    support: int = 0
    source: int = -1
    last: int = 0
    fine: tuple[int, int] = (0, 0)  # the predicted place in 2^-fraction_bits px, where lines are asked for


class SelectiveOracle:
    """Decide as ``semantics.md`` says for every configuration, the plain rule included: slow, readable.

    ``motion`` is a schedule, one for each horizon, or a trajectory (float path); it may be replaced between chunks.
    ``line_px`` needs schedules, and raises ``ValueError`` for a trajectory.
    """

    def __init__(
        self, config: CancelConfig, motion: MotionSchedule | Schedules | Trajectory, *, width: int, height: int
    ) -> None:
        self.config, self.motion, self.width, self.height = config, motion, width, height
        self._horizons = [horizon >> config.tick_bits for horizon in config.horizons_us]
        self._early = config.early_gate_us >> config.tick_bits
        self._late = [gate >> config.tick_bits for gate in config.late_gates_us]  # of OFF and of ON predictions
        # As (offset, least squared shift at which it is looked at), in the order of preference.
        self._window = tuple(zip(config.offsets, config.spread_shifts_squared, strict=True))
        # Every ring by the numbers under which its entries were stored; one ring unless events choose among horizons.
        self._rings: list[dict[int, _Entry]] = [{} for _ in config.ring_capacities]
        self._stored = [0] * len(self._rings)
        self._passed = [0] * len(self._horizons)
        self._held = [0] * len(self._rings)
        self._table: dict[Bin, list[_Cell]] = {}  # the ways of each set; without sets, one way for each bin
        self._counts = dict(Counters())

    @property
    def counters(self) -> Counters:
        """Return the counts so far."""
        return Counters(**self._counts)

    @property
    def pending(self) -> int:
        """Number of entries in the rings."""
        return sum(len(ring) for ring in self._rings)

    @property
    def most_held(self) -> tuple[int, ...]:
        """Most entries that each ring ever held."""
        return tuple(self._held)

    def process(self, events: Events) -> Decisions:
        """Decide every event of a chunk; chunks may be cut anywhere."""
        maps = self._maps()
        suppressed = np.zeros(len(events), np.bool_)
        source = np.full(len(events), -1, np.int64)
        horizon, supports = np.zeros(len(events), np.uint8), np.zeros(len(events), np.uint8)
        for i in range(len(events)):
            t, x, y, p = int(events.t[i]), int(events.x[i]), int(events.y[i]), int(events.p[i])
            now = t >> self.config.tick_bits
            for h in range(len(self._horizons)):
                self._drain(maps, h, now)
            first, support = self._match(maps, t, x, y, p)
            supports[i] = support
            if first is not None and support >= self.config.need:
                suppressed[i], source[i], horizon[i] = True, first.source, first.last
                self._use(first)
                self._counts["suppressed"] += 1
            self._remember(maps, _Entry(t, x, y, p, min(self.config.carry, support), self._counts["events"]))
            self._counts["events"] += 1
        return Decisions(suppressed=suppressed, source=source, horizon=horizon, support=supports)

    def _drain(self, maps: tuple[MotionSchedule | Trajectory, ...], h: int, now: int) -> None:
        """Move every prediction of horizon ``h`` whose gate has opened to its cell; pass those that are not made."""
        which = h if self.config.chooses else 0
        ring = self._rings[which]
        while self._passed[h] < self._stored[which]:
            entry = ring[self._passed[h]]
            due = (entry.t_us >> self.config.tick_bits) + self._horizons[h]
            if due - self._early > now:
                return
            if self.config.chooses or h == len(self._horizons) - 1:
                del ring[self._passed[h]]
            self._passed[h] += 1
            at, _ = self._place(maps, h, entry)
            if at is not None and due + self._late[entry.p] >= now:
                cell = self._write(at, h, due, entry, now)
                if self.config.lines:
                    cell.fine = self._fine(maps, h, entry)

    def _write(self, at: Bin, h: int, due: int, entry: _Entry, now: int) -> _Cell:
        """Expect in ``at`` what ``entry`` predicts for horizon ``h``, beside or instead of what is expected there."""
        cell = self._cell_for(at, now)
        if self._is_open(cell, now) and cell.bin == at and cell.p == entry.p:
            if h not in cell.horizons:
                cell.horizons.add(h)
            elif self.config.uses:
                if cell.uses == self.config.uses:
                    self._counts["overwritten"] += 1
                cell.uses = min(cell.uses + 1, self.config.uses)
            cell.support = max(cell.support, entry.support)
        else:
            if self._is_open(cell, now):
                self._counts["overwritten"] += 1
            cell.bin, cell.p, cell.horizons, cell.uses, cell.support = at, entry.p, {h}, 1, entry.support
        cell.due, cell.source, cell.last = due, entry.index, h
        return cell

    def _match(
        self, maps: tuple[MotionSchedule | Trajectory, ...], t_us: int, x: int, y: int, p: int
    ) -> tuple[_Cell | None, int]:
        """Return the nearest candidate and the support of all of them together."""
        now = t_us >> self.config.tick_bits
        shift = self._shift_squared(maps, 0, t_us, x, y) if self.config.spreads else 0
        candidates = [
            cell
            for cell, squared in self._cells_near(x, y, now, shift)
            if self._passes(cell, now, p) and squared <= self.config.reaches_squared_px[cell.p]
        ]
        if self.config.lines:
            moves = self._displacement(maps, 0, t_us, x, y)
            candidates = [cell for cell in candidates if self._is_on_line(cell, now, (x, y), moves)]
        if not candidates:
            return None, 0
        votes = set().union(*(cell.horizons for cell in candidates))
        return candidates[0], len(votes) + max(cell.support for cell in candidates)

    def _is_on_line(self, cell: _Cell, now: int, at: tuple[int, int], moves: tuple[int, int]) -> bool:
        """Tell whether an event at ``at`` lies where the prediction of ``cell`` has moved to by then, or nearly."""
        bits = self.config.fraction_bits
        for place, fine, move in zip(at, cell.fine, moves, strict=True):
            most = MAX_SHIFT_PX << (bits + 1)
            velocity = min(max(move >> (15 - bits), -most), most)
            residual = (place << (bits + 1)) - (2 * fine + 1 - (1 << bits))
            if abs(residual * self._horizons[0] - velocity * (now - cell.due)) > self.config.line_limit:
                return False
        return True

    def _fine(self, maps: tuple[MotionSchedule | Trajectory, ...], h: int, entry: _Entry) -> tuple[int, int]:
        """Return the predicted place with ``fraction_bits`` below the pixel; its whole part is the pixel's."""
        across, down = self._displacement(maps, h, self._asked_us(h, entry), entry.x, entry.y)
        bits = 16 - self.config.fraction_bits
        return ((entry.x << 16) + across + 32768) >> bits, ((entry.y << 16) + down + 32768) >> bits

    def _displacement(
        self, maps: tuple[MotionSchedule | Trajectory, ...], h: int, t_us: int, x: int, y: int
    ) -> tuple[int, int]:
        motion = maps[h]
        if not isinstance(motion, MotionSchedule):
            raise ValueError("line_px needs a schedule, not a trajectory")
        return displacement(motion, t_us, x, y)

    def _use(self, cell: _Cell) -> None:
        """Take one use from a cell that was hit; a latched one stays."""
        if self.config.uses:
            cell.uses -= 1
            if cell.uses == 0:
                cell.horizons = set()

    def _remember(self, maps: tuple[MotionSchedule | Trajectory, ...], entry: _Entry) -> None:
        """Store the event, unless its motion gives no prediction or the ring is full."""
        horizons, which = range(len(self._horizons)), 0
        if self.config.chooses:
            which = self._chosen(maps, entry)
            horizons = range(which, which + 1)
        if self.config.motion_at == "event":
            places = [self._place(maps, h, entry) for h in horizons]
            if all(at is None for at, _ in places):
                self._counts["outside" if any(beyond for _, beyond in places) else "still"] += 1
                return
        ring = self._rings[which]
        if len(ring) == self.config.ring_capacities[which]:
            self._counts["overflow"] += 1
            return
        ring[self._stored[which]] = entry
        self._stored[which] += 1
        self._held[which] = max(self._held[which], len(ring))
        self._counts["predicted"] += 1
        self._counts["ring_high_water"] = max(self._counts["ring_high_water"], self.pending)

    def _chosen(self, maps: tuple[MotionSchedule | Trajectory, ...], entry: _Entry) -> int:
        """Return the shortest horizon that moves the event far enough, the longest where none does."""
        for h in range(len(self._horizons) - 1):
            if self._shift_squared(maps, h, entry.t_us, entry.x, entry.y) >= self.config.choose_squared_px:
                return h
        return len(self._horizons) - 1

    def _shift_squared(self, maps: tuple[MotionSchedule | Trajectory, ...], h: int, t_us: int, x: int, y: int) -> int:
        """Return the squared shift over horizon ``h`` by the motion of ``t_us``, on the sensor or beyond."""
        to_x, to_y = ahead(maps[h], t_us, x, y, self.config.horizons_us[h])
        return min(abs(to_x - x), MAX_SHIFT_PX) ** 2 + min(abs(to_y - y), MAX_SHIFT_PX) ** 2

    def _place(self, maps: tuple[MotionSchedule | Trajectory, ...], h: int, entry: _Entry) -> tuple[Bin | None, bool]:
        """Return the bin of the prediction for horizon ``h``, ``None`` if not made, and whether it lies outside."""
        x, y = ahead(maps[h], self._asked_us(h, entry), entry.x, entry.y, self.config.horizons_us[h])
        if not (0 <= x < self.width and 0 <= y < self.height):
            return None, True
        if (x - entry.x) ** 2 + (y - entry.y) ** 2 < self.config.least_shift_squared_px:
            return None, False
        return (x >> self.config.bin_bits, y >> self.config.bin_bits), False

    def _asked_us(self, h: int, entry: _Entry) -> int:
        """Return the time whose motion predicts an entry."""
        if self.config.motion_at == "event":
            return entry.t_us
        return entry.t_us + self.config.horizons_us[h] - self.config.early_gate_us

    def _cells_near(self, x: int, y: int, now: int, shift: int) -> list[tuple[_Cell, int]]:
        """Return the open cells of the bins in the window of an event that moves so far, nearest first, each once.

        Beside each stands the squared distance of its bin's nearest pixel.
        """
        bins: dict[Bin, int] = {}
        for (dx, dy), least in self._window:
            column, row = x + dx, y + dy
            if 0 <= column < self.width and 0 <= row < self.height and shift >= least:
                at = (column >> self.config.bin_bits, row >> self.config.bin_bits)
                bins.setdefault(at, dx * dx + dy * dy)
        return [
            (cell, squared)
            for at, squared in bins.items()
            for cell in self._table.get(self._set_of(at), ())
            if cell.bin == at and self._is_open(cell, now)
        ]

    def _passes(self, cell: _Cell, now: int, p: int) -> bool:
        """Tell whether an event of polarity ``p`` may meet an open cell."""
        if now < cell.due - self._early:
            return False
        return self.config.polarity == "ignore" or (cell.p == p) == (self.config.polarity == "opposite")

    def _is_open(self, cell: _Cell, now: int) -> bool:
        """Tell whether events can still meet a cell."""
        return bool(cell.horizons) and now <= cell.due + self._late[cell.p]

    def _cell_for(self, at: Bin, now: int) -> _Cell:
        """Return the cell to write: the open one of this bin, else the first not open, else the one due first."""
        where = self._set_of(at)
        if where not in self._table:
            self._table[where] = [_Cell() for _ in range(1 if self.config.set_bits is None else self.config.ways)]
        ways = self._table[where]
        for cell in ways:
            if self._is_open(cell, now) and cell.bin == at:
                return cell
        for cell in ways:
            if not self._is_open(cell, now):
                return cell
        return min(ways, key=lambda cell: cell.due)

    def _set_of(self, at: Bin) -> Bin:
        """Return the set in which a bin is kept: its own, or that of the low bits of its column and row."""
        if self.config.set_bits is None:
            return at
        columns, rows = self.config.set_bits
        return at[0] % (1 << columns), at[1] % (1 << rows)

    def _maps(self) -> tuple[MotionSchedule | Trajectory, ...]:
        """Return the motion for each horizon."""
        if isinstance(self.motion, MotionSchedule | tuple):
            return schedules_for(self.config, self.motion)
        return (self.motion,) * len(self._horizons)
