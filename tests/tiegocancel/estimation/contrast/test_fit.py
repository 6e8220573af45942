"""Fit rotations to synthetic and real recordings, and doubt what cannot be known."""

from __future__ import annotations

import numpy as np
import pytest

from tiegocancel.errors import ConfigError
from tiegocancel.estimation.contrast.fit import FitConfig, fit_rotation
from tiegocancel.events import Events


def test_rotation_of_a_short_recording(turning):
    fit = fit_rotation(turning((150, 110), -8.0))
    assert fit.omega_rad_s == pytest.approx(-8.0, rel=0.005)
    assert fit.center_px == pytest.approx((150, 110), abs=1)
    assert fit.confident
    assert fit.contrast_gain > 1.5
    assert fit.events_used <= FitConfig().max_events


def test_long_recording_is_fitted_in_windows_that_the_notes_name(turning):
    fit = fit_rotation(turning((150, 110), 3.0, span_us=1_000_000, count=150_000))
    assert fit.omega_rad_s == pytest.approx(3.0, rel=0.01)
    assert fit.confident
    assert fit.notes[0].startswith("5 window(s) of 49.9 ms")
    assert 0 <= fit.window_us[0] < 100_000 < 900_000 < fit.window_us[1] <= 1_000_000


def test_same_events_and_seed_give_the_same_fit(turning):
    events = turning(count=15_000)
    one, other = fit_rotation(events, seed=3), fit_rotation(events, seed=3)
    assert one == other


def test_trajectory_of_a_fit_is_constant_and_named(turning):
    fit = fit_rotation(turning(count=15_000))
    trajectory = fit.trajectory()
    assert trajectory.source == "fit"
    assert trajectory.mean() == (fit.center_px, fit.omega_rad_s)


def test_thinning_is_bounded_and_said(turning):
    fit = fit_rotation(turning(count=20_000), config=FitConfig(max_events=5000))
    assert fit.events_used == 5000
    assert "5000 of their" in fit.notes[0]
    assert fit.omega_rad_s == pytest.approx(5.0, rel=0.02)


ONE_POINT = {"points": 1, "reach": -0.35, "noise": 0.0, "span_us": 20_000}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"omega_rad_s": 0.0}, "contrast hardly rises"),
        ({"noise": 1.0}, "contrast hardly rises"),
        ({"center_px": (150.0, -40_000.0), "omega_rad_s": 0.01}, "far outside the sensor|a translation explains"),
        ({**ONE_POINT, "center_px": (150.0, 60.0), "seed": 0}, "within a few px"),
        ({**ONE_POINT, "center_px": (150.0, -400.0)}, "a translation explains"),
    ],
)
def test_motion_that_cannot_be_known_is_doubted(turning, change, reason):
    fit = fit_rotation(turning(**change))
    assert not fit.confident
    assert any(note.startswith("low confidence") for note in fit.notes)
    assert any(part in " ".join(fit.notes) for part in reason.split("|"))


def test_speed_that_changes_between_windows_is_doubted(turning):
    slow, fast = turning(omega_rad_s=3.0, span_us=50_000), turning(omega_rad_s=9.0, span_us=50_000, start_us=250_000)
    fit = fit_rotation(Events.concatenate([slow, fast]))
    assert any("ω differs between windows" in note for note in fit.notes)
    assert not fit.confident


def few(count, **change):
    columns = {"t": np.arange(count), "x": np.arange(count) % 7, "y": np.arange(count) % 5, "p": np.arange(count) % 2}
    return Events(*({**columns, **change}.values()), 16, 16)


@pytest.mark.parametrize(
    ("events", "message"),
    [
        (Events.empty(16, 16), "0 events are too few"),
        (few(99), "99 events are too few"),
        (few(500, t=np.full(500, 77)), "all 500 events are at 77 µs"),
        (few(500, x=np.full(500, 3), y=np.full(500, 9)), r"pixel \(3, 9\)"),
        (few(500, t=np.arange(500) * 10**9), "no window of 400 ms was found"),
    ],
)
def test_streams_without_motion_in_them_are_refused_in_one_line(events, message):
    with pytest.raises(ConfigError, match=message) as caught:
        fit_rotation(events)
    assert str(caught.value).startswith("--motion fit: ")
    assert "\n" not in str(caught.value)


def test_smallest_sensor_and_fewest_events_do_not_crash():
    t = np.arange(100) * 50
    fit = fit_rotation(Events(t, t // 50 % 2, t * 0, t // 50 % 2, 2, 1))
    assert np.isfinite([*fit.center_px, fit.omega_rad_s, fit.contrast_gain]).all()


def test_a_burst_at_one_instant_inside_a_long_recording_does_not_crash(turning):
    burst = Events(np.full(5000, 500_000), np.arange(5000) % 300, np.arange(5000) % 200, np.arange(5000) % 2, 320, 240)
    early = turning(count=3000)
    assert np.isfinite(fit_rotation(Events.concatenate([early, burst])).omega_rad_s)


@pytest.mark.parametrize(
    "setting",
    [
        {"max_omega_rad_s": 0.0},
        {"max_omega_rad_s": float("nan")},
        {"window_us": 10},
        {"windows": 0},
        {"max_events": 10},
        {"max_events": 1 << 20},
        {"least_gain": 0.5},
    ],
)
def test_settings_out_of_range_are_refused(setting):
    with pytest.raises(ConfigError, match=next(iter(setting))):
        FitConfig(**setting)


def test_real_disc_with_a_hand_at_the_edge(recording):
    rows = np.load(recording("anu_disc_10ms.npy"))
    x, y, p, t_s, _ = rows[rows[:, 4] == 0].T
    t_us = np.round(t_s.astype(np.float64) * 1e6).astype(np.int64)
    events = Events(t_us, x.astype(np.int64), y.astype(np.int64), p.astype(np.int64), 1280, 720)
    fit = fit_rotation(events)
    assert fit.center_px == pytest.approx((665.0, 337.3), abs=3)
    assert 3.55 <= fit.omega_rad_s <= 3.7
    assert fit.confident


def test_real_spinning_dot(recording):
    from tiegocancel.files import read_events

    fit = fit_rotation(read_events(recording("spinning_dot_evt2.raw")))
    assert fit.center_px == pytest.approx((314.4, 202.5), abs=3)
    assert fit.omega_rad_s == pytest.approx(121.8, abs=1.5)
    assert fit.confident


def test_real_hand_held_camera_gets_low_confidence(recording):
    t_s, x, y, p = np.loadtxt(recording("ecd_shapes_rotation.txt")).T
    events = Events(np.round(t_s * 1e6).astype(np.int64), x.astype(int), y.astype(int), p.astype(int), 240, 180)
    fit = fit_rotation(events)
    assert not fit.confident
    assert any("low confidence" in note for note in fit.notes)
