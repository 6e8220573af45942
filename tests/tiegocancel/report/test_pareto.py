"""The figure of a plan is drawn for any result, an empty one too."""

from __future__ import annotations

from pathlib import Path

import pytest

from tiegocancel import CancelConfig
from tiegocancel.report.pareto import draw_pareto
from tiegocancel.study.plan_candidates import Pace
from tiegocancel.study.plan_result import PlanLimits, PlanResult
from tiegocancel.study.plan_trial import Trial


@pytest.mark.parametrize("count", [0, 1, 12])
def test_a_picture_is_written(count: int, tmp_path: Path) -> None:
    trials = tuple(
        Trial(
            name=str(n),
            config=CancelConfig(),
            ego=0.5 + n / 40,
            mover=0.1,
            zero=0.0,
            reversed=0.0,
            high_water=5,
            kib=2.0**n,
            reads=1 + n % 4,
        )
        for n in range(count)
    )
    result = PlanResult(
        trials=trials,
        references=trials[:1],
        limits=PlanLimits(max_kib=100.0, max_reads=3),
        pace=Pace(us_per_px=1.0, rate_hz=1.0),
        dropped=0,
        cold=0,
        injected=False,
    )
    draw_pareto(tmp_path / "pareto.png", result)
    assert (tmp_path / "pareto.png").read_bytes().startswith(b"\x89PNG")
