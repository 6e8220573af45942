"""Measure points: the task that every experiment hands to the sweep."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiegocancel.events import EGO, MOVER, NOISE, Events
from tiegocancel.matching.many import cancel_many
from tiegocancel.matching.reference import run_reference
from tiegocancel.metrics import DiscRegion
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.study.sweep import Job, Row
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.windows import Window

__all__ = ["DISTANCE_EDGES_PX", "Bench", "Outcome", "decide", "measure", "stream_of"]

DISTANCE_EDGES_PX: NDArray[np.float64] = np.linspace(0.0, 8.0, 65)
"""Bins of the distances of matches."""

_LABELS = (("ego", EGO), ("mover", MOVER), ("noise", NOISE))


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """What all points share: the windows, the motion, the disc (centre and radius in px)."""

    windows: tuple[Window, ...]
    motion: RotationTrajectory
    center_px: tuple[float, float]
    radius_px: float
    step_us: int = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What one point decided: the events it saw, and for each whether it was suppressed and its prediction used.

    ``distance_px`` float64 and ``met`` int64 (rows) of the matches; ``ring`` events that waited at most, 0 where that
    is not known.
    """

    events: Events
    suppressed: NDArray[np.bool_]
    used: NDArray[np.bool_]
    met: NDArray[np.int64]
    source: NDArray[np.int64]
    distance_px: NDArray[np.float64]
    ring: int
    seconds: float


def measure(bench: Bench, jobs: Sequence[Job]) -> list[Row]:
    """Return a row for each job, a :class:`Point` each; see :func:`_row`."""
    points = [Point(**job) for job in jobs]
    return [_row(bench, point, outcome) for point, outcome in zip(points, decide(bench, points), strict=True)]


def decide(bench: Bench, points: Sequence[Point]) -> list[Outcome]:
    """Run points; those of the streaming canceller on the same events together."""
    outcomes: list[Outcome | None] = [None] * len(points)
    together: dict[tuple[int, bool, float, bool], list[int]] = {}
    for place, point in enumerate(points):
        if point.algorithm in ("stream", "chained"):
            kind = (point.window, point.isolated, point.kept, point.algorithm == "chained")
            together.setdefault(kind, []).append(place)
        else:
            outcomes[place] = _run_reference(bench, point)
    for places in together.values():
        for place, outcome in zip(places, _run_stream(bench, [points[place] for place in places]), strict=True):
            outcomes[place] = outcome
    return [outcome for outcome in outcomes if outcome is not None]


def stream_of(bench: Bench, point: Point) -> Events:
    """Return the events that a point sees: its window, and before it as much as its horizon and gate reach.

    The streaming canceller costs so little that it sees all there is, and that its points can be run together.
    """
    window = bench.windows[point.window]
    if point.isolated:
        events = window.isolated
    elif point.algorithm in ("stream", "chained"):
        events = window.events
    else:
        events = window.events.between(window.start_us - point.horizon_us - point.tolerance_us, window.stop_us)
    if point.kept == 1.0:
        return events
    # Drawn from time and place themselves, so that every algorithm and horizon keeps the same events.
    x, y = events.x.astype(np.int64), events.y.astype(np.int64)
    mixed = (events.t * 0x9E3779B1 + x * 0x85EBCA77 + y * 0xC2B2AE3D) & 0xFFFFFFFF
    mixed = ((mixed ^ (mixed >> 15)) * 0x2C1B3C6D) & 0xFFFFFFFF
    return events.select((mixed ^ (mixed >> 16)) / float(1 << 32) < point.kept)


def _run_reference(bench: Bench, point: Point) -> Outcome:
    events = stream_of(bench, point)
    begin_s = time.perf_counter()
    found = run_reference(events, point.motion_of(bench.motion), point.reference_config())
    seconds = time.perf_counter() - begin_s
    match = found.match
    return Outcome(
        events, found.suppressed, found.used, match.real, match.source, match.distance_px, ring=0, seconds=seconds
    )


