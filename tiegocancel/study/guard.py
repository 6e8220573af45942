"""Stop suppressing while the motion is contradicted: while it does no better than no motion at all."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["Guard", "GuardConfig", "GuardCounters", "is_sampled"]

BLOCK_BITS = 4
"""Pixels are sampled in blocks of 16 × 16: single ones would have no neighbours to match with."""
SHARE_BITS = 4
"""One block in 16 is sampled."""
MARGIN_BITS = 8
"""A margin counts 1/256."""
MAX_CHANGES = 200
"""So many times of opening and closing are kept."""
LOSS_BITS = 16
"""A loss counts 1/65,536."""
_LEAST_BITS = 5
"""A window of fewer than 1/32 of its events does not open the guard."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardConfig:
    """Say whether and how the guard judges.

    A window ends after ``window_events`` sampled events, or with the first one ``window_us`` after its own first.
    ``margin`` is the share of them, in steps of 1/256, by which the canceller must beat zero motion for the guard to
    open; it closes below half of that. ``max_loss``: most share of the sampled events that zero motion may have met
    with the support that is asked for, 1 for any; more support is asked for until that holds. Raise ``ValueError``
    with field, rule and value.
    """

    enabled: bool = False
    window_events: int = 1024
    window_us: int = 20_000
    margin: float = 0.125
    max_loss: float = 1.0

    def __post_init__(self) -> None:
        if not 32 <= self.window_events <= 1 << 20:
            raise ValueError(f"window_events must be from 32 to {1 << 20}, not {self.window_events}")
        if not 1 <= self.window_us <= 1 << 28:
            raise ValueError(f"window_us must be from 1 to {1 << 28}, not {self.window_us}")
        if not 2 / (1 << MARGIN_BITS) <= self.margin <= 1.0:
            raise ValueError(f"margin must be from 1/128 to 1, not {self.margin!r}")
        if not 0.0 <= self.max_loss <= 1.0:
            raise ValueError(f"max_loss must be from 0 to 1, not {self.max_loss!r}")

    @property
    def open_at(self) -> int:
        """Margin that opens, in 1/256."""
        return round(self.margin * (1 << MARGIN_BITS))

    @property
    def close_below(self) -> int:
        """Margin below which it closes, in 1/256."""
        return self.open_at // 2

    @property
    def most_lost(self) -> int:
        """Largest loss, in 1/65,536."""
        return round(self.max_loss * (1 << LOSS_BITS))

    @property
    def least_events(self) -> int:
        """Sampled events without which a window does not open the guard."""
        return self.window_events >> _LEAST_BITS


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardCounters:
    """Count since the start of the stream.

    ``sampled`` events; ``hits`` of the canceller and ``still_hits`` of zero motion among them; ``windows`` judged;
    ``closures`` and ``openings``; ``passed``: hits of the canceller that were let through; ``raised``: windows after
    which more support was asked for than the canceller needs.
    """

    sampled: int = 0
    hits: int = 0
    still_hits: int = 0
    windows: int = 0
    closures: int = 0
    openings: int = 0
    passed: int = 0
    raised: int = 0


