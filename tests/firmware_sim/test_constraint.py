"""A constraint says what is left, what binds and how sure that is."""

from __future__ import annotations

import pytest
from tiegocancel.firmware_sim.constraint import Constraint, binding


def constraint(need: float, have: float, error_share: float = 0.0) -> Constraint:
    return Constraint(
        name=f"{need} of {have}", kind="fit", need=need, have=have, unit="", evidence="exact", error_share=error_share
    )


@pytest.mark.parametrize(
    ("need", "have", "error", "verdict", "margin"),
    [
        (50, 100, 0.0, "pass", 0.5),
        (81, 100, 0.0, "tight", 0.19),
        (60, 100, 0.5, "tight", 0.4),  # the estimate may err by more than is left
        (100, 100, 0.0, "tight", 0.0),
        (101, 100, 0.0, "FAIL", -0.01),
        (0, 0, 0.0, "pass", 1.0),
        (1, 0, 0.0, "FAIL", -1e9),
    ],
)
def test_verdict_and_margin(need: float, have: float, error: float, verdict: str, margin: float) -> None:
    one = constraint(need, have, error)
    assert one.verdict == verdict
    assert one.margin == pytest.approx(margin)
    assert one.ok == (verdict != "FAIL")


def test_the_least_margin_binds() -> None:
    rows = [constraint(1, 2), constraint(9, 10), constraint(3, 2)]
    assert binding(rows) is rows[2]
    assert binding(rows[:2]) is rows[1]
