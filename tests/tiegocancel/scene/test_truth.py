"""Check that the stated motion is the one that the disc has."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.scene import MoverConfig, RigConfig, SceneConfig, ground_truth

UNEVEN = RigConfig(omega_rad_s=3.0, ripple=0.2, ripple_hz=3.0, ramp_rad_s2=1.5)


@pytest.mark.parametrize("rig", [RigConfig(), UNEVEN, RigConfig(omega_rad_s=0.0, ramp_rad_s2=2.0)])
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
