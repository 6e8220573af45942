"""The diagnosis finds the biases that were put in, says how sure it is, and keeps silent where nothing coincides."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import CancelConfig, Canceller, Events, RotationTrajectory
from tiegocancel.estimation.diagnosis.diagnose import diagnose_rotation, refine_rotation
from tiegocancel.estimation.diagnosis.offsets import Shift
from tiegocancel.scene import SceneConfig, simulate

CENTER, OMEGA = (160.0, 120.0), 12.0
CONFIG = CancelConfig(horizon_us=12_000)


def rotation(center=CENTER, omega=OMEGA) -> RotationTrajectory:
    return RotationTrajectory.constant(center_px=center, omega_rad_s=omega)


@pytest.fixture(scope="module")
def disc() -> Events:
    """A turning disc with a hand in view, without labels."""
    config = SceneConfig.disc(width=320, height=240, omega_rad_s=OMEGA)
    config = replace(config, rig=replace(config.rig, center_px=CENTER))
    events = Events.concatenate(list(simulate(config, duration_s=0.1, seed=1)))
    return Events(events.t, events.x, events.y, events.p, events.width, events.height)


@pytest.mark.parametrize(
    ("center_off", "omega_off", "kind"),
    [
        ((0.0, 0.0), 0.0, "none"),
        ((0.0, 0.0), 0.03, "omega"),
        ((0.0, 0.0), -0.05, "omega"),
        ((0.0, -6.0), 0.0, "centre"),
        ((4.0, 0.0), 0.0, "centre"),
        ((-5.0, 3.0), 0.04, "both"),
    ],
)
def test_biases_that_were_put_in_are_found_and_named(disc, center_off, omega_off, kind):
    motion = rotation((CENTER[0] + center_off[0], CENTER[1] + center_off[1]), OMEGA * (1 + omega_off))
    found = diagnose_rotation(disc, motion, CONFIG)
    assert found.kind == kind
    assert found.omega_bias_rad_s == pytest.approx(OMEGA * omega_off, abs=0.005 * OMEGA)
    assert found.center_bias_px == pytest.approx(center_off, abs=0.6)
    assert abs(found.omega_bias_rad_s - OMEGA * omega_off) < 4 * found.omega_sigma_rad_s
    assert found.share_explained > 0.3


def test_text_says_which_way_how_much_and_what_to_use(disc):
    found = diagnose_rotation(disc, rotation((154.0, 120.0), OMEGA * 1.05), CONFIG)
    assert found.text.startswith("ω is ")
    assert "too high" in found.text
    assert "px too far left" in found.text
    used = [float(value) for value in found.text.rpartition(": use ")[2].split(",")]
    assert used == pytest.approx([*CENTER, OMEGA], rel=0.01)


def test_refining_takes_the_biases_off_and_cancels_more(disc):
    motion = rotation((167.0, 115.0), OMEGA * 0.93)
    better, history = refine_rotation(disc, motion, CONFIG)
    assert [found.kind for found in history][-1] == "none"
    assert better.mean()[1] == pytest.approx(OMEGA, rel=0.005)
    assert better.mean()[0] == pytest.approx(CENTER, abs=0.6)
    assert better.source == "constant, refined"
    assert better.notes[0].startswith("refined: ω is ")
    ratios = []
    for each in (motion, better):
        schedule = each.schedule(CONFIG.horizon_us)
        ratios.append(Canceller(CONFIG, schedule, width=320, height=240).process(disc).suppressed.mean())
    assert ratios[1] > ratios[0] + 0.03


def test_correction_shifts_every_row_of_a_path_that_varies(disc):
    path = RotationTrajectory(
        t_us=np.array([0, 50_000, 100_000]),
        center_px=np.array([CENTER] * 3),
        omega_rad_s=OMEGA * 1.04 * np.ones(3),
        interpolation="spline",
    )
    found = diagnose_rotation(disc, path, CONFIG)
    better = found.corrected(path)
    assert found.text.endswith("on average")
    assert better.interpolation == "spline"
    np.testing.assert_allclose(better.omega_rad_s, OMEGA, rtol=0.005)


def test_short_horizon_widens_the_sigma_of_the_centre(disc):
    near, far = (diagnose_rotation(disc, rotation(), CancelConfig(horizon_us=horizon)) for horizon in (5000, 20_000))
    assert max(near.center_sigma_px) > 3 * max(far.center_sigma_px)
    assert near.omega_sigma_rad_s > 3 * far.omega_sigma_rad_s


def test_rings_follow_the_model(disc):
    found = diagnose_rotation(disc, rotation(omega=OMEGA * 1.04), CONFIG)
    assert len(found.rings) >= 5
    turn = -found.omega_bias_rad_s * CONFIG.horizon_us * 1e-6
    for ring in found.rings:
        assert ring.turning_px == pytest.approx(turn * ring.radius_px, abs=0.2)
        assert math.hypot(ring.right_px, ring.down_px) < 0.2


def test_same_events_and_seed_give_the_same_diagnosis(disc):
    one, other = (diagnose_rotation(disc, rotation(), CONFIG, max_events=5000, seed=3) for _ in range(2))
    assert one == other
    assert one.predictions <= 5000


def noise(count: int, seed: int = 1) -> Events:
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(0, 100_000, count))
    return Events(t, rng.integers(0, 320, count), rng.integers(0, 240, count), rng.integers(0, 2, count), 320, 240)


@pytest.mark.parametrize("count", [500, 5000, 60_000])
@pytest.mark.parametrize("seed", [1, 2])
def test_noise_has_no_diagnosis(count, seed):
    found = diagnose_rotation(noise(count, seed), rotation(omega=5.0), CONFIG)
    assert found.kind == "unknown"
    assert math.isnan(found.omega_bias_rad_s)
    assert math.isinf(found.omega_sigma_rad_s)
    assert found.corrected(rotation()).mean() == rotation().mean()
    assert json.loads(json.dumps(found.summary(), allow_nan=False))["center_bias_px"] is None


@pytest.mark.parametrize("factor", [5.0, -3.0, 0.0])
def test_motion_that_is_all_wrong_has_no_diagnosis(disc, factor):
    config = CancelConfig(horizon_us=25_000)
    motion, history = refine_rotation(disc, rotation(omega=factor * OMEGA), config)
    assert [found.kind for found in history] == ["unknown"]
    assert motion.mean() == rotation(omega=factor * OMEGA).mean()


def test_shuffled_times_have_no_diagnosis(disc):
    order = np.random.default_rng(0).permutation(len(disc))
    shuffled = Events(disc.t, disc.x[order], disc.y[order], disc.p[order], 320, 240)
    assert diagnose_rotation(shuffled, rotation(), CONFIG).kind == "unknown"


def test_horizon_in_which_nothing_moves_is_said(disc):
    found = diagnose_rotation(disc, rotation(), CancelConfig(horizon_us=500))
    assert found.kind == "unknown"
    assert "2.5 px or more within 0.5 ms" in found.text


@pytest.mark.parametrize("count", [0, 1, 3])
def test_hardly_any_events_do_not_crash(count):
    events = Events(np.arange(count) * 20_000, *[np.arange(count)] * 2, np.zeros(count, int), 320, 240)
    assert diagnose_rotation(events, rotation(), CONFIG).kind == "unknown"


def test_bad_arguments_are_refused(disc):
    with pytest.raises(ValueError, match="max_events must be at least 1000, not 5"):
        diagnose_rotation(disc, rotation(), CONFIG, max_events=5)
    with pytest.raises(ValueError, match="rounds must be at least 1, not 0"):
        refine_rotation(disc, rotation(), CONFIG, rounds=0)


TURN, MOVE = st.floats(-0.5, 0.5), st.floats(-10, 10)


@given(one=st.tuples(TURN, MOVE, MOVE), other=st.tuples(TURN, MOVE, MOVE), x=MOVE, y=MOVE)
def test_shifts_compose(one, other, x, y):
    point = np.array([x]), np.array([y])
    in_turn = Shift(*other).applied(*Shift(*one).applied(*point))
    np.testing.assert_allclose(Shift(*one).then(Shift(*other)).applied(*point), in_turn, atol=1e-9)


def test_real_disc_with_a_hand_beside_it(recording):
    rows = np.load(recording("anu_disc_10ms.npy"))
    x, y, p, t_s, _ = rows[rows[:, 4] == 0].T
    t_us = np.round(t_s.astype(np.float64) * 1e6).astype(np.int64)
    events = Events(t_us, x.astype(np.int64), y.astype(np.int64), p.astype(np.int64), 1280, 720)
    found = diagnose_rotation(events, rotation((674.6, 336.9), 3.63 * 1.03), CancelConfig(horizon_us=6000))
    assert found.kind == "both"
    assert found.omega_bias_rad_s == pytest.approx(0.109, abs=0.05)
    assert found.center_bias_px == pytest.approx((10, 0), abs=3)
