"""Compare the streaming canceller with the reference, event by event, and tell what its memory costs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tiegocancel.study.sweep import Job, Row
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.probe import Bench, Outcome, decide
from tiegocancel.study.thesis.settings import ThesisSettings

__all__ = ["agree", "agreement_points"]


def agreement_points(settings: ThesisSettings) -> list[Point]:
    """Return the points of the reference that the streaming canceller is compared with, in the first window.

    Gates at full density, then densities at the gates of the study; at the long horizon, where CR is no coincidence.
    """
    chosen, wanted = settings.point, settings.agreement
    base = Point(
        algorithm="gated",
        horizon_us=chosen.long_horizon_us,
        tolerance_us=chosen.tolerance_us,
        tolerance_px=chosen.tolerance_px,
    )
    gates = [
        base.at(tolerance_px=tolerance_px, tolerance_us=tolerance_us)
        for tolerance_px in wanted.tolerances_px
        for tolerance_us in wanted.tolerances_us
    ]
    return list(dict.fromkeys([*gates, *(base.at(kept=kept) for kept in wanted.kept_shares)]))


def agree(bench: Bench, jobs: Sequence[Job]) -> list[Row]:
    """Return for each point of the reference how the streaming canceller agrees with it on the events that count.

    ``precision``: of what the canceller suppresses, how much the reference does too; ``recall``: of what the reference
    suppresses, how much the canceller does; ``cr_*`` of the reference, of the canceller, and of the same rule with
    memory for every prediction (``chained``): ``cr_chained − cr_stream`` is what one cell a pixel costs, the rest what
    deciding at once and in whole pixels costs. ``*_zero``: the same of a canceller that is told that nothing moves, the
    control: so much agreement comes of where events are and not of what the canceller knows; ``cr_reversed`` likewise.
    """
    rows = []
    for job in jobs:
        point = Point(**job)
        streaming = point.at(algorithm="stream")
        controls = [streaming.at(motion=motion) for motion in ("zero", "reversed")]
        reference, stream, chained, *told = decide(bench, [point, streaming, point.at(algorithm="chained"), *controls])
        # All end where the window ends; they begin as early as each needs.
        events = reference.events
        counted_from_us = bench.windows[point.window].start_us
        first = bench.windows[point.window].events.t[0] if len(events) else 0
        counted_from_us = max(counted_from_us, int(first) + point.horizon_us + point.tolerance_us)
        count = len(events) - int(np.searchsorted(events.t, counted_from_us, side="left"))
        wanted, found, ideal, zero, back = (_tail(outcome, count) for outcome in (reference, stream, chained, *told))
        rows.append(
            {
                "events": count,
                "density_mev_s": count / max(bench.windows[point.window].stop_us - counted_from_us, 1),
                "precision": _within(found, wanted),
                "recall": _within(wanted, found),
                "precision_zero": _within(zero, wanted),
                "recall_zero": _within(wanted, zero),
                "cr_reference": float(wanted.mean()) if count else 0.0,
                "cr_stream": float(found.mean()) if count else 0.0,
                "cr_chained": float(ideal.mean()) if count else 0.0,
                "cr_zero": float(zero.mean()) if count else 0.0,
                "cr_reversed": float(back.mean()) if count else 0.0,
                "reference_mev_s": len(events) / max(reference.seconds, 1e-9) / 1e6,
                "stream_mev_s": len(stream.events) / max(stream.seconds, 1e-9) / 1e6,
            }
        )
    return rows


def _within(some: NDArray[np.bool_], others: NDArray[np.bool_]) -> float:
    """Return how much of ``some`` is among ``others``; 0 of none."""
    return int(np.count_nonzero(some & others)) / max(int(np.count_nonzero(some)), 1)


def _tail(outcome: Outcome, count: int) -> NDArray[np.bool_]:
    return outcome.suppressed[len(outcome.suppressed) - count :]
