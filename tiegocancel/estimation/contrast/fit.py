"""Fit one rotation to a recording by maximising the contrast of its image of warped events."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tiegocancel.errors import ConfigError
from tiegocancel.estimation.contrast.refine import WindowFit, refine
from tiegocancel.estimation.contrast.scorer import Contrast, Twist, fine_cell_bits
from tiegocancel.estimation.contrast.search import polish, search
from tiegocancel.estimation.contrast.thinning import thinned
from tiegocancel.events import Events
from tiegocancel.motion.rotation import MAX_OMEGA_RAD_S, RotationTrajectory

__all__ = ["FitConfig", "RotationFit", "fit_rotation"]

_FEWEST = 100
_ENOUGH = 2_000
_LONGEST_STRETCH = 8
_AMBIGUITY_EVENTS = 20_000
_SMALLEST_SPREAD_PX = 5.0
_LEAST_CORRELATION = 0.15


@dataclass(frozen=True, slots=True, kw_only=True)
class FitConfig:
    """Bounds of the fit: what it may assume about the motion, and how much work it may do.

    ``|ω| ≤ max_omega_rad_s``; the rotation is taken as constant over ``window_us``; ``windows`` at most are spread over
    the recording; ``max_events`` at most take part in all. ``signed`` lets ON and OFF cancel in the image, which
    measures sharper than counting both alike. A gain of contrast below ``least_gain`` is not a motion found.
    """

    max_omega_rad_s: float = 200.0
    window_us: int = 50_000
    windows: int = 5
    max_events: int = 200_000
    signed: bool = True
    least_gain: float = 1.05

    def __post_init__(self) -> None:
        if not 0.0 < self.max_omega_rad_s <= MAX_OMEGA_RAD_S:
            raise ConfigError(f"max_omega_rad_s must lie in (0, {MAX_OMEGA_RAD_S:g}], not {self.max_omega_rad_s}")
        if self.window_us < 100:
            raise ConfigError(f"window_us must be at least 100 µs, not {self.window_us}")
        if not 1 <= self.windows <= 100:
            raise ConfigError(f"windows must be from 1 to 100, not {self.windows}")
        if not 1_000 <= self.max_events <= 250_000:
            raise ConfigError(f"max_events must be from 1000 to 250000, not {self.max_events}")
        if not self.least_gain >= 1.0:
            raise ConfigError(f"least_gain must be at least 1, not {self.least_gain}")


@dataclass(frozen=True, slots=True, kw_only=True)
class RotationFit:
    """One rotation for a recording, and how far to trust it.

    ``contrast_gain`` is the variance of the image of warped events over that of the events as they are (median over
    windows); ``window_us`` is the first and last time that was looked at; ``notes`` say what was used, and the
    reasons when ``confident`` is false.
    """

    center_px: tuple[float, float]
    omega_rad_s: float
    contrast_gain: float
    window_us: tuple[int, int]
    events_used: int
    confident: bool
    notes: tuple[str, ...]

    def trajectory(self) -> RotationTrajectory:
        """Return the rotation for all time, with source ``fit`` and the notes of the fit."""
        constant = RotationTrajectory.constant(
            center_px=self.center_px, omega_rad_s=self.omega_rad_s, t_us=self.window_us[0], source="fit"
        )
        return replace(constant, notes=tuple(f"fit: {note}" for note in self.notes))


def fit_rotation(events: Events, *, seed: int = 0, config: FitConfig | None = None) -> RotationFit:
    """Find ``(cx, cy, ω)`` with no knowledge but the bounds of ``config``.

    The busiest of several windows is searched from scratch, all are refined from there, and the median of the
    windows is returned; the same events and seed give the same bits. Raise ``ConfigError`` when events are too few,
    at one time or at one pixel.
    """
    config = config or FitConfig()
    rng = np.random.default_rng(seed)
    windows = _windows(events, config)
    busiest = max(range(len(windows)), key=lambda index: len(windows[index]))
    anchor = (float(windows[busiest].x.mean()), float(windows[busiest].y.mean()))
    limit, signed = config.max_omega_rad_s, config.signed
    _, start = search(windows[busiest], anchor_px=anchor, max_omega_rad_s=limit, signed=signed, rng=rng)[0]
    budget = config.max_events // len(windows)
    samples = [thinned(window, budget, rng) for window in windows]
    fits = [refine(sample, start, anchor_px=anchor, signed=signed) for sample in samples]

    found = [fit for fit in fits if _is_found(fit, config)]
    trusted = found or fits
    omega = float(np.median([fit.twist.omega_rad_s for fit in trusted]))
    centers = np.array([fit.twist.center_px(anchor) for fit in trusted])
    gain = float(np.median([fit.contrast_gain for fit in fits]))
    doubts = _doubts(fits, found, config, anchor, (events.width, events.height))
    if not doubts:
        doubts += _weak_center(samples[busiest], fits[busiest], anchor, config, rng)
    used = sum(fit.events_used for fit in fits)
    total = sum(len(window) for window in windows)
    span_ms = (fits[0].stop_us - fits[0].start_us) * 1e-3
    notes = [
        f"{len(windows)} window(s) of {span_ms:.1f} ms, {used} of their {total} events used "
        f"({len(events)} were given), contrast gain {gain:.2f}",
        *(f"low confidence: {doubt}" for doubt in doubts),
    ]
    return RotationFit(
        center_px=(float(np.median(centers[:, 0])), float(np.median(centers[:, 1]))),
        omega_rad_s=omega,
        contrast_gain=gain,
        window_us=(fits[0].start_us, fits[-1].stop_us),
        events_used=used,
        confident=not doubts,
        notes=tuple(notes),
    )


def _is_found(fit: WindowFit, config: FitConfig) -> bool:
    """Tell whether a window shows a motion: sharper than at rest, early and late events meeting, within the bounds."""
    return (
        fit.contrast_gain >= config.least_gain
        and fit.correlation >= _LEAST_CORRELATION
        and abs(fit.twist.omega_rad_s) <= config.max_omega_rad_s
    )


def _windows(events: Events, config: FitConfig) -> list[Events]:
    """Spread windows over the recording, none overlapping, stretched up to eightfold where events are sparse."""
    if len(events) < _FEWEST:
        raise ConfigError(f"--motion fit: {len(events)} events are too few, expected at least {_FEWEST}")
    if events.span_us == 0:
        raise ConfigError(f"--motion fit: all {len(events)} events are at {events.t[0]} µs, expected a span of time")
    if events.x.min() == events.x.max() and events.y.min() == events.y.max():
        raise ConfigError(f"--motion fit: all events are at pixel ({events.x[0]}, {events.y[0]}), expected more pixels")
    chosen: list[Events] = []
    length_us = config.window_us
    while length_us <= _LONGEST_STRETCH * config.window_us:
        windows = _spread(events, length_us, config.windows)
        if max(map(len, windows), default=0) > max(map(len, chosen), default=0):
            chosen = windows
        if max(map(len, chosen), default=0) >= _ENOUGH:
            break
        length_us *= 2
    if not chosen:
        longest_ms = config.window_us * _LONGEST_STRETCH * 1e-3
        raise ConfigError(f"--motion fit: no window of {longest_ms:.0f} ms was found that holds {_FEWEST} events")
    return chosen


def _spread(events: Events, length_us: int, most: int) -> list[Events]:
    """Cut windows of one length that do not overlap, spread over the events and not over time.

    So the pauses of a stop-and-go recording get none. Windows with too few events, or all at one time, are dropped.
    """
    first_us, last_us = int(events.t[0]), int(events.t[-1])
    count = int(np.clip(events.span_us // (2 * length_us), 1, most))
    middles = events.t[len(events) * (2 * np.arange(count) + 1) // (2 * count)]
    windows = []
    free_us = first_us
    for middle_us in middles.tolist():
        start_us = max(min(middle_us - length_us // 2, last_us + 1 - length_us), free_us)
        window = events.between(start_us, start_us + length_us)
        if len(window) >= _FEWEST and window.span_us > 0:
            windows.append(window)
            free_us = start_us + length_us
    return windows


def _doubts(
    fits: list[WindowFit],
    found: list[WindowFit],
    config: FitConfig,
    anchor_px: tuple[float, float],
    size_px: tuple[int, int],
) -> list[str]:
    """Return the reasons not to trust the fit."""
    doubts = []
    if 2 * len(found) <= len(fits):
        gains = ", ".join(f"{fit.contrast_gain:.3f}" for fit in fits)
        doubts.append(f"contrast hardly rises above that at rest (gain {gains}; expected {config.least_gain} or more)")
        return doubts
    omegas = np.array([fit.twist.omega_rad_s for fit in found])
    middle = float(np.median(omegas))
    if len(found) > 1 and float(np.median(np.abs(omegas - middle))) > 0.1 * abs(middle):
        doubts.append(f"ω differs between windows, from {omegas.min():.3g} to {omegas.max():.3g} rad/s")
    kept = float(np.median([fit.kept_share for fit in found]))
    if kept < 0.3:
        doubts.append(f"only {kept:.0%} of the events agree with the rotation")
    centers = np.median([fit.twist.center_px(anchor_px) for fit in found], axis=0)
    if not all(-side <= place <= 2 * side for place, side in zip(centers, size_px, strict=True)):
        doubts.append(f"the centre ({centers[0]:.0f}, {centers[1]:.0f}) px lies far outside the sensor")
    return doubts


def _weak_center(
    events: Events, fit: WindowFit, anchor_px: tuple[float, float], config: FitConfig, rng: np.random.Generator
) -> list[str]:
    """Return the doubt that straight motion brings nine tenths of the contrast that the rotation brings, if it does."""
    part = thinned(events, _AMBIGUITY_EVENTS, rng)
    middle = (float(part.x.mean()), float(part.y.mean()))
    scorer = Contrast(part, anchor_px=middle, cell_bits=fine_cell_bits(part), signed=config.signed, slots=1_024)
    if scorer.radius_px < _SMALLEST_SPREAD_PX:
        return ["all events lie within a few px of each other: the centre is not constrained"]
    rotation = Twist.about(fit.twist.center_px(anchor_px), fit.twist.omega_rad_s, middle)
    _, straight = polish(rotation._replace(omega_rad_s=0.0), scorer, 0.0, evaluations=80)
    turning = float(scorer.gain([rotation])[0])
    if straight - 1.0 >= 0.9 * (turning - 1.0):
        return ["a translation explains the events as well: the centre is not constrained"]
    return []
