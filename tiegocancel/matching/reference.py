"""Run the thesis's Algorithm 1 (§5.9) over a stream, in NumPy and SciPy.

The algorithm, as printed: every event is predicted one horizon ahead and pushed on a min-heap, then appended to a
buffer of real events; while the top of the heap is due, all predictions within ±ε_t of now are popped, the real events
within ±ε_t of any of them are taken from the buffer, each looks for its nearest prediction within ε_xy, those of the
right polarity are sorted by distance and accepted one to one. :mod:`.reference_loop` does exactly that, event by
event; :func:`run_reference` forms the same batches by binary search, because with one horizon the heap is a FIFO, and
is held equal to the loop by tests.

What the text leaves open or contradicts, and our reading:

1. **Order of push and match** (lines 6 to 9). The prediction is pushed first, so an event may meet its own:
   ``allow_self_match``, on by default because it is printed. It is no corner case: popping "all within ±ε_t" decides
   predictions up to ε_t *before* they are due, so own predictions are met while Δt ≤ 2ε_t.
2. **When a prediction is decided.** Line 8 and §5.4 pop what is due, line 9 and §5.8 pop within ±ε_t. We follow line
   9: ``release="printed"``. What is popped and finds nothing is gone, so real events later than now never meet it, and
   decisions fall in batches about ε_t wide: time bins, which §8.3 says were removed. ``release="closed"`` decides
   predictions, ε_t of them at a time, once their gates have closed, and with ``gate="pair"`` gives the symmetric window
   of eq. (4.4).
3. **Predictions older than now − ε_t** are due but not within ±ε_t: line 8 would wait for them for ever. They are
   popped and counted as ``stale``.
4. **The gate in time.** Line 10 takes real events within ε_t of *some* popped prediction and line 14 does not look at
   time again: ``gate="batch"``. Eq. (4.4) and (5.2) gate each pair: ``gate="pair"``.
5. **Polarity before or after the nearest.** Lines 14 and 15 take the nearest prediction and drop the proposal when its
   polarity is wrong; eq. (5.3) enforces polarity on the candidates: ``polarity_first``.
6. **Polarity itself.** ``opposite`` asks that the anti-event oppose the real event: ``p_j = p_i`` (``semantics.md``).
7. **Pairing.** Line 19 is greedy by distance; §5.5, §6.3.1 and the summary say mutual nearest neighbours: ``pairing``.
8. **Distances** are taken at the sub-pixel place of the prediction; ties fall as the index has them.
9. **What counts as cancelled.** §5.6 marks ``e_i``, line 24 removes ``e_j``, §4.6 both: ``suppressed`` are the
   ``e_j``, ``used`` the ``e_i``; ``CR`` and ``CR_pairs`` of ``semantics.md`` follow from them.
10. **Predictions outside the image** are not pushed (§5.8 discards them "after (5.1)").
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.forecast import Forecast
from tiegocancel.matching.pairing import pair_up
from tiegocancel.matching.reference_config import AdaptiveTolerance, ReferenceConfig
from tiegocancel.motion.rotation import RotationTrajectory

__all__ = ["AdaptiveTolerance", "Match", "ReferenceConfig", "ReferenceResult", "run_reference"]


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """The accepted pairs, columns of one length: rows of the stream, distance in px, event minus prediction in time."""

    real: NDArray[np.int64]
    source: NDArray[np.int64]
    distance_px: NDArray[np.float64]
    late_us: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceResult:
    """What the algorithm returns (line 24), and the stream it saw.

    ``match``: the pairs; ``suppressed`` bool[n]: real events that met a prediction, the rest is the real residual;
    ``used`` bool[n]: events whose prediction was met; ``residual_predicted`` bool[n]: predictions that were made and
    met nothing; ``outside`` and ``stale``: predictions never made and never decided in time.
    """

    match: Match
    suppressed: NDArray[np.bool_]
    used: NDArray[np.bool_]
    residual_predicted: NDArray[np.bool_]
    outside: int
    stale: int
    forecast: Forecast


def run_reference(events: Events, motion: RotationTrajectory, config: ReferenceConfig) -> ReferenceResult:
    """Run the algorithm over a stream; warm-up is the caller's to leave out (``config.warm_up_us``)."""
    forecast = Forecast.of(events, motion, config)
    alive = np.ones(len(events), np.bool_)
    matches: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]] = []
    stale = 0
    first_alive = 0
    for batch in _batches(forecast, config):
        stale += batch.stale
        # Real events that are gone at the left end never come back: at Δt = 0 that keeps the window at one event.
        first_alive = max(first_alive, batch.left)
        while first_alive < batch.right and not alive[first_alive]:
            first_alive += 1
        left = max(batch.left, first_alive)
        if left >= batch.right or not len(batch.predicted):
            continue
        real = left + np.flatnonzero(alive[left : batch.right])
        pairs = pair_up(real, batch.predicted, forecast, config)
        alive[pairs[0]] = False
        matches.append(pairs)
    return finish(forecast, matches, stale)


def finish(
    forecast: Forecast,
    matches: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]],
    stale: int,
) -> ReferenceResult:
    """Turn the pairs of all batches into the result."""
    none = (np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.float64))
    real, source, far = (np.concatenate([part[column] for part in (none, *matches)]) for column in range(3))
    suppressed, used = np.zeros(len(forecast), np.bool_), np.zeros(len(forecast), np.bool_)
    suppressed[real], used[source] = True, True
    return ReferenceResult(
        match=Match(real, source, far, forecast.t_us[real] - forecast.due_us[source]),
        suppressed=suppressed,
        used=used,
        residual_predicted=forecast.made & ~used,
        outside=int(np.count_nonzero(~forecast.made)),
        stale=stale,
        forecast=forecast,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Batch:
    """Predictions popped together (rows of their events), the real rows ``left ≤ j < right``, how many were stale."""

    predicted: NDArray[np.int64]
    left: int
    right: int
    stale: int


def _batches(forecast: Forecast, config: ReferenceConfig) -> Iterator[_Batch]:
    """Yield what lines 8 to 10 pop and gather, in order, by binary search over the queue of predictions made."""
    gate_us = config.tolerance_us
    queue = np.flatnonzero(forecast.made)
    # As lists: at Δt = 0 there is a batch for each event, and a search from Python costs a tenth of one from NumPy.
    t, due, pushed_at = forecast.t_us.tolist(), forecast.due_us[queue].tolist(), queue.tolist()
    closed = config.release == "closed"
    head, row = 0, 0
    while head < len(queue):
        # The event at which the top is due, or its gate has been closed for ε_t; it must have been pushed by then.
        waiting = bisect_right(t, due[head] + 2 * gate_us) if closed else bisect_left(t, due[head])
        row = max(row, waiting, pushed_at[head])
        seen = min(row + 1, len(t))
        if row < len(t):
            now = t[row]
        elif closed and due[head] <= t[-1] + gate_us:
            now = due[head] + 2 * gate_us + 1  # the stream has ended: the clock goes on by itself
        else:
            return
        if closed:
            first, last = head, min(bisect_left(due, now - gate_us), bisect_right(due, due[head] + gate_us))
        else:
            first = max(head, bisect_left(due, now - gate_us))
            last = min(bisect_right(due, now + gate_us), bisect_right(pushed_at, row))
        stale, head = first - head, max(last, head)
        if first >= last:
            yield _Batch(queue[:0], 0, 0, stale)
            continue
        left = bisect_left(t, due[first] - gate_us)
        right = min(bisect_right(t, due[last - 1] + gate_us), seen)
        yield _Batch(queue[first:last], left, right, stale)
