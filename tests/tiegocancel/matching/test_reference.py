"""The thesis's algorithm keeps the invariants of its §6.3.5, and shows which of them say nothing."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.events import Events
from tiegocancel.matching.forecast import Forecast
from tiegocancel.matching.reference import AdaptiveTolerance, ReferenceConfig, run_reference
from tiegocancel.matching.reference_loop import run_printed_loop
from tiegocancel.motion.rotation import RotationTrajectory

SIDE = 200
CENTER = (99.3, 101.8)
TURN = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=5.0)

configs = st.builds(
    ReferenceConfig,
    horizon_us=st.sampled_from([0, 1, 300, 1000, 5000]),
    tolerance_us=st.sampled_from([0, 40, 1000]),
    tolerance_px=st.sampled_from([0.0, 1.0, 2.5, 8.0]),
    adaptive=st.sampled_from([None, AdaptiveTolerance(k=2.0, timing_us=2000.0, center_px=0.7)]),
    polarity=st.sampled_from(["opposite", "equal", "ignore"]),
    polarity_first=st.booleans(),
    allow_self_match=st.booleans(),
    pairing=st.sampled_from(["greedy", "mutual"]),
    release=st.sampled_from(["printed", "closed"]),
    gate=st.sampled_from(["batch", "pair"]),
    index=st.sampled_from(["tree", "grid"]),
)


@st.composite
def streams(draw: st.DrawFn) -> Events:
    """Draw few events in a small corner, so that they meet; bursts at one time, and pauses."""
    count = draw(st.integers(0, 60))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    steps = rng.choice([0, 0, 1, 30, 400, 20_000], count, p=[0.3, 0.1, 0.2, 0.2, 0.19, 0.01])
    t = draw(st.sampled_from([-5000, 0, 1 << 40])) + np.cumsum(steps)
    low, high = draw(st.sampled_from([(0, 6), (96, 106), (190, SIDE)]))
    x, y = rng.integers(low, high, count), rng.integers(low, high, count)
    return Events(t, x, y, rng.integers(0, 2, count), SIDE, SIDE)


def ring(
    *, radii_px: tuple[float, ...], period_us: int, turns_us: int, dots: int = 12, jitter_us: float = 0.0
) -> Events:
    """Return dots on rings that turn by ω; each dot fires once every ``period_us``, phases spread, polarity its own."""
    rows = []
    rng = np.random.default_rng(3)
    for (number, radius), dot in itertools.product(enumerate(radii_px), range(dots)):
        t = np.arange((dot * period_us) // dots + number, turns_us, period_us)
        t = t + np.rint(rng.normal(0.0, jitter_us, len(t))).astype(np.int64)
        angle = 2 * np.pi * dot / dots + 5.0 * t * 1e-6
        x, y = CENTER[0] + radius * np.cos(angle), CENTER[1] + radius * np.sin(angle)
        rows.append(np.column_stack([t, np.floor(x + 0.5), np.floor(y + 0.5), np.full(len(t), dot % 2)]))
    table = np.concatenate(rows).astype(np.int64)
    t, x, y, p = table[np.argsort(table[:, 0], kind="stable")].T
    return Events(t, x, y, p, SIDE, SIDE)


@given(events=streams(), config=configs)
def test_each_index_is_in_at_most_one_match(events: Events, config: ReferenceConfig) -> None:
    found = run_reference(events, TURN, config)
    match = found.match
    assert len(np.unique(match.real)) == len(np.unique(match.source)) == len(match.real)
    assert np.count_nonzero(found.suppressed) == np.count_nonzero(found.used) == len(match.real)
    assert not (found.residual_predicted & found.used).any()
    assert np.count_nonzero(found.residual_predicted | found.used) == len(events) - found.outside
    assert found.forecast.made[match.source].all()


@given(events=streams(), config=configs)
def test_every_match_keeps_within_its_gates(events: Events, config: ReferenceConfig) -> None:
    found = run_reference(events, TURN, config)
    match = found.match
    assert (match.distance_px <= found.forecast.reach_px[match.source] * (1 + 1e-8) + 1e-8).all()
    assert (np.abs(match.late_us) <= config.tolerance_us * (1 if config.gate == "pair" else 3)).all()
    if config.polarity != "ignore":
        same = events.p[match.real] == events.p[match.source]
        assert (same == (config.polarity == "opposite")).all()
    if not config.allow_self_match:
        assert (match.real != match.source).all()


@given(events=streams(), config=configs)
def test_the_printed_loop_makes_the_same_matches(events: Events, config: ReferenceConfig) -> None:
    config = replace(config, release="printed")
    fast, slow = run_reference(events, TURN, config), run_printed_loop(events, TURN, config)
    for name in ("real", "source", "distance_px", "late_us"):
        np.testing.assert_array_equal(getattr(fast.match, name), getattr(slow.match, name))
    assert (fast.stale, fast.outside) == (slow.stale, slow.outside)


@given(events=streams(), config=configs)
def test_at_horizon_zero_every_event_cancels_itself(events: Events, config: ReferenceConfig) -> None:
    if config.polarity == "equal":
        return
    config = replace(config, horizon_us=0, allow_self_match=True, release="printed")
    assert run_reference(events, TURN, config).suppressed.all()


def test_the_hundred_per_cent_at_horizon_zero_is_self_matching_alone() -> None:
    events = ring(radii_px=(40.0, 60.0, 80.0), period_us=4000, turns_us=200_000, dots=8)
    shares = {
        own: run_reference(events, TURN, ReferenceConfig(horizon_us=0, allow_self_match=own)).suppressed.mean()
        for own in (True, False)
    }
    assert shares == {True: 1.0, False: 0.0}


def test_events_meet_their_own_predictions_up_to_two_gates_ahead() -> None:
    events = ring(radii_px=(30.0,), period_us=50_000, turns_us=1_000_000, dots=240)
    own = {}
    for horizon_us in (500, 1500, 2500):
        match = run_reference(events, TURN, ReferenceConfig(horizon_us=horizon_us, tolerance_us=1000)).match
        own[horizon_us] = np.count_nonzero(match.real == match.source)
    assert own[500] > 0.8 * len(events)
    assert own[1500] > 0.1 * len(events)
    assert own[2500] == 0


def test_a_turning_ring_is_cancelled_at_its_period_and_nowhere_else() -> None:
    events = ring(radii_px=(60.0, 75.0, 90.0), period_us=8000, turns_us=400_000)
    kind = ReferenceConfig(allow_self_match=False, release="closed", gate="pair", tolerance_px=1.5)
    shares = {}
    for horizon_us in (4000, 8000):
        config = replace(kind, horizon_us=horizon_us)
        counted = events.t >= events.t[0] + config.warm_up_us
        shares[horizon_us] = run_reference(events, TURN, config).suppressed[counted].mean()
    assert shares[8000] > 0.99
    assert shares[4000] == 0.0
    still = run_reference(events, TURN.stopped(), replace(kind, horizon_us=8000))
    assert still.suppressed.mean() < 0.05


def test_the_ratio_is_smooth_in_the_horizon_when_each_pair_has_its_gate() -> None:
    events = ring(radii_px=(30.0, 50.0, 70.0, 90.0), period_us=5000, turns_us=300_000, dots=24, jitter_us=500.0)
    kind = ReferenceConfig(allow_self_match=False, release="closed", gate="pair", tolerance_us=1000)
    horizons = np.arange(3000, 7001, 100)
    ratios = np.array(
        [run_reference(events, TURN, replace(kind, horizon_us=int(h))).suppressed.mean() for h in horizons]
    )
    assert ratios.max() - ratios.min() > 0.5  # there is something to be smooth about
    assert np.abs(np.diff(ratios)).max() < 0.08  # a step is a tenth of the gate
    assert int(horizons[ratios.argmax()]) == pytest.approx(5000, abs=400)


@given(
    radius=st.floats(0.0, 90.0),
    angle=st.floats(0.0, 6.28),
    bias=st.tuples(st.floats(-20, 20), st.floats(-20, 20)),
    horizon_us=st.integers(0, 50_000),
)
def test_a_wrong_centre_moves_every_prediction_by_twice_the_sine_of_half_the_turn(
    radius: float, angle: float, bias: tuple[float, float], horizon_us: int
) -> None:
    x, y = int(CENTER[0] + radius * np.cos(angle)), int(CENTER[1] + radius * np.sin(angle))
    events = Events([0], [x], [y], [1], SIDE, SIDE)
    config = ReferenceConfig(horizon_us=horizon_us)
    wrong = RotationTrajectory.constant(center_px=(CENTER[0] + bias[0], CENTER[1] + bias[1]), omega_rad_s=5.0)
    true, moved = (Forecast.of(events, motion, config) for motion in (TURN, wrong))
    apart = np.hypot(moved.ahead_x - true.ahead_x, moved.ahead_y - true.ahead_y)[0]
    size = np.hypot(*bias)
    assert apart == pytest.approx(2 * abs(np.sin(0.5 * 5.0 * horizon_us * 1e-6)) * size, abs=1e-9)
    assert apart <= 2 * size  # the printed bound (4.8) holds only while ωΔt ≤ π/3
    if 5.0 * horizon_us * 1e-6 <= np.pi / 3:
        assert apart <= size + 1e-9


@given(x=st.integers(0, 199), y=st.integers(0, 199), bias=st.floats(-3, 3), horizon_us=st.integers(0, 50_000))
def test_a_wrong_speed_moves_predictions_in_proportion_to_the_radius(
    x: int, y: int, bias: float, horizon_us: int
) -> None:
    events = Events([0], [x], [y], [1], SIDE, SIDE)
    config = ReferenceConfig(horizon_us=horizon_us)
    wrong = RotationTrajectory.constant(center_px=CENTER, omega_rad_s=5.0 + bias)
    true, moved = (Forecast.of(events, motion, config) for motion in (TURN, wrong))
    apart = np.hypot(moved.ahead_x - true.ahead_x, moved.ahead_y - true.ahead_y)[0]
    radius = np.hypot(x - CENTER[0], y - CENTER[1])
    assert apart == pytest.approx(2 * radius * abs(np.sin(0.5 * bias * horizon_us * 1e-6)), abs=1e-9)
    assert apart <= radius * abs(bias) * horizon_us * 1e-6 + 1e-9


def test_without_turn_predictions_stay_exactly_where_events_are() -> None:
    rng = np.random.default_rng(0)
    events = Events(np.arange(500), rng.integers(0, SIDE, 500), rng.integers(0, SIDE, 500), [0] * 500, SIDE, SIDE)
    for motion, horizon_us in ((TURN, 0), (TURN.stopped(), 8000)):
        forecast = Forecast.of(events, motion, ReferenceConfig(horizon_us=horizon_us))
        np.testing.assert_array_equal(forecast.ahead_x, events.x)
        np.testing.assert_array_equal(forecast.ahead_y, events.y)
        assert forecast.made.all()


def test_predictions_beyond_the_image_are_dropped_and_counted() -> None:
    events = Events([0, 1], [0, 100], [100, 100], [1, 1], SIDE, SIDE)
    motion = RotationTrajectory.constant(center_px=(100.0, -300.0), omega_rad_s=2.0)
    found = run_reference(events, motion, ReferenceConfig(horizon_us=50_000))
    assert found.outside == 1
    assert found.forecast.made.tolist() == [False, True]


def test_the_adaptive_gate_grows_with_the_radius() -> None:
    events = Events([0, 0], [round(CENTER[0]), 199], [round(CENTER[1]), 101], [1, 1], SIDE, SIDE)
    wide = AdaptiveTolerance(k=2.0, timing_us=1000.0, center_px=0.5)
    reach = Forecast.of(events, TURN, ReferenceConfig(adaptive=wide)).reach_px
    radius = np.hypot(events.x - CENTER[0], events.y - CENTER[1])
    np.testing.assert_allclose(reach, 2.0 * (radius * 5.0 * 1e-3 + 0.5))


@pytest.mark.parametrize(
    ("name", "value"),
    [("horizon_us", -1), ("tolerance_us", 1.5), ("tolerance_px", 65.0), ("polarity", "same"), ("pairing", "best"),
     ("release", "never"), ("gate", "each"), ("index", "hash")],
)  # fmt: skip
def test_a_wrong_value_is_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=name):
        ReferenceConfig(**{name: value})  # type: ignore[arg-type]


def test_the_printed_loop_refuses_what_is_not_printed() -> None:
    with pytest.raises(ValueError, match="closed"):
        run_printed_loop(Events.empty(SIDE, SIDE), TURN, ReferenceConfig(release="closed"))
