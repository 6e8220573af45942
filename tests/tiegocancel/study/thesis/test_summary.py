"""Verdicts follow from the numbers: change a number, and the sentence changes."""

from __future__ import annotations

import pytest

from tiegocancel.study.sweep import Row
from tiegocancel.study.thesis.experiments import SERIES, all_points, base_of
from tiegocancel.study.thesis.finding import Finding, against_control
from tiegocancel.study.thesis.point import Point
from tiegocancel.study.thesis.probe import Bench
from tiegocancel.study.thesis.results import Results
from tiegocancel.study.thesis.settings import ThesisSettings
from tiegocancel.study.thesis.study import ThesisResult
from tiegocancel.study.thesis.summary import summarise


def row(share: float, pairs: float | None = None, mean_px: float = 0.5) -> Row:
    """Return a row of 1000 events, nine tenths of them on the disc, of which ``share`` is suppressed."""
    pairs = share if pairs is None else pairs
    counted = {"": 1000, "disc_": 900, "background_": 100}
    found: Row = {"mean_px": mean_px, "p95_px": 2 * mean_px}
    for group, events in counted.items():
        found |= {
            f"{group}events": events,
            f"{group}suppressed": round(share * events),
            f"{group}pairs": round(pairs * events),
        }
    return found


def findings(bench: Bench, settings: ThesisSettings, shares: dict[str, float]) -> dict[str, Finding]:
    """Return the summary of a study in which each series has one share at all points."""
    rows = {}
    for point in all_points(settings, 2):
        name = next(
            name
            for name, series in SERIES.items()
            if all(
                getattr(series.point, field) == getattr(point, field)
                for field in ("algorithm", "own", "isolated", "motion")
            )
        )
        rows[point] = row(shares[name])
    result = ThesisResult(
        bench=bench, settings=settings, results=Results(rows, 2), agreement=(), resumed=0, run=0, interrupted=False
    )
    return {finding.what: finding for finding in summarise(result)}


def shares(**changes: float) -> dict[str, float]:
    return dict.fromkeys(SERIES, 0.8) | changes


def test_a_number_that_is_met_is_reproduced_and_one_that_is_not_is_not(
    small_bench: Bench, small_settings: ThesisSettings
) -> None:
    what = "CR at Δt = 6 ms"
    assert (
        "Reproduced as printed (-2 points)" in findings(small_bench, small_settings, shares(printed=0.33))[what].verdict
    )
    by_text = findings(small_bench, small_settings, shares(printed=0.1, cut=0.36))[what].verdict
    assert "Not by Algorithm 1 as printed (-25 points)" in by_text
    assert "(+1)" in by_text
    neither = findings(small_bench, small_settings, shares(printed=0.1, cut=0.9))[what].verdict
    assert "Reproduced by no reading" in neither


def test_own_predictions_are_named_by_what_they_add(small_bench: Bench, small_settings: ThesisSettings) -> None:
    what = "CR at Δt = 0, ten times the best of 525"
    told = findings(small_bench, small_settings, shares(printed=1.0, printed_off=0.65))[what].verdict
    assert "35 points are events that meet their own predictions" in told
    silent = findings(small_bench, small_settings, shares(printed=1.0, printed_off=0.98))[what].verdict
    assert "own predictions" not in silent


@pytest.mark.parametrize(
    ("true", "zero", "words"),
    [
        (0.83, 0.81, "shows no prediction"),
        (0.83, 0.70, "within 13 points"),
        (0.83, 0.09, "74 points behind"),
        (0.3, 0.5, "shows no prediction"),
    ],
)
def test_the_control_decides_what_a_ratio_is_worth(true: float, zero: float, words: str) -> None:
    assert words in against_control(true, zero)


def test_a_flat_curve_and_a_falling_one_get_different_words(small_bench: Bench, small_settings: ThesisSettings) -> None:
    what = "half-life τ½ of CR(Δt)"
    points = all_points(small_settings, 2)

    def told(fall: bool) -> Finding:
        rows = {point: row(0.8) for point in points}
        for name in SERIES:
            for horizon_us in small_settings.grid.horizons_us:
                for window in range(2):
                    point: Point = base_of(name, small_settings).at(horizon_us=horizon_us, window=window)
                    if fall or name == "printed":
                        rows[point] = row(2.0 ** (-horizon_us / 3500))
        result = ThesisResult(
            bench=small_bench, settings=small_settings, results=Results(rows, 2), agreement=(), resumed=0, run=0,
            interrupted=False,
        )  # fmt: skip
        return next(finding for finding in summarise(result) if finding.what == what)

    flat, falling = told(fall=False), told(fall=True)
    assert flat.ours["gated"] == "none"
    assert "no decay at all" in flat.verdict
    assert falling.ours["gated"] == "3.5 ms"
    assert "half-life is 3.5 ms" in falling.verdict
    assert "is what zero motion has" in falling.verdict
