"""Track rotations causally: any chunking, any pause, any sensor; and doubt what a window cannot tell."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.estimation.contrast.track import RotationTracker, TrackConfig
from tiegocancel.estimation.estimate import trajectory_of
from tiegocancel.events import Events

CENTER, OMEGA = (150.0, 110.0), 5.0
SLOW = pytest.mark.slow


def track(events, cuts=(), **change):
    """Return the rows of a stream that is cut into chunks before these indices."""
    tracker = RotationTracker(TrackConfig(**change), width=events.width, height=events.height)
    edges = [0, *cuts, len(events)]
    return [row for first, last in pairwise(edges) for row in tracker.process(events[first:last])]


def text(rows):
    """Write rows so that equal ones are equal, NaN included."""
    return [repr(row) for row in rows]


def shifted(events, shift_us):
    return Events(events.t + shift_us, events.x, events.y, events.p, events.width, events.height)


def noise(count, *, span_us=100_000, width=320, height=240, polarity=None, seed=0, start_us=0):
    rng = np.random.default_rng(seed)
    p = rng.integers(0, 2, count) if polarity is None else np.full(count, polarity)
    t = np.sort(rng.integers(0, span_us, count)) + start_us
    return Events(t, rng.integers(0, width, count), rng.integers(0, height, count), p, width, height)


def textured(velocity, *, radius_px=6.0, span_us=100_000, count=10_000):
    """Return one small object with a texture that flies straight."""
    rng = np.random.default_rng(3)
    t, point = np.sort(rng.integers(0, span_us, count)), rng.integers(0, 24, count)
    turn, reach = rng.uniform(0, 2 * np.pi, 24), radius_px * np.sqrt(rng.random(24))
    x = 100.0 + (reach * np.cos(turn))[point] + velocity[0] * t * 1e-6
    y = 90.0 + (reach * np.sin(turn))[point] + velocity[1] * t * 1e-6
    return Events(t, np.floor(x + 0.5).astype(int), np.floor(y + 0.5).astype(int), point % 2, 320, 240)


@pytest.fixture(scope="module")
def stream(turning):
    """Motion, a pause of a second, motion again, a gap of 30 ms, and a sparse end."""
    parts = [
        turning(CENTER, OMEGA, span_us=30_000, count=4_500),
        turning(CENTER, OMEGA, span_us=30_000, count=4_500, start_us=1_030_000, seed=8),
        turning(CENTER, OMEGA, span_us=30_000, count=4_000, start_us=1_090_000, seed=9),
        turning(CENTER, OMEGA, span_us=40_000, count=700, start_us=1_125_000, seed=10),
    ]
    return Events.concatenate(parts)


@pytest.fixture(scope="module")
def whole(stream):
    return track(stream)


def test_steady_rotation_is_followed_from_the_first_rows_on(turning):
    rows = track(turning(CENTER, OMEGA, span_us=200_000, count=40_000))
    assert [row.t_us // 10_000 for row in rows] == list(range(1, 20))
    assert all(row.confident and not row.doubt for row in rows)
    late = rows[5:]
    assert [row.omega_rad_s for row in late] == pytest.approx([OMEGA] * len(late), abs=0.08)
    assert np.abs(np.array([row.center_px for row in late]) - CENTER).max() < 1.2
    assert all(row.sharpness > 1.5 for row in late)
    assert all(0 < row.events_used <= row.events_seen for row in late)
    trajectory = trajectory_of(rows, source="track")
    assert trajectory.interpolation == "causal"


def test_sigmas_shrink_and_hold_the_errors(turning):
    rows = track(turning(CENTER, OMEGA, span_us=300_000, count=60_000))
    assert rows[-1].omega_sigma_rad_s < 0.5 * rows[0].omega_sigma_rad_s
    surprise = [((row.omega_rad_s - OMEGA) / row.omega_sigma_rad_s) ** 2 for row in rows[5:]]
    assert np.mean(surprise) < 2.0
    apart = [np.hypot(*np.subtract(row.center_px, CENTER)) / row.center_sigma_px for row in rows[5:]]
    assert np.max(apart) < 3.0


@pytest.mark.parametrize("omega", [0.8, -40.0, pytest.param(-5.0, marks=SLOW), pytest.param(120.0, marks=SLOW)])
def test_slow_fast_and_backward_rotations_are_found(turning, omega):
    rows = track(turning(CENTER, omega, span_us=100_000, count=40_000, points=400))
    assert rows[-1].confident
    assert rows[-1].omega_rad_s == pytest.approx(omega, rel=0.05)
    assert rows[-1].center_px == pytest.approx(CENTER, abs=4.0)


@given(data=st.data())
@settings(max_examples=5, deadline=None)
def test_chunk_borders_change_nothing(stream, whole, data):
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=40)))
    assert text(track(stream, cuts)) == text(whole)


def test_chunks_at_pauses_and_of_a_few_events_change_nothing(stream, whole):
    gaps = (np.flatnonzero(np.diff(stream.t) > 1000) + 1).tolist()
    assert len(gaps) >= 3
    for cuts in ([cut for gap in gaps for cut in (gap - 1, gap, gap + 1)], range(97, len(stream), 97)):
        assert text(track(stream, cuts)) == text(whole)


def test_same_seed_gives_the_same_rows_and_another_seed_others(turning):
    events = turning(CENTER, OMEGA, span_us=60_000, count=20_000)
    one, again, other = (track(events, max_events=1_000, seed=seed) for seed in (1, 1, 2))
    assert text(one) == text(again)
    assert text(one) != text(other)


@pytest.mark.parametrize("at_us", [25_000, 65_000, 1_075_000, 1_140_000])
def test_rows_up_to_a_time_do_not_depend_on_what_comes_after(stream, whole, turning, at_us):
    before = stream.between(0, at_us)
    later = [turning((40.0, 200.0), -9.0, span_us=30_000, count=6_000, start_us=at_us + delay, seed=4)
             for delay in (0, 2_000_000)]  # fmt: skip
    expected = text(row for row in whole if row.t_us <= at_us)
    for after in later:
        rows = track(Events.concatenate([before, after]))
        assert text(row for row in rows if row.t_us <= at_us) == expected
    assert text(track(before)) == expected[: len(track(before))]


def test_rows_use_events_before_their_own_time_only(turning):
    events = turning(CENTER, OMEGA, span_us=60_000, count=9_000)
    for row in track(events)[1:]:
        assert row.events_seen <= len(events.between(row.t_us - 80_000, row.t_us))


@pytest.mark.parametrize("pause_us", [25_000, 10**9, 1 << 58])
def test_pause_gives_one_row_that_says_so_and_no_flood(turning, pause_us):
    first = turning(CENTER, OMEGA, span_us=60_000, count=9_000)
    second = turning(CENTER, OMEGA, span_us=60_000, count=9_000, start_us=60_000 + pause_us, seed=8)
    rows = track(Events.concatenate([first, second]))
    silent = [row for row in rows if "no event for" in row.doubt]
    assert len(silent) == 1
    assert not silent[0].confident
    assert silent[0].events_seen == 0
    assert len(rows) <= 16
    assert all(later.t_us > earlier.t_us for earlier, later in pairwise(rows))
    # What comes after the pause is followed as soon as there is enough of it.
    again = [row for row in rows if row.t_us > 60_000 + pause_us]
    assert [row.omega_rad_s for row in again[2:]] == pytest.approx([OMEGA] * len(again[2:]), abs=0.1)
    assert all(row.confident for row in again[2:])


def test_pause_is_not_taken_for_rest(turning):
    first = turning(CENTER, OMEGA, span_us=60_000, count=9_000)
    second = turning(CENTER, OMEGA, span_us=80_000, count=3_500, start_us=1_000_000, seed=8)
    rows = track(Events.concatenate([first, second]))
    assert not any("at rest" in row.doubt for row in rows)


def test_stop_is_told_and_the_motion_is_found_again(turning):
    go = turning(CENTER, OMEGA, span_us=100_000, count=20_000)
    stop = noise(400, span_us=60_000, start_us=100_000)
    again = turning(CENTER, OMEGA, span_us=60_000, count=12_000, start_us=160_000, seed=8)
    rows = track(Events.concatenate([go, stop, again]), fewest_events=100)
    during = [row for row in rows if 130_000 <= row.t_us < 160_000]
    assert not any(row.confident for row in during)
    assert any("at rest" in row.doubt for row in during)
    after = [row for row in rows if row.t_us > 190_000]
    assert all(row.confident for row in after)
    assert [row.omega_rad_s for row in after] == pytest.approx([OMEGA] * len(after), abs=0.3)


def test_jump_of_the_speed_is_followed_within_a_few_rows(turning):
    parts = [turning(CENTER, omega, span_us=100_000, count=20_000, start_us=start_us, seed=seed)
             for omega, start_us, seed in ((5.0, 0, 7), (-8.0, 100_000, 8))]  # fmt: skip
    rows = track(Events.concatenate(parts))
    late = [row for row in rows if row.t_us > 140_000]
    assert [row.omega_rad_s for row in late] == pytest.approx([-8.0] * len(late), abs=0.3)
    assert all(row.confident for row in late)


def test_mover_beside_the_rotation_does_not_pull_it(turning):
    ego = turning(CENTER, OMEGA, span_us=100_000, count=30_000)
    mover = textured((900.0, 500.0), radius_px=8.0, count=2_500)
    events, _ = Events.from_unsorted(
        *(np.append(getattr(ego, name), getattr(mover, name)) for name in ("t", "x", "y", "p")), 320, 240
    )
    rows = track(events)
    assert [row.omega_rad_s for row in rows[3:]] == pytest.approx([OMEGA] * len(rows[3:]), abs=0.1)
    assert np.abs(np.array([row.center_px for row in rows[3:]]) - CENTER).max() < 2.5


@pytest.mark.parametrize(
    ("count", "polarity"),
    [(2_000, None), (10_000, 1), *(pytest.param(100_000, side, marks=SLOW) for side in (None, 0, 1))],
)
def test_noise_alone_gives_no_confident_row(count, polarity):
    rows = track(noise(count, polarity=polarity))
    assert len(rows) == 9
    assert not any(row.confident for row in rows)
    assert not any(row.has_center for row in rows)
    with pytest.raises(ValueError, match="none of 9 estimates knows a centre"):
        trajectory_of(rows, source="track")


def test_too_few_events_say_so():
    rows = track(noise(200))
    assert {row.doubt.split(" ", 2)[0] for row in rows} == {"only"}
    assert not any(row.confident for row in rows)
    assert all(np.isnan(row.sharpness) for row in rows)


def test_single_small_object_leaves_the_centre_open():
    rows = track(textured((400.0, 60.0)))
    followed = [row for row in rows if row.confident]
    assert len(followed) >= 5
    assert all(row.doubt.startswith("the centre is not constrained") for row in followed)
    assert all(row.center_sigma_px > 5.0 for row in followed)
    # All the same the velocity at the object is right, wherever the centre is put.
    last = followed[-1]
    right, down = 100.0 + 400.0 * 0.09 - last.center_px[0], 90.0 + 60.0 * 0.09 - last.center_px[1]
    assert (-last.omega_rad_s * down, last.omega_rad_s * right) == pytest.approx((400.0, 60.0), abs=25.0)


def test_straight_motion_leaves_the_centre_open_and_within_bounds(turning):
    rows = track(turning((150.0, -40_000.0), 0.01, span_us=100_000, count=20_000))
    assert rows[-1].confident
    assert rows[-1].doubt.startswith("the centre is not constrained")
    trajectory = trajectory_of(rows, source="track")
    t = np.array([rows[-1].t_us])
    x, y = trajectory.predict(t, np.array([160], np.uint16), np.array([120], np.uint16), 20_000)
    assert (int(x[0]), int(y[0])) == (pytest.approx(152, abs=1), pytest.approx(120, abs=1))


@pytest.mark.parametrize(
    ("width", "height"), [(8, 8), (2, 1), pytest.param(16, 200, marks=SLOW), pytest.param(1280, 720, marks=SLOW)]
)
def test_any_sensor_is_borne(width, height, turning):
    for events in (
        noise(5_000, width=width, height=height, polarity=0, span_us=40_000),
        turning((0.4 * width, 0.5 * height), OMEGA, width=width, height=height, points=60, span_us=40_000),
    ):
        for row in track(events):
            assert np.isfinite(row.omega_rad_s)
            assert row.t_us <= int(events.t[-1])
            assert not row.confident or row.has_center


def test_small_sensors_are_tracked_and_large_ones(turning):
    for width, height, points, count in ((64, 48, 100, 10_000), (1280, 720, 1500, 40_000)):
        center = (0.47 * width, 0.46 * height)
        rows = track(turning(center, OMEGA, span_us=100_000, count=count, points=points, width=width, height=height))
        assert rows[-1].confident
        assert rows[-1].omega_rad_s == pytest.approx(OMEGA, rel=0.06)
        assert rows[-1].center_px == pytest.approx(center, abs=2.0)


@pytest.mark.parametrize("shift_us", [(1 << 60) - 200_000, -(1 << 60), 1 << 53])
def test_times_far_from_zero_change_no_bit(turning, shift_us):
    near = turning(CENTER, OMEGA, span_us=60_000, count=9_000)
    rows, far = track(near), track(shifted(near, shift_us))
    assert [row.t_us + shift_us for row in rows] == [row.t_us for row in far]
    assert [(row.omega_rad_s, row.center_px, row.omega_sigma_rad_s) for row in rows] == [
        (row.omega_rad_s, row.center_px, row.omega_sigma_rad_s) for row in far
    ]


def test_events_all_at_one_time_say_so():
    count = 5_000
    burst = Events(np.full(count, 77), np.arange(count) % 300, np.arange(count) % 200, np.arange(count) % 2, 320, 240)
    assert track(burst) == []
    rows = track(Events.concatenate([burst, Events([20_000], [5], [5], [1], 320, 240)]))
    assert rows[0].doubt == "all 5000 events are at one time"
    assert not any(row.confident for row in rows)


def test_bursts_at_single_instants_are_no_motion():
    t = np.repeat(np.arange(5) * 10_000, 1000)
    rng = np.random.default_rng(1)
    events = Events(t, rng.integers(0, 320, 5_000), rng.integers(0, 240, 5_000), rng.integers(0, 2, 5_000), 320, 240)
    assert not any(row.confident for row in track(events))


@pytest.mark.parametrize("polarity", [0, 1])
def test_one_polarity_is_enough(turning, polarity):
    both = turning(CENTER, OMEGA, span_us=100_000, count=20_000)
    rows = track(Events(both.t, both.x, both.y, np.full(len(both), polarity), 320, 240))
    assert rows[-1].confident
    assert rows[-1].omega_rad_s == pytest.approx(OMEGA, abs=0.1)
    assert rows[-1].center_px == pytest.approx(CENTER, abs=2.0)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_few_pixels_that_flicker_raise_no_warning_and_no_error():
    for width, pixels in ((320, 1), (2, 2), (320, 3)):
        rng = np.random.default_rng(pixels)
        place = rng.integers(0, pixels, 3_000)
        t = np.sort(rng.integers(0, 30_000, 3_000))
        events = Events(t, place % width, place // width, rng.integers(0, 2, 3_000), width, 240)
        assert all(np.isfinite(row.omega_rad_s) for row in track(events))


def test_nothing_comes_of_nothing():
    tracker = RotationTracker(TrackConfig(), width=320, height=240)
    assert tracker.process(Events.empty(320, 240)) == []
    assert tracker.process(Events([5], [1], [1], [1], 320, 240)) == []
    assert tracker.process(Events.empty(320, 240)) == []


def test_another_sensor_size_is_refused():
    tracker = RotationTracker(TrackConfig(), width=320, height=240)
    with pytest.raises(ValueError, match="events of 240×320 px do not fit a tracker of 320×240 px"):
        tracker.process(Events.empty(240, 320))


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"step_us": 99}, "step_us"),
        ({"step_us": 10_000_001}, "step_us"),
        ({"window_us": 99}, "window_us"),
        ({"window_us": 90_000}, "longest_window_us"),
        ({"longest_window_us": 10_000_001}, "longest_window_us"),
        ({"fewest_events": 99}, "fewest_events"),
        ({"fewest_events": 30_000}, "max_events"),
        ({"max_events": 250_001}, "max_events"),
        ({"max_omega_rad_s": 0.0}, "max_omega_rad_s"),
        ({"max_omega_rad_s": float("nan")}, "max_omega_rad_s"),
        ({"max_omega_rad_s": 1e7}, "max_omega_rad_s"),
        ({"max_center_sigma_px": 0.0}, "max_center_sigma_px"),
        ({"max_center_sigma_px": float("nan")}, "max_center_sigma_px"),
        ({"seed": -1}, "seed"),
    ],
)
def test_settings_out_of_range_are_refused(setting, message):
    with pytest.raises(ValueError, match=message):
        TrackConfig(**setting)


def test_bound_on_omega_is_kept(turning):
    rows = track(turning(CENTER, 20.0, span_us=60_000, count=20_000), max_omega_rad_s=6.0)
    assert not any(row.confident and abs(row.omega_rad_s) > 6.5 for row in rows)


def test_shortest_steps_and_windows_are_borne(turning):
    events = turning(CENTER, 60.0, span_us=6_000, count=8_000)
    rows = track(events, step_us=500, window_us=500, longest_window_us=4_000)
    assert len(rows) == 11
    assert rows[-1].omega_rad_s == pytest.approx(60.0, rel=0.1)


def test_real_disc_with_a_hand_at_the_edge(recording):
    rows = np.load(recording("anu_disc_10ms.npy"))
    x, y, p, t_s, _ = rows[rows[:, 4] == 0].T
    t_us = np.round(t_s.astype(np.float64) * 1e6).astype(np.int64)
    events = Events(t_us, x.astype(np.int64), y.astype(np.int64), p.astype(np.int64), 1280, 720)
    found = track(events, step_us=3_000)
    assert len(found) == 3
    assert found[-1].confident
    assert found[-1].center_px == pytest.approx((664.6, 336.9), abs=3.0)
    assert found[-1].omega_rad_s == pytest.approx(3.61, rel=0.03)
    assert found[1].omega_rad_s == pytest.approx(3.61, rel=0.06)


def test_short_windows_of_a_real_disc_weigh_little(recording):
    """Pixels that have just fired rest, so that 2 ms show a turn too fast by 45 %: the rows that follow forget it."""
    rows = np.load(recording("anu_disc_10ms.npy"))
    x, y, p, t_s, _ = rows[rows[:, 4] == 0].T
    t_us = np.round(t_s.astype(np.float64) * 1e6).astype(np.int64)
    events = Events(t_us, x.astype(np.int64), y.astype(np.int64), p.astype(np.int64), 1280, 720)
    found = track(events, step_us=1_000)
    assert found[1].window[1] > 1.3 * 3.61
    known = [row for row in found if row.has_center]
    assert all(abs(row.omega_rad_s - 3.61) < 2.0 * row.omega_sigma_rad_s for row in known)
    assert found[-1].omega_rad_s == pytest.approx(3.61, abs=0.1)
    assert found[-1].center_px == pytest.approx((665.0, 338.0), abs=4.0)


@pytest.mark.slow
def test_real_spinning_dot(recording):
    from tiegocancel.files import read_events

    found = track(read_events(recording("spinning_dot_evt2.raw")), step_us=3_000)
    assert len(found) == 16
    assert all(row.confident for row in found)
    omega, center = (np.array([getattr(row, name) for row in found]) for name in ("omega_rad_s", "center_px"))
    assert omega == pytest.approx([121.8] * 16, rel=0.025)
    assert np.median(omega) == pytest.approx(121.8, abs=1.0)
    away = np.hypot(*(center - (314.4, 202.5)).T)
    assert away.max() < 4.0
    assert all("few places" in row.doubt for row, far in zip(found, away, strict=True) if far > 3.0)
    assert center.mean(axis=0) == pytest.approx((314.4, 202.5), abs=1.5)
    # Deviations are as large as the errors, neither a third nor thrice.
    share = (omega - 121.8) / [row.omega_sigma_rad_s for row in found]
    assert 1 / 9 < np.mean(share**2) < 9