def _run_stream(bench: Bench, points: Sequence[Point]) -> list[Outcome]:
    """Run the streaming canceller for points that see the same events."""
    events = stream_of(bench, points[0])
    if not len(events):
        none = np.zeros(0, np.int64)
        return [Outcome(events, none > 0, none > 0, none, none, np.zeros(0), 0, 0.0) for _ in points]
    span = {"start_us": int(events.t[0]), "stop_us": int(events.t[-1]), "step_us": bench.step_us}
    schedules = [point.motion_of(bench.motion).schedule(point.horizon_us, **span) for point in points]
    begin_s = time.perf_counter()
    found = cancel_many(
        events,
        [(point.cancel_config(), schedule) for point, schedule in zip(points, schedules, strict=True)],
        chained=points[0].algorithm == "chained",
    )
    seconds = (time.perf_counter() - begin_s) / len(points)
    outcomes = []
    for place, schedule in enumerate(schedules):
        met = np.flatnonzero(found.suppressed[place])
        source = found.source[place, met].astype(np.int64)
        used = np.zeros(len(events), np.bool_)
        used[source] = True
        ahead_x, ahead_y = schedule.predict(events.t[source], events.x[source], events.y[source])
        far = np.hypot(events.x[met] - ahead_x, events.y[met] - ahead_y)
        ring = int(found.ring_high_water[place])
        outcomes.append(Outcome(events, found.suppressed[place], used, met, source, far, ring, seconds))
    return outcomes


def _row(bench: Bench, point: Point, outcome: Outcome) -> Row:
    """Count one point: events, suppressed and pairs of all, of the disc, the background and each label.

    A window that was cut out counts whole, as the thesis counts it; otherwise the warm-up is left out.
    """
    window, events = bench.windows[point.window], outcome.events
    counted_from_us = window.start_us
    if not point.isolated and len(window.events):
        warm_us = int(window.events.t[0]) + point.horizon_us + point.tolerance_us
        counted_from_us = max(counted_from_us, warm_us)
    first = int(np.searchsorted(events.t, counted_from_us, side="left"))
    part = events[first:]
    suppressed, pairs = outcome.suppressed[first:], (outcome.suppressed | outcome.used)[first:]
    region = _region(bench.center_px, bench.radius_px, events.width, events.height)
    codes = region.codes(part)
    on_disc = (codes & 1).astype(np.bool_)
    groups = {"": np.ones(len(part), np.bool_), "disc_": on_disc, "background_": ~on_disc}
    if part.label is not None:
        groups |= {f"{name}_": part.label == label for name, label in _LABELS}
    row: Row = {"seconds": outcome.seconds, "seen": len(events), "ring": outcome.ring}
    for name, inside in groups.items():
        row[f"{name}events"] = int(np.count_nonzero(inside))
        row[f"{name}suppressed"] = int(np.count_nonzero(suppressed & inside))
    row["pairs"] = int(np.count_nonzero(pairs))
    row["disc_pairs"] = int(np.count_nonzero(pairs & on_disc))
    row["background_pairs"] = int(np.count_nonzero(pairs & ~on_disc))
    row |= _distances(outcome, first)
    if point.detail:
        row |= _profiles(region, codes, part, suppressed, outcome, first)
    return row


def _distances(outcome: Outcome, first: int) -> Row:
    """Describe the distances of the matches that count (§7.5)."""
    far = outcome.distance_px[outcome.met >= first]
    if not len(far):
        return {"matches": 0, "mean_px": None, "p95_px": None, "beyond_3px": None, "beyond_5px": None}
    return {
        "matches": len(far),
        "mean_px": float(far.mean()),
        "p95_px": float(np.quantile(far, 0.95)),
        "beyond_3px": float(np.mean(far > 3.0)),
        "beyond_5px": float(np.mean(far > 5.0)),
    }


def _profiles(
    region: DiscRegion,
    codes: NDArray[np.int32],
    part: Events,
    suppressed: NDArray[np.bool_],
    outcome: Outcome,
    first: int,
) -> dict[str, Any]:
    """Return counts by ring, those of the mover too where events are labelled, and the histogram of distances."""
    ring = codes >> 1
    far = outcome.distance_px[outcome.met >= first]
    movers = {}
    if part.label is not None:
        mover = part.label == MOVER
        for name, chosen in (("events", mover), ("suppressed", mover & suppressed)):
            movers[f"ring_mover_{name}"] = np.bincount(ring[chosen], minlength=region.rings).tolist()
    return movers | {
        "ring_edges_px": region.ring_edges_px.tolist(),
        "ring_areas_px": region.areas_px.sum(axis=1).tolist(),
        "ring_events": np.bincount(ring, minlength=region.rings).tolist(),
        "ring_suppressed": np.bincount(ring[suppressed], minlength=region.rings).tolist(),
        "distances": np.histogram(far, DISTANCE_EDGES_PX)[0].tolist(),
    }


@lru_cache(maxsize=4)
def _region(center_px: tuple[float, float], radius_px: float, width: int, height: int) -> DiscRegion:
    """Keep the map of a sensor: making it takes as long as many points."""
    return DiscRegion(width, height, center_px=center_px, radius_px=radius_px)
