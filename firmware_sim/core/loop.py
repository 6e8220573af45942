"""Send a chunk of events through function and timing together: what is dropped depends on both."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from tiegocancel.firmware_sim.core.function import decide, rings_held
from tiegocancel.firmware_sim.core.plan import Clock, Plan
from tiegocancel.firmware_sim.core.rule import Rule, State
from tiegocancel.firmware_sim.core.timing import drops, issue_event, take
from tiegocancel.firmware_sim.jit import jit

__all__ = ["DROPPED", "RESIDUAL", "SUPPRESSED", "run_chunk"]

Int64s = NDArray[np.int64]

RESIDUAL, SUPPRESSED, DROPPED = 0, 1, 2
"""What becomes of an event."""


@jit
def run_chunk(
    rule: Rule,
    state: State,
    plan: Plan,
    clock: Clock,
    t: Int64s,
    x: NDArray[np.uint16],
    y: NDArray[np.uint16],
    p: NDArray[np.uint8],
    arrival: Int64s,
    saturated: int,
    ops: NDArray[np.int64],
    fate: NDArray[np.uint8],
    cycles: NDArray[np.int64],
) -> Any:
    """Fill ``fate`` [n] and ``cycles`` [n, 6]: taken, first issue, match issued, decided, left; −1 where dropped.

    The last column is not a cycle: how many entries the rings hold after the event.

    ``arrival`` [n] rises; when ``saturated`` it is not looked at: the next event always waits.
    """
    for i in range(len(t)):
        if not saturated and drops(plan, clock, arrival[i]):
            fate[i] = DROPPED
            cycles[i, :] = -1
            continue
        taken = take(plan, clock, -1 if saturated else arrival[i])
        suppressed, count, slot = decide(rule, state, t[i], int(x[i]), int(y[i]), int(p[i]), ops)
        first, issued, commit, decided, left = issue_event(
            rule, plan, clock, taken + plan.predict_depth, suppressed, ops, count
        )
        if slot >= 0:
            state.ring_ready[slot] = commit + 2
        fate[i] = suppressed
        cycles[i, 0], cycles[i, 1], cycles[i, 2], cycles[i, 3], cycles[i, 4] = taken, first, issued, decided, left
        cycles[i, 5] = rings_held(rule, state)
