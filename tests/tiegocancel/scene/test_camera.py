"""Check the simulated camera: order, labels, repeatability, rates and the pixel's dead time."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from tiegocancel.events import EGO, MOVER, NOISE, Events
from tiegocancel.scene import MoverConfig, RigConfig, SceneConfig, SensorConfig, simulate

QUIET = SensorConfig(noise_hz=0.0)


def small(**settings):
    """A scene of 320×180 px, quick to simulate."""
    return SceneConfig(width=320, height=180, **settings)


def recorded(config, duration_s=0.05, **options):
    parts = [Events.empty(config.width, config.height, labelled=True)]
    return Events.concatenate([*parts, *simulate(config, duration_s=duration_s, **options)])


def columns(events):
    return np.stack([events.t, events.x, events.y, events.p, events.label]).astype(np.int64)


def test_chunks_are_sorted_labelled_and_in_sequence():
    chunks = list(simulate(small(), duration_s=0.08, seed=3, start_us=1 << 40))
    assert len(chunks) > 2
    rows = np.concatenate([columns(chunk) for chunk in chunks], axis=1)
    t, x, y, p, label = rows
    assert (np.lexsort((label, p, x, y, t)) == np.arange(len(t))).all()
    assert t[0] >= 1 << 40
    assert t[-1] < (1 << 40) + 80_000
    assert t[-1] > (1 << 40) + 79_000
    assert set(label) == {EGO, MOVER, NOISE}


def test_one_seed_gives_one_recording_and_another_seed_another():
    first, again, other = (columns(recorded(small(), seed=seed)) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape or (first != other).any()


def test_a_longer_recording_begins_with_the_shorter_one():
    long = recorded(small(), 0.09, seed=1)
    for duration_s in (0.0004, 0.0301, 0.0632):
        short = recorded(small(), duration_s, seed=1)
        np.testing.assert_array_equal(columns(short), columns(long.between(0, round(duration_s * 1e6))))


def test_a_longer_recording_of_a_ramp_begins_with_the_shorter_one():
    ramped = small(rig=RigConfig(omega_rad_s=2.0, ramp_rad_s2=100.0))
    long = recorded(ramped, 0.2, seed=1)
    assert ramped.step_us(0.15) < ramped.step_us(0.05) < ramped.step_us(0.0)
    for duration_s in (0.07, 0.131):
        short = recorded(ramped, duration_s, seed=1)
        np.testing.assert_array_equal(columns(short), columns(long.between(0, round(duration_s * 1e6))))


def test_a_change_of_step_neither_loses_nor_repeats_events():
    # The same light, once in coarse steps that change and once in fine ones that stay.
    rig = RigConfig(omega_rad_s=2.0, ramp_rad_s2=100.0)
    sensor = SensorConfig(jitter_us=0.0, noise_hz=0.0)
    coarse, fine = (recorded(small(rig=rig, sensor=sensor, step_px=step_px), 0.2) for step_px in (0.5, 0.05))
    assert len(coarse) == pytest.approx(len(fine), rel=0.02)
    for events in (coarse, fine):
        pixel = events.y.astype(int) * 320 + events.x
        order = np.argsort(pixel, kind="stable")
        gap = np.diff(events.t[order])[np.diff(pixel[order]) == 0]
        assert gap.min() > sensor.refractory_us - 1.0


def test_the_start_time_only_shifts_the_stamps():
    plain, shifted = recorded(small(), 0.02), recorded(small(), 0.02, start_us=-7_000_000)
    np.testing.assert_array_equal(plain.t - 7_000_000, shifted.t)
    np.testing.assert_array_equal(columns(plain)[1:], columns(shifted)[1:])


def test_the_number_of_threads_changes_nothing():
    program = (
        "import hashlib; from tiegocancel.scene import SceneConfig, simulate; digest = hashlib.sha256()\n"
        "for c in simulate(SceneConfig(width=320, height=180), duration_s=0.04, seed=9):\n"
        "    [digest.update(column.tobytes()) for column in (c.t, c.x, c.y, c.p, c.label)]\n"
        "print(digest.hexdigest())"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "TIEGOCANCEL_THREADS": threads},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for threads in ("1", "2", "3")
    }
    assert len(digests) == 1


def test_a_still_scene_without_noise_is_silent():
    still = small(rig=RigConfig(omega_rad_s=0.0), mover=MoverConfig(speed_px_s=0.0), sensor=QUIET)
    assert len(recorded(still, 0.3)) == 0


def test_a_disc_alone_makes_ego_events_on_the_disc_only():
    config = small(mover=MoverConfig(enabled=False), sensor=QUIET)
    events = recorded(config)
    assert len(events) > 1000
    assert set(events.label.tolist()) == {EGO}
    away = np.hypot(events.x - config.rig.center_px[0], events.y - config.rig.center_px[1])
    assert away.max() <= config.rig.radius_px + 0.5


def test_a_mover_before_a_still_disc_makes_mover_events_only():
    events = recorded(small(rig=RigConfig(omega_rad_s=0.0), sensor=QUIET), 0.2)
    assert len(events) > 1000
    assert set(events.label.tolist()) == {MOVER}


def test_a_hand_at_rest_before_a_turning_disc_causes_nothing_not_even_at_its_rim():
    config = small(mover=MoverConfig(speed_px_s=0.0, phase_rad=1.0), sensor=QUIET)
    events = recorded(config, 0.2)
    assert set(events.label.tolist()) == {EGO}
    # The hand does hide a part of the disc: the events are fewer than without it.
    alone = recorded(small(mover=MoverConfig(enabled=False), sensor=QUIET), 0.2)
    assert len(events) < 0.98 * len(alone)


def test_mover_labels_end_with_the_pixels_that_it_reaches():
    config = small(sensor=QUIET)
    events = recorded(config, 0.1)
    mine = events.select(events.label == MOVER)
    centers = config.mover.center_at(mine.t * 1e-6)
    away = np.maximum(np.abs(mine.x - centers[:, 0]), np.abs(mine.y - centers[:, 1]))
    assert len(mine) > 100
    assert away.max() < 0.62 * config.mover.size_px + 6.0


def test_without_the_mover_the_disc_fires_the_same_where_the_mover_never_was():
    with_mover = recorded(small(sensor=QUIET), 0.05)
    without = recorded(small(sensor=QUIET, mover=MoverConfig(enabled=False)), 0.05)
    mine = with_mover.select(with_mover.label == MOVER)
    touched = np.zeros((180, 320), bool)
    touched[max(mine.y.min() - 3, 0) : mine.y.max() + 4, max(mine.x.min() - 3, 0) : mine.x.max() + 4] = True
    one, other = (columns(e.select(~touched[e.y, e.x])) for e in (with_mover, without))
    assert one.shape[1] > 1000
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("refractory_us", [0.0, 2000.0])
def test_no_pixel_fires_within_its_refractory_period(refractory_us):
    sensor = SensorConfig(
        threshold_on=0.05, threshold_off=0.05, refractory_us=refractory_us, jitter_us=0.0, noise_hz=0.0
    )
    events = recorded(small(sensor=sensor))
    pixel = events.y.astype(int) * 320 + events.x
    order = np.argsort(pixel, kind="stable")
    gap = np.diff(events.t[order])[np.diff(pixel[order]) == 0]
    assert len(gap) > 1000
    # Stamps are cut to whole microseconds, which can shorten a gap by less than one.
    assert gap.min() > refractory_us - 1.0 if refractory_us else gap.min() < 500


def test_a_higher_off_threshold_makes_fewer_off_events():
    shares = [
        recorded(small(sensor=SensorConfig(threshold_on=0.12, threshold_off=off, noise_hz=0.0))).p.mean()
        for off in (0.12, 0.18)
    ]
    assert shares[1] > shares[0] + 0.05


def test_jitter_moves_stamps_by_its_deviation_at_most_its_bound():
    exact, moved = (
        recorded(small(sensor=SensorConfig(jitter_us=jitter_us, noise_hz=0.0))) for jitter_us in (0.0, 40.0)
    )
    # The first event of a pixel stays the first one: jitter is far below the time between two events.
    firsts = []
    for events in (exact, moved):
        pixel, row = np.unique(events.y.astype(int) * 320 + events.x, return_index=True)
        firsts.append(dict(zip(pixel.tolist(), events.t[row].tolist(), strict=True)))
    shift = np.array([firsts[1][pixel] - t for pixel, t in firsts[0].items() if pixel in firsts[1] and t > 1000])
    assert shift.std() == pytest.approx(40.0, rel=0.15)
    assert np.abs(shift).max() <= 2 * np.sqrt(3.0) * 40.0 + 1


def test_noise_has_the_rate_and_the_polarity_it_is_given():
    sensor = SensorConfig(noise_hz=20.0, noise_on_share=0.8)
    still = small(rig=RigConfig(omega_rad_s=0.0), mover=MoverConfig(enabled=False), sensor=sensor)
    events = recorded(still, 0.1)
    assert set(events.label.tolist()) == {NOISE}
    expected = 20.0 * 0.1 * 320 * 180
    assert abs(len(events) - expected) < 5 * np.sqrt(expected)
    assert events.p.mean() == pytest.approx(0.8, abs=0.01)


def test_noise_never_repeats_itself():
    sensor = SensorConfig(noise_hz=20.0)
    still = small(rig=RigConfig(omega_rad_s=0.0), mover=MoverConfig(enabled=False), sensor=sensor)
    events = recorded(still, 0.1)
    block_us = 25_000
    inside = np.stack([events.t % block_us, events.x, events.y], axis=1)
    assert len(np.unique(inside, axis=0)) > 0.99 * len(inside)


def test_hot_pixels_fire_again_and_again():
    sensor = SensorConfig(noise_hz=0.0, hot_pixels=3, hot_hz=2000.0)
    still = small(rig=RigConfig(omega_rad_s=0.0), mover=MoverConfig(enabled=False), sensor=sensor)
    events = recorded(still, 0.1)
    pixels = set(zip(events.x.tolist(), events.y.tolist(), strict=True))
    assert 1 <= len(pixels) <= 3
    assert 400 < len(events) < 800


def test_flicker_makes_the_still_board_fire_at_its_frequency():
    config = small(flicker_depth=0.5, flicker_hz=100.0, mover=MoverConfig(enabled=False), sensor=QUIET)
    events = recorded(config, 0.1)
    board = events.select(events.label == NOISE)
    phase = np.exp(2j * np.pi * 100.0 * board.t[board.p == 1] * 1e-6).mean()
    assert len(board) > 10 * 320 * 180
    assert abs(phase) > 0.3
    assert set(events.label.tolist()) == {EGO, NOISE}


@pytest.mark.parametrize(("width", "height"), [(64, 48), (1, 1), (3, 200), (200, 3)])
def test_small_sensors_work(width, height):
    config = SceneConfig.disc(width=width, height=height)
    events = recorded(config, 0.15)
    assert (events.width, events.height) == (width, height)
    if (width, height) == (64, 48):
        assert set(events.label.tolist()) == {EGO, MOVER, NOISE}


def test_no_time_gives_no_events():
    assert list(simulate(small(), duration_s=0.0)) == []


@pytest.mark.parametrize("duration_s", [-0.1, float("nan"), float("inf")])
def test_a_duration_that_is_none_is_refused(duration_s):
    with pytest.raises(ValueError, match="duration_s must be from 0"):
        simulate(small(), duration_s=duration_s)


def test_a_negative_seed_is_refused():
    with pytest.raises(ValueError, match="seed must be from 0"):
        simulate(small(), duration_s=0.1, seed=-1)
