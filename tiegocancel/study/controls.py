"""Run what a ratio has to be compared with: the same events under motions that are wrong, and by chance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tiegocancel.events import Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.metrics import Tally

__all__ = ["CONTROLS", "SHUFFLE_BLOCK", "Control", "ControlKind", "ShuffledControl"]

SHUFFLE_BLOCK = 1 << 19
"""Events within which pixels are permuted against times, whatever the chunks of the stream."""


@dataclass(frozen=True, slots=True)
class ControlKind:
    """``name`` in results, ``label`` and ``meaning`` in words."""

    name: str
    label: str
    meaning: str


CONTROLS = {
    kind.name: kind
    for kind in (
        ControlKind("zero_motion", "zero motion", "predict “same place”: what slow motion and a wide gate give"),
        ControlKind("reversed_motion", "reversed motion", "turn the other way: wrong everywhere but at the centre"),
        ControlKind("time_shuffled", "shuffled times", "true motion on pixels permuted against their times: chance"),
    )
}


class Control:
    """Decide and count the events of the main run with another canceller."""

    def __init__(self, canceller: Canceller, tally: Tally) -> None:
        self.canceller, self.tally = canceller, tally

    @property
    def oldest_us(self) -> int | None:
        """Time of the oldest event that is not decided yet."""
        return None

    def process(self, events: Events) -> None:
        """Take a chunk."""
        self.tally.add(events, self.canceller.process(events).suppressed)

    def finish(self) -> None:
        """Take what is still held back."""


class ShuffledControl(Control):
    """Permute pixel, polarity and label against the times first, in blocks of :data:`SHUFFLE_BLOCK` events.

    With ``block_us`` a block also ends where it would become longer than that, so that little is held of a slow stream.
    ``shortest_us`` is the span of the shortest full block, or of the only one: where that is not much longer than the
    horizon, some structure survives the shuffle and the control stands too high.
    """

    def __init__(self, canceller: Canceller, tally: Tally, seed: int, *, block_us: int | None = None) -> None:
        super().__init__(canceller, tally)
        self._block_us = block_us
        self._rng = np.random.default_rng(seed)
        self._held: list[Events] = []
        self._count = 0
        self.shortest_us: int | None = None

    @property
    def oldest_us(self) -> int | None:
        """Time of the oldest event that is not decided yet."""
        return next((int(part.t[0]) for part in self._held if len(part)), None)

    def process(self, events: Events) -> None:
        """Take a chunk; decide whenever a block is full."""
        self._held.append(events)
        self._count += len(events)
        if not self._count or not (self._count >= SHUFFLE_BLOCK or self._lasts_too_long(events)):
            return
        whole = Events.concatenate(self._held)
        done = 0
        while size := self._full_block(whole[done:]):
            block = whole[done : done + size]
            self.shortest_us = min(block.span_us, block.span_us if self.shortest_us is None else self.shortest_us)
            self._decide(block)
            done += size
        self._held, self._count = [whole[done:]], self._count - done

    def _lasts_too_long(self, events: Events) -> bool:
        """Tell whether what is held and ends with ``events`` spans more than a block may."""
        if self._block_us is None or not len(events):
            return False
        oldest_us = self.oldest_us
        return oldest_us is not None and int(events.t[-1]) >= oldest_us + self._block_us

    def _full_block(self, events: Events) -> int:
        """Return the length of the full block that events begin with, 0 where they do not fill one."""
        size = SHUFFLE_BLOCK if len(events) >= SHUFFLE_BLOCK else 0
        if self._block_us is not None and len(events):
            within = int(np.searchsorted(events.t, int(events.t[0]) + self._block_us, side="left"))
            size = min(within, size or within) if within < len(events) else size
        return size

    def finish(self) -> None:
        """Decide the last block, shorter than the others."""
        if self._count:
            block = Events.concatenate(self._held)
            self.shortest_us = block.span_us if self.shortest_us is None else self.shortest_us
            self._decide(block)
        self._held, self._count = [], 0

    def _decide(self, block: Events) -> None:
        order = self._rng.permutation(len(block))
        label = None if block.label is None else block.label[order]
        shuffled = Events(block.t, block.x[order], block.y[order], block.p[order], block.width, block.height, label)
        super().process(shuffled)
