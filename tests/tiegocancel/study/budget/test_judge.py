"""Parts are judged on real timing, by decisions that equal the golden model's; a fail names changes that pass."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from tiegocancel.firmware_sim.core.config import CoreConfig
from tiegocancel.firmware_sim.target import load_target

from tiegocancel.matching.config import CancelConfig
from tiegocancel.study.budget.ground import Ground
from tiegocancel.study.budget.judge import judge_target
from tiegocancel.study.budget.settings import BudgetSettings
from tiegocancel.study.budget.text import comparison, verdict_text

CANCEL = CancelConfig(horizon_us=8192, early_us=1024, late_us=1024, tick_bits=5, tolerance_px=1.0, ring_capacity=4096)


def test_a_large_part_passes_with_the_simplest_core(ground: Ground) -> None:
    one = judge_target(ground, load_target("ecp5-85f"), CANCEL, CoreConfig(), BudgetSettings())
    assert one.verdict.passes
    assert one.equal is True
    assert one.verdict.design.startswith("serial look-up, one at a time")
    assert one.cancelled == one.ideal
    assert one.changes_simulated == -1
    outcome = one.verdict.outcome
    assert outcome is not None
    assert outcome.drops == 0
    assert outcome.counts["suppressed"] == int(outcome.suppressed.sum()) > 1000


def test_a_part_without_room_fails_and_names_changes_that_pass(ground: Ground) -> None:
    big = replace(CANCEL, ring_capacity=200_000)
    one = judge_target(ground, load_target("ecp5-25f"), big, CoreConfig(), BudgetSettings())
    assert not one.verdict.fits
    assert one.verdict.binding.name.startswith("RAM")
    assert one.changes
    alone = [change for change in one.changes if change.name.startswith("a ring of") and " and " not in change.name]
    assert all(change.loss == pytest.approx(0.0, abs=1e-9) for change in alone)  # the ring was never that full
    assert all(change.verdict.passes for change in one.changes)
    assert [change.loss for change in one.changes] == sorted(change.loss for change in one.changes)


def test_drops_feed_back_and_the_rest_still_equals_the_golden_model(ground: Ground) -> None:
    settings = BudgetSettings(clock_mhz=0.6, architecture="fixed", changes=False)
    one = judge_target(ground, load_target("ecp5-85f"), CANCEL, CoreConfig(input_depth=16), settings)
    outcome = one.verdict.outcome
    assert outcome is not None
    assert outcome.drops > 1000
    assert one.equal is True
    assert not one.verdict.keeps_up
    assert one.cancelled is not None
    assert one.cancelled.ratio < one.ideal.ratio
    assert outcome.drops + outcome.lost + int(outcome.kept.sum()) == len(ground.events)


def test_a_narrow_line_out_is_a_constraint_and_a_wider_one_the_change(ground: Ground) -> None:
    settings = BudgetSettings(output_link_bits_per_second=100_000.0)
    one = judge_target(ground, load_target("ecp5-85f"), CANCEL, CoreConfig(), settings)
    row = next(row for row in one.verdict.constraints if row.name == "output link")
    assert not row.ok
    assert any("an output line of" in change.name for change in one.changes)


def test_the_region_of_interest_moves_the_motion_with_it(ground: Ground) -> None:
    middle = ground.middle()
    assert (middle.events.width, middle.events.height) == (160, 120)
    whole, cut = ground.motion(CANCEL)[0], middle.motion(CANCEL)[0]
    x, y = middle.events.x[:50], middle.events.y[:50]
    there_x, there_y = cut.predict(middle.events.t[:50], x, y)
    back_x, back_y = whole.predict(middle.events.t[:50], x + 80, y + 60)
    assert (there_x + 80).tolist() == back_x.tolist()
    assert (there_y + 60).tolist() == back_y.tolist()


def test_numbers_and_text_say_the_same(ground: Ground) -> None:
    judged = [
        judge_target(ground, load_target(name), CANCEL, CoreConfig(), BudgetSettings(changes=False))
        for name in ("ecp5-85f", "ice40up5k")
    ]
    table = comparison(judged)
    for one in judged:
        numbers = json.loads(json.dumps(one.to_json(), allow_nan=False))
        assert {"name", "fits", "keeps_up", "binding", "constraints", "drops", "decisions_equal_golden"} <= set(numbers)
        assert set(numbers["cycles_per_event"]) >= {"mean", "p99", "max"}
        assert set(numbers["latency_ns"]) >= {"p50", "p99", "max"}
        assert all({"name", "need", "have", "unit", "margin", "ok"} <= set(row) for row in numbers["constraints"])
        assert numbers["binding"] in verdict_text(one)
        assert numbers["name"] in table
