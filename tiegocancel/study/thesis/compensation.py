"""Set proactive cancellation beside motion compensation on the same windows (research question 3)."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tiegocancel.errors import TiegoCancelError
from tiegocancel.estimation.contrast.fit import FitConfig, fit_rotation
from tiegocancel.events import Events
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.many import cancel_many
from tiegocancel.metrics.raster import gradient_energy, raster, variance
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.schedule import MotionSchedule
from tiegocancel.study.thesis.probe import Bench
from tiegocancel.study.thesis.settings import ThesisSettings

__all__ = ["Comparison", "Images", "compare_compensation", "warped_image"]

_EVENT_BYTES = 13  # t 8, x 2, y 2, p 1
_REPEATS = 3


@dataclass(frozen=True, slots=True, eq=False)
class Images:
    """Signed images float64[height, width] of one window.

    ``*_zero`` and ``*_reversed`` are controls: the method was told that nothing moves, or that it moves the other way.
    Warping without motion is the original.
    """

    original: NDArray[np.float64]
    warped: NDArray[np.float64]
    residual: NDArray[np.float64]
    residual_warped: NDArray[np.float64]
    warped_reversed: NDArray[np.float64]
    residual_zero: NDArray[np.float64]
    residual_reversed: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Comparison:
    """What both methods did to one window, from one run on one machine; the canceller at ``horizon_us``.

    ``variance`` and ``gradient`` of each image, relative to the original; ``fit_*``: contrast maximisation from scratch
    (seconds, peak bytes; ω found, ``None`` where it fails); ``warp_s``: only warping and splatting, the motion known;
    ``cancel_s`` and ``cancel_bytes`` of the streaming canceller with the motion known; ``suppressed`` share of events
    that need not be sent, ``suppressed_zero`` and ``suppressed_reversed`` that under the controls; ``latency_*``: from
    an event to its decision, the wait included.
    """

    window: str
    events: int
    horizon_us: int
    variance: dict[str, float]
    gradient: dict[str, float]
    fit_s: float
    fit_bytes: int
    fit_omega_rad_s: float | None
    warp_s: float
    warp_bytes: int
    cancel_s: float
    cancel_bytes: int
    suppressed: float
    suppressed_zero: float
    suppressed_reversed: float
    latency_batch_us: float
    latency_event_us: float


def warped_image(events: Events, motion: RotationTrajectory) -> NDArray[np.float64]:
    """Return the signed image of events rotated to the middle of their span, bilinear (the image of warped events)."""
    middle_us = int(events.t[0]) + events.span_us // 2
    cx, cy, omega = motion.at(events.t)
    angle = omega * (middle_us - events.t) * 1e-6
    right, down = events.x - cx, events.y - cy
    x = cx + np.cos(angle) * right - np.sin(angle) * down
    y = cy + np.sin(angle) * right + np.cos(angle) * down
    return raster(x, y, _signs(events), width=events.width, height=events.height)


def compare_compensation(bench: Bench, settings: ThesisSettings) -> tuple[list[Comparison], Images | None]:
    """Return a comparison for each window, and the images of the first."""
    found, images = [], None
    for place in range(min(settings.compensation.windows, len(bench.windows))):
        one = _compare(bench, place, settings)
        if one is not None:
            found.append(one[0])
            images = images or one[1]
    return found, images


def _compare(bench: Bench, place: int, settings: ThesisSettings) -> tuple[Comparison, Images] | None:
    window = bench.windows[place]
    gate_us = settings.point.tolerance_us
    horizon_us, first_us = settings.point.long_horizon_us, 0
    for horizon_us in (settings.point.long_horizon_us, settings.point.horizon_us):
        first_us = max(window.start_us, int(window.events.t[0]) + horizon_us + gate_us)
        if window.stop_us - first_us >= (window.stop_us - window.start_us) / 2:
            break  # where nothing comes before the window, the long horizon would leave too little of it
    part = window.events.between(first_us, window.stop_us)
    if len(part) < 1000 or part.span_us == 0:
        return None
    fit_s, fit_bytes, omega = _fit(part)
    config = CancelConfig(
        horizon_us=horizon_us, tolerance_us=gate_us, tolerance_px=settings.point.tolerance_px, ring_capacity=1 << 20
    )
    motions = (bench.motion, bench.motion.stopped(), bench.motion.reversed())
    schedules = [
        motion.schedule(horizon_us, start_us=int(window.events.t[0]), stop_us=window.stop_us) for motion in motions
    ]
    suppressed, cancel_s, high_water = _cancel(window.events, config, schedules[0])
    controls = cancel_many(window.events, [(config, schedule) for schedule in schedules[1:]]).suppressed
    first = len(window.events) - len(part)
    kept, kept_zero, kept_reversed = (part.select(~mask[first:]) for mask in (suppressed, *controls))
    warp_s = min(_timed(lambda: warped_image(part, bench.motion)) for _ in range(_REPEATS))
    images = Images(
        original=_image(part),
        warped=warped_image(part, bench.motion),
        residual=_image(kept),
        residual_warped=warped_image(kept, bench.motion) if len(kept) else np.zeros((part.height, part.width)),
        warped_reversed=warped_image(part, bench.motion.reversed()),
        residual_zero=_image(kept_zero),
        residual_reversed=_image(kept_reversed),
    )
    share = len(part) / len(window.events)
    comparison = Comparison(
        window=window.name,
        events=len(part),
        horizon_us=horizon_us,
        variance=_relative(variance, images),
        gradient=_relative(gradient_energy, images),
        fit_s=fit_s,
        fit_bytes=fit_bytes,
        fit_omega_rad_s=omega,
        warp_s=warp_s,
        warp_bytes=len(part) * _EVENT_BYTES + images.warped.nbytes,
        cancel_s=cancel_s * share,
        cancel_bytes=8 * high_water + 4 * part.width * part.height,
        suppressed=1.0 - len(kept) / len(part),
        suppressed_zero=1.0 - len(kept_zero) / len(part),
        suppressed_reversed=1.0 - len(kept_reversed) / len(part),
        # An event waits for the end of its window, half of it on average, and for the warp of all.
        latency_batch_us=part.span_us / 2 + warp_s * 1e6,
        latency_event_us=cancel_s / len(window.events) * 1e6,
    )
    return comparison, images


def _relative(measure: Callable[[NDArray[np.float64]], float], images: Images) -> dict[str, float]:
    """Return the sharpness of each image over that of the original."""
    original = max(measure(images.original), 1e-12)
    return {field.name: measure(getattr(images, field.name)) / original for field in fields(Images)}


def _fit(part: Events) -> tuple[float, int, float | None]:
    """Maximise contrast from scratch: under the allocator's eye for the peak of bytes, then, compiled, for seconds."""
    config = FitConfig(windows=1, window_us=max(part.span_us, 100))

    def fit() -> float | None:
        try:
            found = fit_rotation(part, config=config)
        except TiegoCancelError:
            return None
        return found.omega_rad_s if found.confident else None

    tracemalloc.start()
    fit()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    begin_s = time.perf_counter()
    omega = fit()
    return time.perf_counter() - begin_s, peak, omega


def _cancel(events: Events, config: CancelConfig, schedule: MotionSchedule) -> tuple[NDArray[np.bool_], float, int]:
    """Run the streaming canceller over the whole window; return decisions, seconds (best of three) and high water."""
    best = float("inf")
    for _ in range(_REPEATS + 1):
        canceller = Canceller(config, schedule, width=events.width, height=events.height)
        begin_s = time.perf_counter()
        suppressed = canceller.process(events).suppressed
        best = min(best, time.perf_counter() - begin_s)
    return suppressed, best, canceller.counters.ring_high_water


def _timed(work: Callable[[], object]) -> float:
    begin_s = time.perf_counter()
    work()
    return time.perf_counter() - begin_s


def _image(events: Events) -> NDArray[np.float64]:
    """Return the signed image of events where they are."""
    return raster(events.x, events.y, _signs(events), width=events.width, height=events.height)


def _signs(events: Events) -> NDArray[np.int32]:
    return events.p.astype(np.int32) * 2 - 1
