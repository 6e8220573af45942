"""The profile shows on which side of their predictions events are met, ring by ring."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import CancelConfig, Canceller, Events, MotionSchedule
from tiegocancel.estimation.diagnosis.coincidence import Ring
from tiegocancel.estimation.diagnosis.diagnosis import Diagnosis
from tiegocancel.metrics import Ledger, Matches
from tiegocancel.metrics.residual_profile import ResidualProfile
from tiegocancel.report.plots import residual_profile

CENTER = (50.0, 40.0)
EDGES = (0.0, 10.0, 20.0, 30.0)


def matches(x, y, dx, dy, t_us=1000) -> Matches:
    x, y, dx, dy = (np.atleast_1d(np.asarray(column, np.int64)) for column in (x, y, dx, dy))
    return Matches(t_us=np.full(len(x), t_us), dx=dx, dy=dy, late_us=np.zeros(len(x), np.int64), ahead_x=x, ahead_y=y)


@pytest.mark.parametrize(
    ("place", "offset", "tangential", "radial"),
    [((65, 40), (0, 2), 2.0, 0.0), ((50, 55), (0, 2), 0.0, 2.0), ((35, 40), (1, 0), 0.0, -1.0)],
)
def test_turning_from_x_to_y_and_outward_are_positive(place, offset, tangential, radial):
    profile = ResidualProfile(CENTER, EDGES, 0)
    profile.add(matches(*place, *offset))
    assert profile.count.tolist() == [0, 1, 0]
    assert profile.tangential_px[1] == pytest.approx(tangential)
    assert profile.radial_px[1] == pytest.approx(radial)
    assert profile.flat_px[1].tolist() == list(offset)


def test_edges_belong_to_the_outer_ring_and_beyond_them_nothing_counts():
    profile = ResidualProfile(CENTER, EDGES, 0)
    profile.add(matches([60, 80, 95], [40, 40, 40], [0, 0, 0], [1, 1, 1]))
    assert profile.count.tolist() == [0, 1, 0]


def test_warm_up_is_left_out():
    profile = ResidualProfile(CENTER, EDGES, 500)
    profile.add(matches(60, 40, 0, 1, t_us=499))
    assert profile.count.sum() == 0
    profile.add(matches(60, 40, 0, 1, t_us=500))
    assert profile.count.sum() == 1


def test_match_at_the_centre_has_no_direction():
    profile = ResidualProfile(CENTER, EDGES, 0)
    profile.add(matches(50, 40, 2, 0))
    assert profile.tangential_px[0] == profile.radial_px[0] == 0.0


def test_summary_is_plain_json_with_empty_rings_marked():
    profile = ResidualProfile(CENTER, EDGES, 0)
    profile.add(matches([65, 65], [40, 40], [0, 0], [2, 0]))
    summary = json.loads(json.dumps(profile.summary(), allow_nan=False))
    assert summary["matches"] == 2
    assert summary["tangential_px"] == [None, 1.0, None]
    assert summary["tangential_spread_px"] == [None, 1.0, None]


@given(
    rows=st.lists(
        st.tuples(st.integers(0, 99), st.integers(0, 79), st.integers(-2, 2), st.integers(-2, 2)), min_size=1
    ),
    cut=st.integers(0, 50),
)
def test_cutting_the_matches_changes_nothing(rows, cut):
    columns = np.array(rows, np.int64).T
    whole, parts = (ResidualProfile(CENTER, EDGES, 0) for _ in range(2))
    whole.add(matches(*columns))
    for part in (columns[:, :cut], columns[:, cut:]):
        parts.add(matches(*part))
    assert parts.count.tolist() == whole.count.tolist()
    np.testing.assert_allclose(parts.tangential_px, whole.tangential_px, atol=1e-9)
    np.testing.assert_allclose(parts.radial_spread_px, whole.radial_spread_px, atol=1e-6)


@pytest.mark.parametrize("edges", [(0.0,), (0.0, 0.0), (10.0, 5.0), (-1.0, 5.0), (0.0, float("nan"))])
def test_edges_that_do_not_increase_are_refused(edges):
    with pytest.raises(ValueError, match="ring_edges_px must increase"):
        ResidualProfile(CENTER, edges, 0)


def test_figure_shows_the_model_and_the_words_of_the_diagnosis():
    profile = ResidualProfile(CENTER, EDGES, 0)
    assert residual_profile(profile) is None
    profile.add(matches(np.full(60, 65), np.full(60, 40), np.arange(60) % 2, np.full(60, 1)))
    words = "ω is 1% too high"
    known = Diagnosis(
        kind="omega", text=words, center_px=CENTER, omega_rad_s=3.0, horizon_us=8000, center_bias_px=(0.5, 0.0),
        omega_bias_rad_s=0.03, rings=(Ring(15.0, 0.1, 0.0, 0.0, 0.02, 0.02),),
    )  # fmt: skip
    unknown = Diagnosis(kind="unknown", text="the bias is unknown", center_px=CENTER, omega_rad_s=3.0, horizon_us=8000)
    lines = []
    for diagnosis in (None, unknown, known):
        drawn = residual_profile(profile, diagnosis)
        assert drawn is not None
        drawn.canvas.draw()
        assert drawn.get_suptitle() == ("" if diagnosis is None else diagnosis.text)
        lines.append(sum(len(panel.lines) for panel in drawn.axes))
    assert lines[0] == lines[1] < lines[2]


def test_ledger_tells_which_pixel_was_predicted():
    events = Events([0, 1000], [10, 14], [10, 11], [1, 1], 40, 40)
    pan = MotionSchedule(np.array([0]), np.array([[0, 0, 3 << 16, 0, 0, 0]]))
    config = CancelConfig(horizon_us=1000, tolerance_us=10)
    decisions = Canceller(config, pan, width=40, height=40).process(events)
    _, found = Ledger(config, pan).add(events, decisions)
    assert (found.ahead_x.tolist(), found.ahead_y.tolist()) == ([13], [10])
    assert (found.dx.tolist(), found.dy.tolist()) == ([1], [1])
