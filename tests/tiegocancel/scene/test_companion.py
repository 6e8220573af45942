"""Check that the companion rides on the disc, at the relative speed that it states."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.events import EGO, MOVER, Events
from tiegocancel.scene import CompanionConfig, MoverConfig, RigConfig, SceneConfig, SensorConfig, simulate
from tiegocancel.scene.companion import Ride
from tiegocancel.scene.mover import draw_mover


def scene(rig=None, **companion):
    """A scene of 320×180 px with a companion only, and neither noise nor jitter."""
    return SceneConfig(
        width=320,
        height=180,
        rig=rig or RigConfig(),
        mover=MoverConfig(enabled=False),
        companion=CompanionConfig(enabled=True, **companion),
        sensor=SensorConfig(noise_hz=0.0, jitter_us=0.0),
    )


@given(
    omega_rad_s=st.floats(-5.0, 5.0),
    relative_px_s=st.floats(-300.0, 300.0),
    wobble_px=st.sampled_from([(0.0, 0.0), (6.0, 3.0)]),
    start_s=st.floats(0.0, 2.0),
)
def test_the_hand_passes_over_the_print_at_its_relative_speed(omega_rad_s, relative_px_s, wobble_px, start_s):
    rig = RigConfig(omega_rad_s=omega_rad_s, wobble_px=wobble_px, ripple=0.2, stop_go_hz=3.0)
    config = scene(rig, relative_px_s=relative_px_s)
    ride, time_s = Ride(config.companion, config.rig), start_s + np.array([0.0, 1e-3])
    place, angle = ride.center_at(time_s) - config.rig.center_at(time_s), config.rig.angle_at(time_s)
    # Seen from the disc, the middle of the hand moves along its circle.
    turned = place[:, 0] + 1j * place[:, 1]
    on_disc = turned * np.exp(-1j * angle)
    step = np.angle(on_disc[1] / on_disc[0]) * config.companion.radius_px
    assert step == pytest.approx(relative_px_s * 1e-3, abs=1e-6)
    assert np.diff(ride.angle_at(time_s) - angle)[0] * config.companion.radius_px == pytest.approx(step, abs=1e-6)


@given(size_px=st.floats(5.0, 120.0), radius_px=st.floats(1.0, 80.0), relative_px_s=st.floats(-500.0, 500.0))
def test_no_point_of_the_hand_is_faster_than_the_bound(size_px, radius_px, relative_px_s):
    config = scene(size_px=size_px, radius_px=radius_px, relative_px_s=relative_px_s)
    rim_px_s = config.rig.rim_speed_px_s(0.0, 0.025)
    _, cover = draw_mover(config.companion.hand)
    farthest = radius_px + 0.25 * np.hypot(*cover.shape)  # two samples a pixel, half of the diagonal
    speed = farthest * abs(3.6 + relative_px_s / radius_px)
    assert speed <= config.companion.speed_px_s(rim_px_s, config.rig.radius_px) * (1.0 + 1e-9)


def test_it_is_off_unless_it_is_enabled():
    assert not SceneConfig().companion.enabled
    assert scene().step_us() <= SceneConfig(width=320, height=180).step_us()


def test_its_events_are_the_movers_and_lie_about_its_middle():
    config = scene(relative_px_s=40.0)
    events = Events.concatenate(list(simulate(config, duration_s=0.1)))
    mine = events.select(events.label == MOVER)
    away = Ride(config.companion, config.rig).center_at(mine.t * 1e-6) - np.stack([mine.x, mine.y], axis=-1)
    assert set(events.label.tolist()) == {EGO, MOVER}
    assert len(mine) > 100
    assert np.hypot(*away.T).max() < 0.8 * config.companion.size_px + 4.0


def test_a_companion_at_rest_on_a_resting_disc_is_silent():
    config = scene(RigConfig(omega_rad_s=0.0), relative_px_s=0.0)
    assert list(simulate(config, duration_s=0.05)) == []
