"""Check that the stated motion is the one that the disc has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tiegocancel.scene import MoverConfig, RigConfig, SceneConfig, ground_truth

UNEVEN = RigConfig(omega_rad_s=3.0, ripple=0.2, ripple_hz=3.0, ramp_rad_s2=1.5)
STOPPING = replace(UNEVEN, stop_go_hz=6.0, stop_share=0.4)
WOBBLING = replace(STOPPING, wobble_px=(7.0, 4.0), wobble_hz=-3.0)


@pytest.mark.parametrize("rig", [RigConfig(), UNEVEN, STOPPING, RigConfig(omega_rad_s=0.0, ramp_rad_s2=2.0)])
def test_the_angle_is_the_integral_of_the_angular_velocity(rig):
    time_s = np.linspace(0.0, 1.0, 100_001)
    omega = rig.omega_at(time_s)
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (omega[1:] + omega[:-1]))]) * 1e-5
    np.testing.assert_allclose(rig.angle_at(time_s), summed, atol=1e-8)
    assert rig.angle_at(np.zeros(1))[0] == 0.0


def test_a_steady_disc_is_stated_by_its_two_ends():
    truth = ground_truth(SceneConfig(), duration_s=0.5, start_us=1000)
    assert truth.t_us.tolist() == [1000, 501_000]
    assert truth.omega_rad_s.tolist() == [3.6, 3.6]
    assert truth.center_px.tolist() == [[664.6, 336.9]] * 2


def test_an_uneven_disc_is_stated_every_millisecond():
    truth = ground_truth(SceneConfig(rig=UNEVEN), duration_s=0.1005)
    assert truth.t_us[-1] == 100_500
    assert np.diff(truth.t_us)[:-1].tolist() == [1000] * 100
    middle = np.array([33_333], np.int64)
    assert truth.at(middle)[2][0] == pytest.approx(UNEVEN.omega_at(middle * 1e-6)[0], abs=1e-4)


def test_a_disc_that_stops_rests_and_goes_on_where_it_was():
    rig = RigConfig(omega_rad_s=4.0, stop_go_hz=5.0, stop_share=0.4, stop_ramp_s=0.02)
    assert rig.omega_at(np.array([0.0, 0.079, 0.101, 0.17, 0.2])) == pytest.approx([4.0, 4.0, 0.0, 0.0, 4.0], abs=0.1)
    angle = rig.angle_at(np.array([0.1, 0.18, 0.2, 0.3]))
    assert angle[1] - angle[0] < 1e-12
    assert angle[3] - angle[2] == pytest.approx(angle[0])
    assert len(ground_truth(SceneConfig(rig=rig), duration_s=0.3)) == 301


def test_every_point_of_a_wobbling_disc_turns_about_the_stated_centre():
    rig = SceneConfig(rig=WOBBLING).rig
    time_s = np.linspace(0.0, 0.6, 60_001)
    truth = ground_truth(SceneConfig(rig=WOBBLING), duration_s=0.6)
    assert np.hypot(*(truth.center_px - rig.center_at(truth.t_us * 1e-6)).T).min() > 5.0
    for away_px, bearing in ((0.0, 0.0), (100.0, 1.0), (264.0, 4.0)):
        angle = rig.angle_at(time_s) + bearing
        point = rig.center_at(time_s) + away_px * np.stack([np.cos(angle), np.sin(angle)], -1)
        velocity = np.gradient(point, time_s, axis=0)[::100]
        rows = np.searchsorted(truth.t_us, np.rint(time_s[::100] * 1e6))
        arm = point[::100] - truth.center_px[rows]
        stated = truth.omega_rad_s[rows, None] * np.stack([-arm[:, 1], arm[:, 0]], -1)
        np.testing.assert_allclose(stated[1:-1], velocity[1:-1], atol=0.05)


def test_a_disc_that_drifts_without_turning_has_its_centre_far_away():
    rig = SceneConfig(rig=RigConfig(omega_rad_s=0.0, wobble_px=(10.0, 10.0), wobble_hz=1.0)).rig
    center, omega = rig.motion_at(np.array([0.0, 0.25]))
    arm = (
        np.asarray([[rig.center_px[0] + 10.0, rig.center_px[1]], [rig.center_px[0], rig.center_px[1] + 10.0]]) - center
    )
    velocity = omega[:, None] * np.stack([-arm[:, 1], arm[:, 0]], -1)
    np.testing.assert_allclose(velocity, 20.0 * np.pi * np.array([[0.0, 1.0], [-1.0, 0.0]]), atol=1e-3)
    assert np.isfinite(ground_truth(SceneConfig(rig=rig), duration_s=0.01).center_px).all()


@pytest.mark.parametrize("rig", [RigConfig(omega_rad_s=0.0, stop_go_hz=2.0), RigConfig(wobble_hz=4.0)])
def test_a_disc_without_anything_to_stop_or_to_wobble_is_steady(rig):
    assert len(ground_truth(SceneConfig(rig=rig), duration_s=0.2)) == 2


def test_no_time_is_stated_by_one_entry():
    assert len(ground_truth(SceneConfig(), duration_s=0.0)) == 1
    with pytest.raises(ValueError, match="duration_s must be at least 0"):
        ground_truth(SceneConfig(), duration_s=-1.0)


@pytest.mark.parametrize("counterclockwise", [False, True])
def test_the_mover_keeps_its_speed_and_its_distance(counterclockwise):
    hand = SceneConfig(mover=MoverConfig(counterclockwise=counterclockwise)).mover
    path = hand.center_at(np.linspace(0.0, 2.0, 20_001))
    speed = np.hypot(*np.diff(path, axis=0).T) / 1e-4
    np.testing.assert_allclose(speed, hand.speed_px_s, rtol=1e-4)
    away = np.hypot(*(path - np.asarray(hand.arc_center_px)).T)
    np.testing.assert_allclose(away, hand.arc_radius_px)
    cross = np.cross(np.append(path[0] - hand.arc_center_px, 0), np.append(path[1] - path[0], 0))[2]
    assert (cross < 0) == counterclockwise
