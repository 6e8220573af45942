"""A point gives the same row alone and in company, and the row is what the algorithm decided."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.reference import run_reference
from tiegocancel.study.thesis.agreement import agree, agreement_points
from tiegocancel.study.thesis.experiments import SERIES, all_points
from tiegocancel.study.thesis.model_error import model_errors
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.probe import Bench, decide, measure, stream_of
from tiegocancel.study.thesis.settings import ThesisSettings


def test_rows_do_not_depend_on_their_company(small_bench: Bench) -> None:
    points = [series.point.at(horizon_us=h) for series in SERIES.values() for h in (2000, 6000)]
    together = measure(small_bench, [point.job() for point in points])
    for point, row in zip(points, together, strict=True):
        alone = measure(small_bench, [point.job()])[0]
        assert {k: v for k, v in alone.items() if k != "seconds"} == {k: v for k, v in row.items() if k != "seconds"}
        assert json.loads(json.dumps(row)) == row


def test_a_streaming_point_is_the_canceller(small_bench: Bench) -> None:
    point = Point(algorithm="stream", horizon_us=6000, window=1)
    outcome = decide(small_bench, [point])[0]
    window = small_bench.windows[1].events
    schedule = small_bench.motion.schedule(6000, start_us=int(window.t[0]), stop_us=int(window.t[-1]))
    canceller = Canceller(point.cancel_config(), schedule, width=window.width, height=window.height)
    np.testing.assert_array_equal(outcome.suppressed, canceller.process(window).suppressed)


def test_a_reference_point_is_the_reference_and_counts_add_up(small_bench: Bench) -> None:
    point = Point(algorithm="gated", horizon_us=2000)
    row = measure(small_bench, [point.job()])[0]
    events = stream_of(small_bench, point)
    found = run_reference(events, small_bench.motion, point.reference_config())
    counted = events.t >= small_bench.windows[0].start_us
    assert row["events"] == np.count_nonzero(counted)
    assert row["suppressed"] == np.count_nonzero(found.suppressed & counted)
    for count in ("events", "suppressed"):
        assert row[count] == row[f"disc_{count}"] + row[f"background_{count}"]
        assert row[count] == sum(row[f"{label}_{count}"] for label in ("ego", "mover", "noise"))


def test_the_true_motion_stands_out_at_a_long_horizon_and_no_motion_does_not(small_bench: Bench) -> None:
    points = [Point(algorithm="gated", horizon_us=8000, motion=kind) for kind in ("true", "zero", "reversed")]
    true, zero, back = (
        row["ego_suppressed"] / row["ego_events"] for row in measure(small_bench, [p.job() for p in points])
    )
    assert true > zero + 0.3
    assert true > back + 0.3


def test_cutting_a_window_out_takes_what_its_length_says(small_bench: Bench) -> None:
    whole, cut = (
        measure(small_bench, [Point(algorithm="gated", horizon_us=6000, isolated=isolated).job()])[0]
        for isolated in (False, True)
    )
    shares = [row["suppressed"] / row["events"] for row in (whole, cut)]
    assert shares[1] <= 0.5  # 1 − 6/10, and the gate of 1 ms
    assert shares[0] > shares[1] + 0.2


def test_thinning_keeps_the_same_share_for_every_algorithm(small_bench: Bench) -> None:
    kept = {}
    for algorithm in ("gated", "stream"):
        events = stream_of(small_bench, Point(algorithm=algorithm, horizon_us=2000, kept=0.25))  # type: ignore[arg-type]
        inside = events.between(small_bench.windows[0].start_us, small_bench.windows[0].stop_us)
        kept[algorithm] = np.stack([inside.t, inside.x, inside.y])
        assert len(inside) == pytest.approx(0.25 * len(small_bench.windows[0].isolated), rel=0.15)
    np.testing.assert_array_equal(kept["gated"], kept["stream"])


def test_rings_count_the_mover_apart(small_bench: Bench) -> None:
    row = measure(small_bench, [Point(algorithm="stream", horizon_us=2000, detail=True).job()])[0]
    for count in ("events", "suppressed"):
        assert sum(row[f"ring_mover_{count}"]) == row[f"mover_{count}"] > 0
        assert all(
            mover <= every for mover, every in zip(row[f"ring_mover_{count}"], row[f"ring_{count}"], strict=True)
        )


def test_as_printed_any_motion_cancels_everything_at_no_horizon(small_bench: Bench) -> None:
    """Its own prediction lies where the event is: the thesis's ten best combinations need no motion."""
    point = SERIES["printed_zero"].point
    row = measure(small_bench, [point.job()])[0]
    assert row["suppressed"] == row["events"]
    assert row["mover_suppressed"] == row["mover_events"] > 0


def test_every_point_is_listed_once(small_settings: ThesisSettings) -> None:
    points = all_points(ThesisSettings(), 6)
    assert len(points) == len(set(points))
    grid = [p for p in points if p == SERIES["gated"].point.at(
        horizon_us=p.horizon_us, tolerance_px=p.tolerance_px, tolerance_us=p.tolerance_us)]  # fmt: skip
    assert len({(p.horizon_us, p.tolerance_px, p.tolerance_us) for p in grid}) >= 525
    assert len(all_points(small_settings, 2)) < 400


def test_the_canceller_agrees_with_the_reference_and_its_single_cells_cost_little(
    small_bench: Bench, small_settings: ThesisSettings
) -> None:
    rows = agree(small_bench, [point.job() for point in agreement_points(small_settings)])
    for row in rows:
        assert 0.5 < row["precision"] <= 1.0
        assert 0.5 < row["recall"] <= 1.0
        assert row["cr_chained"] >= row["cr_stream"] - 0.01
        assert abs(row["cr_reference"] - row["cr_stream"]) < 0.15
        assert row["cr_zero"] < row["cr_stream"] - 0.2
        assert row["cr_reversed"] < row["cr_stream"] - 0.2
        assert row["recall_zero"] < row["recall"] - 0.3
        assert row["precision_zero"] < row["precision"]
    assert rows[0]["events"] > rows[-1]["events"] > 0


def test_errors_of_the_motion_move_predictions_as_the_formulas_say(
    small_bench: Bench, small_settings: ThesisSettings
) -> None:
    errors = model_errors(small_bench, small_settings)
    for curve in errors.omega:
        seen = np.isfinite(curve.predictions)
        # Bands are as wide as a twelfth of the radius, and events do not fill them evenly.
        np.testing.assert_allclose(curve.predictions[seen], curve.exact[seen], atol=0.06)
        np.testing.assert_allclose(curve.exact, curve.bound, rtol=0.01)
        assert curve.exact[-1] > 5 * curve.exact[0]
    for curve in errors.center:
        seen = np.isfinite(curve.predictions)
        np.testing.assert_allclose(curve.predictions[seen], curve.exact[seen], rtol=1e-6)
        assert np.ptp(curve.exact) == 0.0
        assert (curve.exact < 0.5 * curve.bound).all()
        matched = curve.matched[np.isfinite(curve.matched)]
        assert matched.mean() > 0.05  # the offset shows in what is matched, on the side of the error
