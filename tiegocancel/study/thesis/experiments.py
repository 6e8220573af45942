"""List the points of every experiment, and name the series that all of them draw."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.settings import ThesisSettings

__all__ = ["CONTROLS", "GRID", "MODES", "SERIES", "Series", "all_points", "base_of", "grid_points"]


@dataclass(frozen=True, slots=True)
class Series:
    """A way to measure: ``point`` to vary, ``label`` in figures; ``control``: it is told a wrong motion."""

    name: str
    label: str
    point: Point
    control: bool = False


SERIES = {
    series.name: series
    for series in (
        Series(
            "printed",
            "as printed (Alg. 1), window cut out",
            Point(algorithm="printed", horizon_us=0, own=True, isolated=True),
        ),
        Series(
            "printed_zero",
            "as printed, zero motion, window cut out",
            Point(algorithm="printed", horizon_us=0, own=True, isolated=True, motion="zero"),
            control=True,
        ),
        Series(
            "printed_off",
            "as printed, own predictions forbidden, window cut out",
            Point(algorithm="printed", horizon_us=0, isolated=True),
        ),
        Series(
            "cut",
            "eq. (4.4), own allowed, window cut out",
            Point(algorithm="gated", horizon_us=0, own=True, isolated=True),
        ),
        Series("own", "eq. (4.4), own allowed", Point(algorithm="gated", horizon_us=0, own=True)),
        Series("gated", "eq. (4.4), own forbidden", Point(algorithm="gated", horizon_us=0)),
        Series("zero", "the same, zero motion", Point(algorithm="gated", horizon_us=0, motion="zero"), control=True),
        Series(
            "reversed", "the same, reversed", Point(algorithm="gated", horizon_us=0, motion="reversed"), control=True
        ),
        Series("stream", "streaming canceller", Point(algorithm="stream", horizon_us=0)),
        Series(
            "stream_zero",
            "streaming, zero motion",
            Point(algorithm="stream", horizon_us=0, motion="zero"),
            control=True,
        ),
        Series(
            "stream_reversed",
            "streaming, reversed",
            Point(algorithm="stream", horizon_us=0, motion="reversed"),
            control=True,
        ),
    )
}
"""Everything that CR is measured with. The first is the thesis's protocol; each next one takes one artefact away."""

CONTROLS = {
    "printed": ("printed_zero",),
    "gated": ("zero", "reversed"),
    "stream": ("stream_zero", "stream_reversed"),
}
"""The controls of a series: the same, told that nothing moves, and that it moves the other way."""

GRID: tuple[str, ...] = tuple(name for true, controls in CONTROLS.items() for name in (true, *controls))
"""The series of the 525-combination sweep."""
BIASED = ("gated", "stream")
MODES = ("gated", "zero", "reversed", "stream")


def base_of(name: str, settings: ThesisSettings) -> Point:
    """Return a series' point at the gates of the study."""
    point = settings.point
    return SERIES[name].point.at(tolerance_us=point.tolerance_us, tolerance_px=point.tolerance_px)


def grid_points(name: str, settings: ThesisSettings) -> Iterator[Point]:
    """Yield the combinations of one series in the first window (§6.3.3)."""
    grid = settings.grid
    for horizon_us in grid.horizons_us:
        for tolerance_px in grid.tolerances_px:
            for tolerance_us in grid.tolerances_us:
                yield SERIES[name].point.at(horizon_us=horizon_us, tolerance_px=tolerance_px, tolerance_us=tolerance_us)


def all_points(settings: ThesisSettings, windows: int) -> list[Point]:
    """Return every point of the study, each once, those of a single window first."""
    points: dict[Point, None] = {}
    for window in range(min(settings.grid.windows, windows)):
        for name in GRID:
            points |= dict.fromkeys(point.at(window=window) for point in grid_points(name, settings))
    for window in range(windows):
        for point in _figures(settings):
            points[point.at(window=window)] = None
    return list(points)


def _figures(settings: ThesisSettings) -> Iterator[Point]:
    """Yield the points of the single figures, for each window."""
    chosen, bias = settings.point, settings.bias
    long_us = chosen.long_horizon_us
    for name in SERIES:
        base = base_of(name, settings)
        yield from (base.at(horizon_us=horizon_us) for horizon_us in settings.grid.horizons_us)
        for horizon_us in (chosen.horizon_us, long_us):
            yield base.at(horizon_us=horizon_us, detail=True)
    for name in BIASED:
        base = base_of(name, settings)
        for horizon_us in bias.horizons_us:
            for size in bias.omega_rad_s:
                yield from (base.at(horizon_us=horizon_us, omega_bias_rad_s=sign * size) for sign in (1.0, -1.0))
            yield from (base.at(horizon_us=horizon_us, center_bias_px=size) for size in bias.center_px)
    for name in ("zero", "reversed", "stream_zero"):
        yield from (base_of(name, settings).at(horizon_us=horizon_us) for horizon_us in bias.horizons_us)
    for name in MODES:
        for horizon_us in (chosen.horizon_us, long_us):
            for polarity in ("opposite", "equal", "ignore"):
                yield base_of(name, settings).at(horizon_us=horizon_us, polarity=polarity)
    for name in ("gated", "zero"):
        for horizon_us in (chosen.horizon_us, long_us):
            yield base_of(name, settings).at(horizon_us=horizon_us, adaptive=True)
    for name in ("stream", *CONTROLS["stream"]):
        for tolerance_us in settings.gates.tolerances_us:
            yield base_of(name, settings).at(horizon_us=long_us, tolerance_us=tolerance_us, detail=True)
