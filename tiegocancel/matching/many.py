"""Decide the same events under many configurations at once: the plain rule, batched for sweeps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["MAX_TABLE_BYTES", "ManyDecisions", "cancel_many"]

MAX_TABLE_BYTES = 1 << 28
"""Bytes of tables in one launch; more configurations take more launches."""

_KINDS = {"opposite": 0, "equal": 1, "ignore": 2}


@dataclass(frozen=True, slots=True, eq=False)
class ManyDecisions:
    """``suppressed`` bool[m, n]; ``source`` int32[m, n], row of the event whose prediction was used, −1 where none.

    ``ring_high_water`` int64[m]: events whose predictions waited at most, those beyond the sensor included.
    """

    suppressed: NDArray[np.bool_]
    source: NDArray[np.int32]
    ring_high_water: NDArray[np.int64]


def cancel_many(
    events: Events, points: Sequence[tuple[CancelConfig, MotionSchedule]], *, chained: bool = False
) -> ManyDecisions:
    """Return the decisions of ``m`` plain cancellers, each from an empty state, with rings that never overflow.

    Each equals ``Canceller(config, schedule).process(events)`` with ``ring_capacity`` of the stream's length or more.
    ``chained`` keeps every prediction of a pixel instead of the last, and an event takes the oldest that is open: the
    same rule with memory without bound. The events are decoded once; configurations run on as many threads as the
    kernels have. Raise ``ValueError`` for a configuration beyond the plain rule and for a schedule of another horizon.
    """
    from tiegocancel.kernels.many import cancel_many as launch

    for config, schedule in points:
        if not config.is_plain:
            raise ValueError("many configurations at once are for the plain rule; Canceller runs the selective one")
        schedule.serve(config.horizon_us)
    count = len(events)
    border = max((max(abs(dx) for dx, _ in config.offsets) for config, _ in points), default=0)
    stride = events.width + border
    table = (events.height + 2 * border) * stride + border
    suppressed = np.zeros((len(points), count), np.uint8)
    source = np.full((len(points), count), -1, np.int32)
    high_water = np.zeros(len(points), np.int64)
    width = max(min(len(points), MAX_TABLE_BYTES // (4 * table)), 1)
    cells = np.empty((width, table), np.int32)
    older = np.empty((width, count if chained else 1), np.int32)
    for first in range(0, len(points) if count else 0, width):
        part = points[first : first + width]
        rows = slice(first, first + len(part))
        windows = [[dy * stride + dx for dx, dy in config.offsets] for config, _ in part]
        ends = np.cumsum([0, *map(len, windows)])
        entries, coefficients = _motions(events, [schedule for _, schedule in part])
        launch(
            chained=chained,
            width=events.width,
            height=events.height,
            stride=stride,
            origin=border * stride + border,
            t=events.t,
            x=events.x,
            y=events.y,
            p=events.p,
            horizon_us=np.array([config.horizon_us for config, _ in part], np.int64),
            gate_us=np.array([config.tolerance_us for config, _ in part], np.int64),
            flip=np.array([_KINDS[config.polarity] for config, _ in part], np.int32),
            window=np.column_stack([ends[:-1], ends[1:]]).astype(np.int32),
            offsets=np.concatenate(windows).astype(np.int32),
            entries=entries,
            coefficients=coefficients,
            cells=cells[: len(part)],
            older=older[: len(part)],
            suppressed=suppressed[rows],
            source=source[rows],
            high_water=high_water[rows],
        )
    return ManyDecisions(suppressed.view(np.bool_), source, high_water)


def _motions(events: Events, schedules: Sequence[MotionSchedule]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the rows at which each schedule changes, int32[m, S + 1], and its entries from there, int64[m, S, 6]."""
    used = []
    for schedule in schedules:
        first, last = (int(entry) for entry in schedule.entry_at(events.t[[0, -1]]))
        inner = np.searchsorted(events.t, schedule.t_us[first + 1 : last + 1], side="left")
        used.append((np.concatenate([[0], inner]), schedule.coefficients[first : last + 1]))
    most = max(len(rows) for rows, _ in used)
    entries = np.full((len(used), most + 1), len(events), np.int32)
    coefficients = np.zeros((len(used), most, 6), np.int64)
    for place, (rows, table) in enumerate(used):
        entries[place, : len(rows)] = rows
        coefficients[place, : len(table)] = table
    return entries, coefficients
