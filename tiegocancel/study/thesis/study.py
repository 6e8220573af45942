"""Run the whole study: windows, motion, sweep, comparisons."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tiegocancel
from tiegocancel.study.sweep import Engine, Inline, Pace, Processes, ResultStore, Row, Task, run_sweep
from tiegocancel.study.thesis.agreement import agree, agreement_points
from tiegocancel.study.thesis.compensation import Comparison, Images, compare_compensation
from tiegocancel.study.thesis.experiments import all_points, base_of
from tiegocancel.study.thesis.model_error import ModelErrors, model_errors
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.probe import Bench, measure
from tiegocancel.study.thesis.qualitative import Panels, panels
from tiegocancel.study.thesis.results import Results
from tiegocancel.study.thesis.settings import EngineSettings, ThesisSettings

__all__ = ["ThesisResult", "engine_of", "run_study"]

_WORKERS_AT_MOST = 16


@dataclass(frozen=True, slots=True, eq=False)
class ThesisResult:
    """Everything that was measured; ``agreement`` are the points of the reference with their rows.

    ``interrupted`` leaves the rest empty: the sweep goes on from its file when it is started again.
    """

    bench: Bench
    settings: ThesisSettings
    results: Results
    agreement: tuple[tuple[Point, Row], ...]
    resumed: int
    run: int
    interrupted: bool
    errors: ModelErrors | None = None
    pictures: tuple[Panels, ...] = ()
    comparisons: tuple[Comparison, ...] = ()
    images: Images | None = None


def engine_of(settings: EngineSettings) -> Engine:
    """Return what runs the jobs."""
    if settings.kind == "inline":
        return Inline()
    if settings.kind == "cluster":
        from tiegocancel.study.sweep.cluster import Cluster

        return Cluster(settings.address)
    return Processes(settings.workers or min(os.cpu_count() or 1, _WORKERS_AT_MOST))


def run_study(
    bench: Bench, settings: ThesisSettings, store: Path, *, progress: Callable[[Pace], None] | None = None
) -> ThesisResult:
    """Measure every point, the comparisons and the pictures; results go to ``store`` as they come.

    The sweep takes up what an earlier run left there, if it was on the same events, with the same motion and version.
    """
    points = all_points(settings, len(bench.windows))
    compared = agreement_points(settings)
    basis = _basis(bench)
    engine = engine_of(settings.engine)
    with ResultStore(store) as results:
        swept = run_sweep(
            Task(measure, bench),
            [point.job() for point in points],
            engine,
            results,
            basis=f"point {basis}",
            batch_size=settings.engine.batch,
            together=lambda job: (job["window"], job["algorithm"], job["isolated"]),
            progress=progress,
        )
        agreed = run_sweep(
            Task(agree, bench),
            [] if swept.interrupted else [point.job() for point in compared],
            engine,
            results,
            basis=f"agreement {basis}",
        )
    found: dict[str, Any] = {
        "bench": bench,
        "settings": settings,
        "results": Results(
            {point: row for point, row in zip(points, swept.rows, strict=True) if row is not None}, len(bench.windows)
        ),
        "agreement": tuple((p, row) for p, row in zip(compared, agreed.rows, strict=False) if row is not None),
        "resumed": swept.resumed + agreed.resumed,
        "run": swept.run + agreed.run,
        "interrupted": swept.interrupted or agreed.interrupted,
    }
    if found["interrupted"]:
        return ThesisResult(**found)
    comparisons, images = compare_compensation(bench, settings) if settings.compensation.enabled else ([], None)
    return ThesisResult(
        **found,
        errors=model_errors(bench, settings),
        pictures=tuple(panels(bench, point) for point in picture_points(settings)),
        comparisons=tuple(comparisons),
        images=images,
    )


def picture_points(settings: ThesisSettings) -> list[Point]:
    """Return what is drawn: Fig. 7.6 as printed, Fig. 7.8 as printed, and the long horizon with the symmetric gate."""
    chosen = settings.point
    failing = {"horizon_us": chosen.long_horizon_us, "tolerance_px": 3.0, "tolerance_us": 2000}
    return [
        base_of("printed", settings).at(horizon_us=chosen.horizon_us),
        base_of("printed", settings).at(**failing),
        base_of("gated", settings).at(horizon_us=chosen.long_horizon_us),
    ]


def _basis(bench: Bench) -> str:
    """Name the data that rows depend on: events, motion, disc, and the version that measured them."""
    digest = hashlib.sha256()
    for window in bench.windows:
        digest.update(f"{window.name} {window.start_us} {window.stop_us}".encode())
        events = window.events
        _hash(digest, events.t, events.x, events.y, events.p)
    _hash(digest, bench.motion.t_us, bench.motion.center_px, bench.motion.omega_rad_s)
    digest.update(f"{bench.motion.interpolation} {bench.center_px} {bench.radius_px} {bench.step_us}".encode())
    return f"{tiegocancel.__version__} {digest.hexdigest()}"


def _hash(digest: hashlib._Hash, *columns: NDArray[Any]) -> None:
    for column in columns:
        digest.update(np.ascontiguousarray(column).tobytes())


def numbers_of(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as JSON holds it."""
    return asdict(comparison)
