"""Operating points scale with the recording's pace and are valid, or are refused."""

from __future__ import annotations

import contextlib
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import CancelConfig
from tiegocancel.study.plan_candidates import Pace, Proposal, grid, neighbour, reads_per_event

DISC = Pace(us_per_px=1053.0, rate_hz=3.7e6)


def test_the_disc_gets_the_times_that_were_measured_best_for_it() -> None:
    config = Proposal(travel_px=11.7).config(DISC)
    assert config.tick_bits == 9
    assert config.horizon_us == 12_288
    assert config.early_gate_us == config.late_gate_us == 2560
    assert config.set_bits == (6, 5)


def test_half_the_speed_doubles_every_time() -> None:
    slow = Pace(us_per_px=2 * DISC.us_per_px, rate_hz=DISC.rate_hz)
    fast, slowed = (Proposal(travel_px=8.0).config(pace) for pace in (DISC, slow))
    assert slowed.tick_bits == fast.tick_bits + 1
    assert slowed.horizon_us == 2 * fast.horizon_us
    assert slowed.late_gate_us == 2 * fast.late_gate_us


@given(us_per_px=st.floats(0.5, 1e5), rate_hz=st.floats(1.0, 1e9), seed=st.integers(0, 1000))
def test_neighbours_are_configurations_in_whole_ticks_or_refused(us_per_px: float, rate_hz: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    pace = Pace(us_per_px=us_per_px, rate_hz=rate_hz)
    proposal = Proposal()
    for _ in range(10):
        proposal = neighbour(proposal, rng)
        with contextlib.suppress(ValueError):
            config = proposal.config(pace)
            assert config.need <= len(config.horizons_us) + config.carry
            assert all(horizon_us % (1 << config.tick_bits) == 0 for horizon_us in config.horizons_us)
            assert config.reach_squared_px == proposal.radius_squared


def test_every_proposal_of_the_grid_is_another_configuration_of_the_disc() -> None:
    configs = [proposal.config(DISC) for proposal in grid()]
    assert len(set(configs)) == len(configs) >= 25


def test_a_choice_among_horizons_is_proposed_where_there_are_two() -> None:
    config = Proposal(travel_px=6.0, second=2.0, choose_px=4.0, line_px=1.5).config(DISC)
    assert (config.horizons_us, config.choose_px, config.line_px) == ((6144, 12_800), 4.0, 1.5)
    assert not Proposal(travel_px=6.0, second=1.0, choose_px=4.0).config(DISC).chooses
    assert any(proposal.config(DISC).chooses for proposal in itertools.islice(grid(), 12))


def test_the_first_proposals_of_the_grid_differ_in_their_gates() -> None:
    assert len({proposal.radius_squared for proposal in itertools.islice(grid(), 3)}) == 3


@pytest.mark.parametrize(
    ("tolerance_px", "bin_bits", "reads"),
    [(2.0, 0, 13), (1.4143, 0, 9), (1.0, 0, 5), (0.0, 0, 1), (1.4143, 1, 4), (1.0, 1, 3), (0.0, 1, 1), (1.0, 2, 3)],
)
def test_reads_count_the_words_that_the_gate_touches_at_worst(tolerance_px: float, bin_bits: int, reads: int) -> None:
    config = CancelConfig(tolerance_px=tolerance_px, bin_bits=bin_bits)
    assert reads_per_event(config) == reads


@pytest.mark.parametrize("us_per_px", [0.0, -1.0, float("inf"), float("nan")])
def test_a_pace_that_is_none_is_refused(us_per_px: float) -> None:
    with pytest.raises(ValueError, match="us_per_px must be positive and finite"):
        Pace(us_per_px=us_per_px, rate_hz=1.0)
