"""Vectors decide as the plain models do, whatever is cut from the schedules around them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.firmware_sim.export import golden_vectors
from tiegocancel.firmware_sim.export.layout import cell_word, ring_word, state_of, vector_words
from tiegocancel.firmware_sim.export.readme import readme_text

from tiegocancel.events import Events
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.oracle import OracleCanceller
from tiegocancel.motion.schedule import MotionSchedule

SEEDS = st.integers(0, 2**32 - 1)
Draw = Callable[[int], Any]


@settings(max_examples=150)
@given(seed=SEEDS)
def test_decisions_equal_the_plain_models_under_whole_schedules(draw: Draw, seed: int) -> None:
    config, events, schedules = draw(seed)
    vectors = golden_vectors(events, config, schedules)
    oracle = OracleCanceller(config, schedules, width=events.width, height=events.height)
    assert vectors.suppressed.tolist() == oracle.process(events).suppressed.tolist()
    assert vectors.counters == oracle.counters
    assert (vectors.support[vectors.suppressed] >= config.need).all()
    assert len(vectors.schedules[0]) <= len(schedules[0])


def test_a_gate_may_ask_for_an_entry_later_in_the_tick_of_the_last_event() -> None:
    config = CancelConfig(
        horizon_us=160, early_us=0, late_us=16, tick_bits=3, tolerance_px=0.0, motion_at="gate", ring_capacity=4
    )
    coefficients = np.array([[0, 0, 0, 0, 0, 0], [0, 0, 3 << 16, 0, 0, 0], [0, 0, 9 << 16, 0, 0, 0]])
    whole = MotionSchedule(np.array([0, 165, 168]), coefficients, 160)
    events = Events([7, 160], [1, 4], [0, 0], [1, 1], 8, 1)  # type: ignore[arg-type]
    # The first event's gate opens at 7 + 160 µs, in the tick of the second one; by then the motion is of 3 px.
    vectors = golden_vectors(events, config, whole)
    assert vectors.suppressed.tolist() == [False, True]
    assert vectors.schedules[0].t_us.tolist() == [0, 165]


def test_an_unknown_motion_is_explained(disc: Callable[..., Any]) -> None:
    vectors = disc(CancelConfig(horizon_us=2000, ring_capacity=500))
    assert "2^44" not in readme_text(vectors, vector_words(vectors))
    unknown = golden_vectors(vectors.events, vectors.config, MotionSchedule.unknown())
    assert not unknown.suppressed.any()
    assert "An entry with c = f = 2^44 marks a motion that is not known" in readme_text(unknown, vector_words(unknown))


@settings(max_examples=80)
@given(seed=SEEDS)
def test_times_count_from_a_whole_tick_at_or_before_everything(draw: Draw, seed: int) -> None:
    config, events, schedules = draw(seed)
    vectors = golden_vectors(events, config, schedules)
    tick = 1 << config.tick_bits
    assert vectors.time_base_us % tick == 0
    assert 0 <= int(events.t[0]) - vectors.time_base_us < tick
    assert int(vectors.schedules[0].t_us[0]) >= vectors.time_base_us
    ticks = (events.t >> config.tick_bits) - (vectors.time_base_us >> config.tick_bits)
    assert ((events.t - vectors.time_base_us) >> config.tick_bits).tolist() == ticks.tolist()


@settings(max_examples=150)
@given(seed=SEEDS)
def test_layouts_are_as_wide_as_the_state_says(draw: Draw, seed: int) -> None:
    config, events, schedules = draw(seed)
    vectors = golden_vectors(events[:1], config, schedules)
    state = state_of(vectors)
    assert ring_word(vectors).bits == state.ring_entry
    assert cell_word(vectors).bits == state.cell
    widest = vector_words(vectors)["events.memh"]
    assert {field.name: field.bits for field in widest.fields}["x"] == max((events.width - 1).bit_length(), 1)


def test_the_layout_of_the_plain_rule_is_that_of_the_packed_kernel(disc: Callable[..., Any]) -> None:
    vectors = disc(CancelConfig(horizon_us=2000, ring_capacity=500))
    assert [(field.name, at, field.bits) for field, at in cell_word(vectors).placed()] == [
        ("due", 2, 30),
        ("p", 1, 1),
        ("valid", 0, 1),
    ]
    assert [(field.name, field.bits) for field in ring_word(vectors).fields] == [("due", 30), ("address", 13), ("p", 1)]


def test_most_of_a_turning_disc_is_suppressed(disc: Callable[..., Any]) -> None:
    for config in (
        CancelConfig(horizon_us=2000, ring_capacity=500),
        CancelConfig(
            horizon_us=2048, tick_bits=6, early_us=640, late_us=640, tolerance_us=640, carry=3, need=3, uses=0
        ),
    ):
        assert disc(config).suppressed.mean() > 0.5


def test_vectors_that_do_not_belong_together_are_refused(disc: Callable[..., Any]) -> None:
    vectors = disc(CancelConfig(horizon_us=2000, ring_capacity=500))
    with pytest.raises(ValueError, match="support must have one value for each of 1120 events"):
        replace(vectors, support=vectors.support[1:])
    with pytest.raises(ValueError, match="made for a horizon of 2000 µs, not of 3000 µs"):
        replace(vectors, config=CancelConfig(horizon_us=3000))
    early = MotionSchedule(np.array([-1]), vectors.schedules[0].coefficients, 2000)
    with pytest.raises(ValueError, match="no schedule entry may lie before the time base of 0 µs"):
        replace(vectors, schedules=(early,))
    with pytest.raises(ValueError, match="at least one event"):
        golden_vectors(Events.empty(8, 8), CancelConfig(), MotionSchedule.still())


def test_differences_are_named(disc: Callable[..., Any]) -> None:
    config = CancelConfig(horizon_us=2000, ring_capacity=500)
    vectors = disc(config)
    assert vectors.differences(disc(config)) == []
    assert vectors.differences(replace(vectors, suppressed=~vectors.suppressed)) == ["column suppressed"]
    assert vectors.differences(disc(config, start_us=1)) == ["column t", "the schedules"]