class Guard:
    """Compare a canceller with zero motion on one pixel in 16, and let hits through while it is not better.

    Integers alone, one event at a time. An event is *sampled* where ``((x >> 4) + 5·(y >> 4)) mod 16 = 0``. A second
    canceller with the same gates predicts "same place", from sampled events and for them. State: ``open``, false at
    the start; ``need``, at the start the canceller's ``K``; ``n``, ``d`` (signed), ``t0`` and a count ``m_k`` for each
    support ``k = K … n + C`` of the window; the second canceller. For each event, in this order:

    1. If it is sampled, ``n > 0`` and ``t − t0 ≥ window_us``: judge.
    2. It is suppressed if it is a hit of the canceller, of support ``need`` at least, and ``open``; the canceller
       itself goes on as ever. By the plain rule the support of a hit is 1.
    3. If it is sampled: ``t0 ← t`` if ``n = 0``; ``n ← n + 1``; ``m_k ← m_k + 1`` for each ``k`` up to its support
       under zero motion; ``d ← d + hit − hit of zero motion``; judge if ``n = window_events``.

    Judge: close if ``256·d < close_below·n``, otherwise open if ``n ≥ window_events / 32`` and ``256·d ≥ open_at·n``,
    otherwise stay. ``need`` becomes the least ``k`` with ``65536·m_k ≤ max_loss·n`` (``max_loss`` in 1/65,536), or one
    beyond all where there is none. Then ``n``, ``d`` and every ``m_k`` are 0.

    The first window that lies in the contradiction as a whole closes it: at most ``2·window_events`` sampled events
    after its beginning, and where events are few with the first one after ``2·window_us`` and two gaps between them.
    It opens as fast, once predictions of the right motion fall due, that is ``Δt`` later.

    What zero motion meets with support ``k`` is met by chance, or for being slow: it stands for events that have
    nothing to do with the motion. Of a mover that goes nearly with the background it says nothing.

    A device holds two counters, one time, one bit, and where ``max_loss`` is below 1 the ``m_k`` and ``need``; and
    for zero motion a table of 1/16 of the pixels (no cell lies outside the sampled blocks) and a ring of 1/8 of the
    canceller's (where events choose a horizon, of what all would need for the longest), twice what an even scene
    asks. A block has no candidates beyond its edge, which costs zero motion a tenth of its hits at a gate of 2 px.
    """

    def __init__(self, config: GuardConfig, cancel: CancelConfig, *, width: int, height: int) -> None:
        self.config = config
        still = cancel.without_motion()
        first, *more = (max(-(-ring // 8), 1) for ring in still.ring_capacities)
        still = replace(still, ring_capacity=first, more_ring_capacities=tuple(more))
        self._still = Canceller(still, MotionSchedule.still(), width=width, height=height, track_source=False)
        self.open = False
        self.changes: list[tuple[int, bool]] = []
        """Time in µs of the event that the guard opened or closed with, and whether it opened; the first ones."""
        self._need = cancel.need
        self._levels = np.arange(cancel.need, len(cancel.horizons_us) + cancel.carry + 1)
        self.needed = cancel.need
        self._n = self._d = self._t0 = 0
        self._met = np.zeros(len(self._levels), np.int64)
        self._counts = {field.name: 0 for field in fields(GuardCounters)}

    @property
    def counters(self) -> GuardCounters:
        """Return the counts so far."""
        return GuardCounters(**self._counts)

    @property
    def state_bits(self) -> int:
        """Bits of a device's state beside the second canceller: ``n``, ``d``, ``t0`` of 30 bits, ``open``, ``m_k``."""
        counter = self.config.window_events.bit_length()
        levels = len(self._levels)
        chance = levels * counter + levels.bit_length() if self.config.max_loss < 1.0 else 0
        return 2 * counter + 1 + 30 + 1 + chance

    def process(
        self, events: Events, hits: NDArray[np.bool_], support: NDArray[np.uint8] | None = None
    ) -> NDArray[np.bool_]:
        """Return bool[n], true where an event is suppressed; ``hits`` bool[n] and ``support`` are the canceller's.

        Without ``support`` every hit has what the canceller needs, and no more. Chunks may be cut anywhere and may be
        empty.
        """
        chosen = is_sampled(events.x, events.y)
        place, sampled = np.flatnonzero(chosen), events.select(chosen)
        chance = self._still.process(sampled)
        met = chance.suppressed.astype(np.uint8) if chance.support is None else chance.support
        mine, still = hits[place], met >= self._need
        # Sums before each sampled event of what zero motion met with each support.
        met_before = np.zeros((len(place) + 1, len(self._levels)), np.int64)
        np.cumsum(met[:, None] >= self._levels, axis=0, out=met_before[1:])
        # Sums before each sampled event, so that a window's d is one difference.
        better = np.concatenate([[0], np.cumsum(mine.astype(np.int64) - still)])
        asked = np.empty(len(events), np.int64)
        done = 0  # rows of the chunk that the guard has decided
        first = 0
        while first < len(place):
            if self._n == 0:
                self._t0 = int(sampled.t[first])
            full = first + self.config.window_events - self._n
            late = first + int(np.searchsorted(sampled.t[first:full], self._t0 + self.config.window_us, side="left"))
            last = min(full, late, len(place))
            self._n += last - first
            self._d += int(better[last] - better[first])
            self._met += met_before[last] - met_before[first]
            first = last
            if late < min(full, len(place)):  # rule 1: the next sampled event finds the window over
                effect = int(place[late])
            elif full <= len(place):  # rule 3: the last one fills it
                effect = int(place[full - 1]) + 1
            else:
                break
            asked[done:effect] = self._asked
            done = effect
            self._judge(int(sampled.t[late] if late < min(full, len(place)) else sampled.t[full - 1]))
        asked[done:] = self._asked
        suppressed: NDArray[np.bool_] = hits & ((self._need if support is None else support) >= asked)
        for name, count in (
            ("sampled", len(place)),
            ("hits", np.count_nonzero(mine)),
            ("still_hits", np.count_nonzero(still)),
            ("passed", np.count_nonzero(hits) - np.count_nonzero(suppressed)),
        ):
            self._counts[name] += int(count)
        return suppressed

    def summary(self) -> dict[str, Any]:
        """Return counts, bits of state and the first changes for JSON."""
        return {
            **self._counts,
            "open": self.open,
            "changes": [{"t_us": t_us, "open": opened} for t_us, opened in self.changes],
            "state_bits": self.state_bits,
            "needed": self.needed,
        }

    def prepare(self) -> None:
        """Compile the kernel now instead of at the first event."""
        self._still.prepare()

    @property
    def _asked(self) -> int:
        """Support without which nothing is suppressed now."""
        return self.needed if self.open else int(self._levels[-1]) + 1

    def _judge(self, now_us: int) -> None:
        """End the window, and open or close."""
        lead = self._d << MARGIN_BITS
        enough = self._n >= self.config.least_events
        was = self.open
        if lead < self.config.close_below * self._n:
            self.open = False
        elif enough and lead >= self.config.open_at * self._n:
            self.open = True
        within = np.flatnonzero(self._met << LOSS_BITS <= self.config.most_lost * self._n)
        self.needed = int(self._levels[within[0]] if len(within) else self._levels[-1] + 1)
        self._counts["raised"] += self.needed > self._need
        self._counts["windows"] += 1
        if self.open != was:
            self._counts["openings" if self.open else "closures"] += 1
            if len(self.changes) < MAX_CHANGES:
                self.changes.append((now_us, self.open))
        self._n = self._d = 0
        self._met[:] = 0


def is_sampled(x: NDArray[np.uint16], y: NDArray[np.uint16]) -> NDArray[np.bool_]:
    """Tell which pixels are sampled: one block in 16 of every row of blocks, shifted from row to row."""
    block = (x >> np.uint16(BLOCK_BITS)) + np.uint16(5) * (y >> np.uint16(BLOCK_BITS))
    sampled: NDArray[np.bool_] = (block & np.uint16((1 << SHARE_BITS) - 1)) == 0
    return sampled
