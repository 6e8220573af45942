"""Run an estimator over a stream and sum up what it found."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tiegocancel.chunks import rechunk
from tiegocancel.errors import TiegoCancelError
from tiegocancel.estimation.estimate import Estimator, MotionEstimate, trajectory_of
from tiegocancel.events import Events
from tiegocancel.interrupt import deferred_interrupt
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.study.result import INTERRUPTED

__all__ = ["EstimationResult", "estimate_stream"]

_CHUNK_EVENTS = 1 << 17


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimationResult:
    """The rows of one pass over a stream; ``fault`` is the line of the error that ended it early, if one did.

    ``seconds`` is the time that the estimator took, ``begun`` the rows and seconds up to and with the chunk that gave
    the first confident row: kernels are compiled and the motion is searched from scratch until then.
    """

    estimates: tuple[MotionEstimate, ...]
    events: int
    duration_s: float
    seconds: float
    fault: str | None
    begun: tuple[int, float] = (0, 0.0)

    @property
    def interrupted(self) -> bool:
        """Tell whether the user ended the pass."""
        return self.fault == INTERRUPTED

    @property
    def updates_per_second(self) -> float | None:
        """Rows a second of the estimator's own time once it has begun, ``None`` where too few say."""
        rows, seconds = len(self.estimates) - self.begun[0], self.seconds - self.begun[1]
        return rows / seconds if rows > 0 and seconds > 0.0 else None

    def trajectory(self, *, source: str) -> RotationTrajectory | None:
        """Return the causal motion of the rows, ``None`` where no row knows one."""
        return trajectory_of(self.estimates, source=source) if any(e.has_center for e in self.estimates) else None

    def summary(self, truth: RotationTrajectory | None = None) -> dict[str, Any]:
        """Return the numbers for JSON; with ``truth`` the errors of confident rows too, ω relative to it."""
        sure = [estimate for estimate in self.estimates if estimate.confident and estimate.has_center]
        numbers: dict[str, Any] = {
            "estimates": len(self.estimates),
            "confident": len(sure),
            "events": self.events,
            "duration_s": self.duration_s,
            "seconds": self.seconds,
            "updates_per_second": self.updates_per_second,
            "begun_seconds": self.begun[1],
            "doubts": _counted([estimate.doubt for estimate in self.estimates if estimate.doubt]),
        }
        if sure:
            centers = np.array([estimate.center_px for estimate in sure])
            numbers["median"] = {
                "center_px": np.median(centers, axis=0).tolist(),
                "omega_rad_s": float(np.median([estimate.omega_rad_s for estimate in sure])),
                "sharpness": _finite(float(np.median([estimate.sharpness for estimate in sure]))),
            }
        if truth is not None and sure:
            numbers["errors"] = _errors(sure, truth)
        return numbers

    def text(self, truth: RotationTrajectory | None = None) -> str:
        """Say the main numbers in a few lines."""
        numbers = self.summary(truth)
        lines = [f"  rows         {numbers['estimates']:,}, {numbers['confident']:,} of them confident"]
        if "median" in numbers:
            (cx, cy), omega = numbers["median"]["center_px"], numbers["median"]["omega_rad_s"]
            lines.append(f"  median       centre ({cx:.1f}, {cy:.1f}) px, ω {omega:+.4f} rad/s")
        if "errors" in numbers:
            error = numbers["errors"]
            lines.append(
                f"  error        |Δω|/|ω| median {error['omega_share_median']:.2%}, "
                f"95 % {error['omega_share_p95']:.2%}; "
                f"‖Δc‖ median {error['center_px_median']:.2f}, 95 % {error['center_px_p95']:.2f} px"
            )
        for doubt, count in numbers["doubts"].items():
            lines.append(f"  remark       {count:,} ×: {doubt}")
        if self.estimates:
            pace, begun = self.updates_per_second, f"{self.begun[1]:.2f} s to compile and begin"
            lines.append(f"  speed        {begun if pace is None else f'{pace:.3g} updates/s, after {begun}'}")
        else:
            lines.append(f"  remark       {self.duration_s * 1e3:.3g} ms of events are too short for a row: --step-us")
        return "\n".join(lines) + "\n"


def estimate_stream(
    chunks: Iterable[Events],
    estimator: Estimator,
    *,
    sink: Callable[[list[MotionEstimate]], None] | None = None,
    progress: Callable[[Events], None] | None = None,
) -> EstimationResult:
    """Feed a stream to an estimator; ``sink`` takes the rows as they come.

    When ``chunks`` raises a :class:`TiegoCancelError`, or the user interrupts, what came before counts.
    """
    estimates: list[MotionEstimate] = []
    events, first_us, last_us, seconds = 0, None, 0, 0.0
    fault: str | None = None
    begun: tuple[int, float] | None = None
    source = iter(rechunk(chunks, _CHUNK_EVENTS))
    with deferred_interrupt() as interrupt:
        while fault is None:
            try:
                chunk = next(source)
            except StopIteration:
                break
            except (TiegoCancelError, KeyboardInterrupt) as error:
                if not events:
                    raise
                fault = INTERRUPTED if isinstance(error, KeyboardInterrupt) else str(error)
                break
            started = time.perf_counter()
            rows = estimator.process(chunk)
            seconds += time.perf_counter() - started
            estimates += rows
            if begun is None and any(row.confident for row in rows):
                begun = len(estimates), seconds
            if sink is not None:
                sink(rows)
            if progress is not None:
                progress(chunk)
            events += len(chunk)
            first_us = int(chunk.t[0]) if first_us is None else first_us
            last_us = int(chunk.t[-1])
            fault = INTERRUPTED if interrupt.wanted else None
    return EstimationResult(
        estimates=tuple(estimates),
        events=events,
        duration_s=0.0 if first_us is None else (last_us - first_us) * 1e-6,
        seconds=seconds,
        fault=fault,
        begun=begun or (len(estimates), seconds),
    )


def _errors(sure: list[MotionEstimate], truth: RotationTrajectory) -> dict[str, float]:
    """Compare confident rows with the truth at their own times."""
    cx, cy, omega = truth.at(np.array([estimate.t_us for estimate in sure], np.int64))
    centers = np.array([estimate.center_px for estimate in sure])
    off_px = np.hypot(centers[:, 0] - cx, centers[:, 1] - cy)
    found = np.array([estimate.omega_rad_s for estimate in sure])
    share = np.abs(found - omega) / np.maximum(np.abs(omega), 1e-9)
    names = (("omega_share", share), ("center_px", off_px))
    numbers = {"omega_bias_share": float(np.mean((found - omega) / np.maximum(np.abs(omega), 1e-9)))}
    for name, values in names:
        numbers |= {
            f"{name}_median": float(np.median(values)),
            f"{name}_p95": float(np.percentile(values, 95)),
            f"{name}_max": float(values.max()),
        }
    return numbers


def _counted(doubts: list[str]) -> dict[str, int]:
    """Count doubts by their words, most frequent first: numbers differ from row to row, and are left out."""
    words = [re.sub(r"\d[\d.,]*", "…", doubt.split(" (")[0]) for doubt in doubts]
    words = ["too few events in the window" if word.startswith("only ") else word for word in words]
    return {word: words.count(word) for word in sorted(set(words), key=lambda word: (-words.count(word), word))}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
