"""Host the kernel of the selective canceller: own its ring and table, and hand it every horizon's schedule."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.motion.schedule import MotionSchedule

__all__ = ["Schedules", "SelectiveEngine", "schedules_for"]

Schedules = tuple[MotionSchedule, ...]
"""One schedule for each horizon of a configuration, rising, all with entries at the same times."""


def schedules_for(config: CancelConfig, motion: MotionSchedule | Schedules) -> Schedules:
    """Return one schedule for each horizon.

    A single schedule serves one horizon, and all of them when it was made for none in particular. Raise ``ValueError``
    when their number, their horizons or their times do not fit.
    """
    given = motion if isinstance(motion, tuple) else (motion,)
    wanted = config.horizons_us
    if len(given) == 1 and given[0].horizon_us is None:
        given = given * len(wanted)
    if len(given) != len(wanted):
        raise ValueError(f"{len(given)} schedules do not serve {len(wanted)} horizons")
    for schedule, horizon_us in zip(given, wanted, strict=True):
        schedule.serve(horizon_us)
        if not np.array_equal(schedule.t_us, given[0].t_us):
            raise ValueError("the schedules of several horizons must have entries at the same times")
    return given


class SelectiveEngine:
    """Decide events with a configuration beyond the plain rule; state is constant and numpy's."""

    def __init__(self, config: CancelConfig, *, width: int, height: int) -> None:
        self._config = config
        tick = config.tick_bits
        horizons = len(config.horizons_us)
        bins_x, bins_y = (((side - 1) >> config.bin_bits) + 1 for side in (width, height))
        columns, rows = config.set_bits or (0, 0)
        ways = 0 if config.set_bits is None else config.ways
        cells = bins_x * bins_y if ways == 0 else ways << (columns + rows)
        if cells >= 1 << 31:
            raise ValueError(f"a table of {cells} cells for {width}×{height} px is beyond 2^31")
        rings = np.array(config.ring_capacities, np.int64)
        capacity = int(rings.sum())
        self.counts: NDArray[np.int64] = np.zeros(8, np.int64)
        self._stored, self._passed = np.zeros(len(rings), np.int64), np.zeros(horizons, np.int64)
        gates = zip(config.late_gates_us, config.reaches_squared_px, strict=True)
        self._options = {
            "horizons": horizons,
            "ways": ways,
            "at_gate": config.motion_at == "gate",
            "chooses": config.chooses,
            "spreads": config.spreads,
            "splits": len({*gates}) > 1,
            "lines": config.lines,
        }
        self._state: dict[str, Any] = {
            "width": width,
            "height": height,
            "tick_bits": tick,
            "horizon": np.array([horizon >> tick for horizon in config.horizons_us], np.int64),
            "early": config.early_gate_us >> tick,
            "off_late": config.late_gates_us[0] >> tick,
            "on_late": config.late_gates_us[1] >> tick,
            "reaches": np.array(config.reaches_squared_px, np.int32),
            "flip": int(config.polarity == "equal"),
            "blur": int(config.polarity == "ignore"),
            "bin_bits": config.bin_bits,
            "bins_x": bins_x,
            "set_columns": columns,
            "set_rows": rows,
            "uses": config.uses,
            "carry": config.carry,
            "need": config.need,
            "least_squared": config.least_shift_squared_px,
            "choose_squared": config.choose_squared_px,
            "offsets": np.array(config.offsets, np.int32),
            "fraction_bits": config.fraction_bits,
            "line_limit": config.line_limit,
            "offset_shifts": np.array(config.spread_shifts_squared, np.int64),
            "ring_base": np.concatenate([[0], np.cumsum(rings)[:-1]]),
            "ring_room": rings,
            "ring_t": np.zeros(capacity, np.int64),
            "ring_x": np.zeros(capacity, np.uint16),
            "ring_y": np.zeros(capacity, np.uint16),
            "ring_p": np.zeros(capacity, np.uint8),
            "ring_source": np.zeros(capacity, np.int64),
            "stored": self._stored,
            "passed": self._passed,
            "most_held": np.zeros(len(rings), np.int64),
            "cell_bin": np.zeros(cells, np.int32),
            "cell_time": np.zeros(cells, np.int64),
            "cell_horizons": np.zeros(cells, np.uint8),
            "cell_sign": np.zeros(cells, np.uint8),
            "cell_uses": np.zeros(cells, np.uint8),
            "cell_source": np.zeros(cells, np.int64),
            "cell_x": np.zeros(cells if config.lines else 1, np.int32),
            "cell_y": np.zeros(cells if config.lines else 1, np.int32),
            "cell_last": np.zeros(cells, np.uint8),
            "counts": self.counts,
        }

    @property
    def pending(self) -> int:
        """Number of entries in the rings."""
        return int((self._stored - self._passed[-len(self._stored) :]).sum())

    @property
    def most_held(self) -> tuple[int, ...]:
        """Most entries that each ring ever held."""
        return tuple(int(count) for count in self._state["most_held"])

    def run(
        self, events: Events, schedules: Schedules
    ) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.uint8], NDArray[np.uint8]]:
        """Decide a chunk; return suppressed uint8[n], source int64[n], the horizon of that source and the support."""
        from tiegocancel.kernels.select import select

        count = len(events)
        suppressed, source = np.zeros(count, np.uint8), np.full(count, -1, np.int64)
        used_horizon, supports = np.zeros(count, np.uint8), np.zeros(count, np.uint8)
        select(
            **self._options,
            state={
                **self._state,
                "first": 0,
                "last": count,
                "row_t": np.ascontiguousarray(schedules[0].t_us),
                "rows": np.ascontiguousarray(np.stack([schedule.coefficients for schedule in schedules])),
                "t": events.t,
                "x": events.x,
                "y": events.y,
                "p": events.p,
                "suppressed": suppressed,
                "source": source,
                "used_horizon": used_horizon,
                "supports": supports,
            },
        )
        return suppressed, source, used_horizon, supports
