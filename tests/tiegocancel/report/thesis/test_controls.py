"""Every figure draws its controls in the same axes, at the values that were measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

from tiegocancel.events import Events
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.report.thesis.bias import bias
from tiegocancel.report.thesis.heatmaps import gap_maps, heatmaps, ranking
from tiegocancel.report.thesis.horizons import horizons
from tiegocancel.report.thesis.matches import agreement, displacement
from tiegocancel.report.thesis.modes import gates, polarity
from tiegocancel.report.thesis.space import radial, roi
from tiegocancel.study.sweep import Row
from tiegocancel.study.thesis.agreement import agreement_points
from tiegocancel.study.thesis.experiments import SERIES, all_points
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.probe import DISTANCE_EDGES_PX, Bench
from tiegocancel.study.thesis.results import Results
from tiegocancel.study.thesis.settings import ThesisSettings
from tiegocancel.study.thesis.study import ThesisResult
from tiegocancel.study.thesis.windows import Window

_SHARES = {"true": 0.8, "zero": 0.33, "reversed": 0.14}
_MOVER, _NOISE = 0.21, 0.07
_RINGS = 6


def row_of(point: Point, *, labelled: bool) -> Row:
    """Return a row whose shares tell the motion that the point was told, the mover's and noise's their own."""
    share = _SHARES[point.motion]
    counted = {"": (1000, share), "disc_": (900, share), "background_": (100, share)}
    if labelled:
        counted |= {"ego_": (700, share), "mover_": (200, _MOVER), "noise_": (100, _NOISE)}
    row: Row = {"mean_px": 0.9, "p95_px": 1.7, "pairs": 1000 * share}
    for group, (events, part) in counted.items():
        row |= {f"{group}events": events, f"{group}suppressed": part * events, f"{group}pairs": part * events}
    if point.detail:
        rings = {"ring_": share} | ({"ring_mover_": _MOVER} if labelled else {})
        for group, part in rings.items():
            row |= {f"{group}events": [100] * _RINGS, f"{group}suppressed": [100 * part] * _RINGS}
        row |= {
            "ring_edges_px": np.linspace(0, 60, _RINGS + 1).tolist(),
            "ring_areas_px": [10.0] * _RINGS,
            "distances": [1] * (len(DISTANCE_EDGES_PX) - 1),
        }
    return row


def result_of(*, labelled: bool) -> ThesisResult:
    settings = ThesisSettings().quick()
    empty = Events.empty(240, 180)
    bench = Bench(
        tuple(Window(f"W{n}", empty, 10_000 * n, 10_000 * (n + 1)) for n in (1, 2)),
        RotationTrajectory.constant(center_px=(120.0, 90.0), omega_rad_s=3.6),
        (120.0, 90.0),
        50.0,
    )
    rows = {point: row_of(point, labelled=labelled) for point in all_points(settings, 2)}
    keys = ("precision", "recall", "cr_reference", "cr_stream", "cr_chained")
    compared = dict.fromkeys(keys, 0.8) | {"cr_reversed": 0.14}
    compared |= {"cr_zero": 0.33, "precision_zero": 0.4, "recall_zero": 0.2, "events": 1000}
    agreed = tuple((point, compared | {"density_mev_s": point.kept}) for point in agreement_points(settings))
    return ThesisResult(
        bench=bench, settings=settings, results=Results(rows, 2), agreement=agreed, resumed=0, run=0, interrupted=False
    )


@pytest.fixture(scope="module")
def labelled() -> ThesisResult:
    return result_of(labelled=True)


@pytest.fixture(scope="module")
def plain() -> ThesisResult:
    return result_of(labelled=False)


def levels(panel: Axes) -> Iterator[tuple[str, float]]:
    """Yield dash and height of every line that stays on one."""
    for line in panel.lines:
        y: Any = np.asarray(line.get_ydata(), np.float64)
        if len(y) > 1 and np.ptp(y[np.isfinite(y)]) < 1e-9:
            yield str(line.get_linestyle()), float(y[np.isfinite(y)][0])


def has(panel: Axes, dash: str, height: float) -> bool:
    return any(look == dash and found == pytest.approx(height) for look, found in levels(panel))


def test_the_curves_of_fig_7_1_stand_beside_zero_motion_on_both_sides(labelled: ThesisResult) -> None:
    left, right = horizons(labelled).axes
    assert has(left, "--", _SHARES["zero"])
    assert has(right, "--", _SHARES["zero"])
    assert has(right, ":", _SHARES["reversed"])
    assert has(right, "-.", _MOVER)
    assert has(right, "-.", _NOISE)


def test_a_wrong_motion_stands_beside_no_motion_reversed_motion_and_what_the_mover_loses(
    labelled: ThesisResult,
) -> None:
    axes = bias(labelled).axes
    assert len(axes) == 4
    for panel in axes[:2]:
        assert has(panel, "-", _SHARES["true"])
        assert has(panel, "--", _SHARES["zero"])
        assert has(panel, ":", _SHARES["reversed"])
    assert all(has(panel, "-", _MOVER) for panel in axes[2:])


def test_regions_and_radii_show_reversed_motion_and_the_mover(labelled: ThesisResult) -> None:
    disc, background, _ = roi(labelled).axes
    along = radial(labelled)
    assert along is not None
    for panel in (disc, background, *along.axes[2:]):
        assert has(panel, "--", _SHARES["zero"])
        assert has(panel, ":", _SHARES["reversed"])
        assert has(panel, "-.", _NOISE if panel is background else _MOVER)


def test_each_of_the_best_combinations_is_marked_with_its_controls(labelled: ThesisResult) -> None:
    panels = {panel.get_title(loc="left") or panel.get_title(): panel for panel in ranking(labelled).axes}
    marks = {
        name: {str(dots.get_label()): np.unique(np.asarray(dots.get_offsets())[:, 0]) for dots in panel.collections}
        for name, panel in panels.items()
    }
    lost = {"mover lost": _MOVER, "noise lost": _NOISE}
    both = {"zero motion": _SHARES["zero"], "reversed motion": _SHARES["reversed"]}
    wanted = {
        "as printed": lost | {"zero motion": _SHARES["zero"]},
        "eq. (4.4), own off": lost | both,
        "zero motion": lost,
        "streaming": lost | both,
    }
    assert marks.keys() == wanted.keys()
    for name, found in marks.items():
        assert {label: float(values[0]) for label, values in found.items()} == pytest.approx(wanted[name])
        assert all(len(values) == 1 for values in found.values())


def test_modes_have_bars_for_every_motion_and_rows_for_what_is_lost(labelled: ThesisResult) -> None:
    axes = polarity(labelled).axes
    assert len(axes) == 6
    heights = [sorted({round(float(bar.get_height()), 6) for bar in panel.patches}) for panel in axes]  # type: ignore[attr-defined]
    assert heights[0] == heights[1] == sorted(_SHARES.values())
    assert heights[2] == [_MOVER]
    assert heights[4] == [_NOISE]


def test_the_gate_in_time_and_the_maps_show_both_controls_and_what_is_lost(labelled: ThesisResult) -> None:
    sized = gates(labelled)
    assert sized is not None
    whole = sized.axes[0]
    assert has(whole, "--", _SHARES["zero"])
    assert has(whole, ":", _SHARES["reversed"])
    assert has(whole, "-.", _MOVER)
    left_of = gap_maps(labelled)
    assert left_of is not None
    maps = [float(np.nanmax(np.asarray(panel.images[0].get_array()))) for panel in left_of.axes if panel.images]
    assert maps[::2] == pytest.approx([0.8 - 0.33, 0.8 - 0.14, 0.8 - _MOVER])
    over = heatmaps(labelled)
    assert over is not None
    assert "reversed" in " ".join(panel.get_ylabel() for panel in over.axes)


def test_agreement_has_the_line_of_a_canceller_that_knows_nothing(labelled: ThesisResult) -> None:
    drawn = agreement(labelled)
    assert drawn is not None
    for panel in drawn.axes[:2]:
        assert has(panel, "--", 0.4)
        assert has(panel, "--", 0.2)
    lines = {str(found.get_label()): found for found in drawn.axes[2].collections}
    for words, height in (("streaming, zero motion", 0.33), ("streaming, reversed motion", 0.14)):
        segments: Any = lines[words].get_segments()  # type: ignore[attr-defined]
        assert {float(y) for segment in segments for _, y in segment} == {height}


def test_events_without_labels_lose_the_rows_of_what_is_lost_and_keep_the_rest(plain: ThesisResult) -> None:
    assert len(bias(plain).axes) == 2
    assert len(polarity(plain).axes) == 2
    maps = gap_maps(plain)
    assert maps is not None
    assert sum(bool(panel.images) for panel in maps.axes) == 4
    for drawn in (horizons(plain), radial(plain), roi(plain), ranking(plain), gates(plain), displacement(plain)):
        assert drawn is not None
        labels = {label for panel in drawn.axes for label in panel.get_legend_handles_labels()[1]}
        assert not {label for label in labels if "lost" in label}


def test_every_series_of_the_sweep_and_its_controls_differ_by_the_motion_alone() -> None:
    from tiegocancel.study.thesis.experiments import CONTROLS

    for name, controls in CONTROLS.items():
        true = SERIES[name].point
        for control in controls:
            assert SERIES[control].control
            assert SERIES[control].point.motion != "true"
            assert SERIES[control].point.at(motion="true") == true
