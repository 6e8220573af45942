"""Check places, times and units of a prepared window, and that its slopes and sharpness tell moving from resting."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.estimation.contrast.ascent import rates_of
from tiegocancel.estimation.contrast.scorer import Twist
from tiegocancel.estimation.contrast.window import Scratch, Window, unfolded
from tiegocancel.events import Events
from tiegocancel.motion.schedule import rotation_coefficients

CENTER, OMEGA = (150.0, 110.0), 5.0
ANCHOR = (160.0, 120.0)
STILL = rates_of(Twist(0.0, 0.0, 0.0))
TRUE = rates_of(Twist.about(CENTER, OMEGA, ANCHOR))


def window_of(events, **change):
    settings_ = {"start_us": 0, "stop_us": 50_000, "anchor_px": ANCHOR} | change
    return Window(events, **settings_)


def total(window, rates, cell_px=2.0):
    slopes = window.slopes(rates, cell_px)
    return slopes.events.sum(), slopes.energy.sum(), slopes.slope.sum(axis=0), slopes.curvature.sum(axis=0)


def test_radius_is_the_typical_distance_from_the_anchor_and_at_least_1():
    events = Events([0, 1, 2], [163, 157, 160], [124, 116, 125], [1, 1, 0], 320, 240)
    assert window_of(events).radius_px == pytest.approx(5.0)
    alone = Events([0], [160], [120], [1], 320, 240)
    assert window_of(alone).radius_px == 1.0


def test_units_are_one_px_a_half_window_at_the_radius(turning):
    window = window_of(turning())
    assert window.half_s == pytest.approx(0.025)
    assert window.units[[2, 5]] == pytest.approx([40.0, 40.0])
    assert window.units[[0, 1, 3, 4]] * window.radius_px == pytest.approx([40.0] * 4)


def test_middle_is_that_of_the_window_and_exact_at_any_time():
    far = (1 << 60) - 100
    assert window_of(Events([far], [1], [1], [1], 8, 8), start_us=far, stop_us=far + 100).middle_us == far + 50


@given(
    center=st.tuples(st.floats(-300, 600), st.floats(-300, 500)),
    omega=st.floats(-60, 60),
    anchor=st.tuples(st.floats(0, 320), st.floats(0, 240)),
)
@settings(max_examples=50, deadline=None)
def test_warp_of_a_rotation_is_the_rotation_about_its_centre(center, omega, anchor):
    events = Events([0, 49_999], [1, 300], [1, 200], [0, 1], 320, 240)
    window = window_of(events, anchor_px=anchor, slots=4)
    table = window._warp(rates_of(Twist.about(center, omega, anchor))).astype(np.float64)
    for row, slot_s in zip(table, (-0.01875, -0.00625, 0.00625, 0.01875), strict=True):
        for share, (a, b, c, d, e, f) in zip((1.0, 0.5), row.reshape(2, 6), strict=True):
            exact = rotation_coefficients(*center, omega, -round(share * slot_s * 1e6)) / 65536.0
            x, y = 40.0, -30.0  # from the anchor
            sensor_x, sensor_y = x + anchor[0], y + anchor[1]
            ahead = (
                sensor_x + exact[0] * sensor_x + exact[1] * sensor_y + exact[2] - anchor[0],
                sensor_y + exact[3] * sensor_x + exact[4] * sensor_y + exact[5] - anchor[1],
            )
            assert (a * x + b * y + c, d * x + e * y + f) == pytest.approx(ahead, abs=0.03)


def test_energy_is_highest_at_the_true_motion_and_its_slope_is_nil_there(turning):
    window = window_of(turning(CENTER, OMEGA, noise=0.0))
    _, at_truth, slope, curvature = total(window, TRUE)
    for other in (STILL, 1.05 * TRUE, 0.95 * TRUE, rates_of(Twist.about((155, 110), OMEGA, ANCHOR))):
        assert total(window, other)[1] < at_truth
    assert (np.linalg.eigvalsh(curvature) < 0.0).all()
    step = np.linalg.solve(curvature, slope)
    assert np.abs(step).max() < 0.1  # px a half window


def test_slopes_point_to_the_true_motion(turning):
    window = window_of(turning(CENTER, OMEGA))
    for factor in (0.97, 1.03):
        twist = Twist.about(CENTER, factor * OMEGA, ANCHOR)
        slope = total(window, rates_of(twist))[2]
        toward = (TRUE - rates_of(twist)) / window.units
        assert slope @ toward > 0.0


def test_sharpness_rises_above_1_and_halves_agree_at_the_true_motion_only(turning):
    window = window_of(turning(CENTER, OMEGA))
    window.slopes(TRUE, 2.0)
    gain, correlation = window.sharpness()
    assert gain > 1.5
    assert correlation > 0.7
    window.slopes(STILL, 2.0)
    gain, correlation = window.sharpness()
    assert gain == pytest.approx(1.0, rel=1e-3)
    assert correlation < 0.3


def test_places_that_fire_all_the_time_agree_at_rest():
    rng = np.random.default_rng(1)
    place = rng.integers(0, 60, 5000)
    t = np.sort(rng.integers(0, 50_000, 5000))
    window = window_of(Events(t, place * 37 % 300, place * 53 % 200, place % 2, 320, 240))
    window.slopes(STILL, 2.0)
    assert window.sharpness() == (pytest.approx(1.0, rel=1e-3), pytest.approx(1.0, abs=0.02))


@pytest.mark.parametrize("density", [500, 20_000, 200_000])
@pytest.mark.parametrize("polarity", ["both", "one"])
def test_noise_does_not_agree_at_any_density_or_polarity(density, polarity):
    rng = np.random.default_rng(2)
    p = rng.integers(0, 2, density) if polarity == "both" else np.ones(density, np.int64)
    t = np.sort(rng.integers(0, 50_000, density))
    window = window_of(Events(t, rng.integers(0, 320, density), rng.integers(0, 240, density), p, 320, 240))
    window.slopes(STILL, 2.0)
    assert window.sharpness()[1] < 0.3  # what is left is the sensor's border, which does not move


def test_unsigned_windows_take_polarity_for_nothing(turning):
    events = turning(count=3000)
    flipped = Events(events.t, events.x, events.y, 1 - events.p, 320, 240)
    one, other = (total(window_of(part, signed=False), TRUE) for part in (events, flipped))
    assert one[1] == other[1]


def test_one_event_and_events_of_one_half_have_no_energy():
    for t in ([10], [10, 20], [49_000]):
        window = window_of(Events(t, [100] * len(t), [90] * len(t), [1] * len(t), 320, 240))
        count, energy, slope, curvature = total(window, TRUE)
        assert count == len(t)
        assert energy == 0.0
        assert not slope.any()
        assert not curvature.any()
        assert window.sharpness()[1] == 0.0


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_far_rates_leave_no_tiles_or_finite_ones_only(turning):
    window = window_of(turning(count=500))
    for rates in (1e9 * TRUE, 1e5 * TRUE, 1e9 * rates_of(Twist(1.0, 0.0, 0.0)), rates_of(Twist(0.0, 0.0, 1e6))):
        slopes = window.slopes(rates, 2.0)
        for column in (slopes.events, slopes.energy, slopes.slope, slopes.curvature, slopes.spread):
            assert np.isfinite(column).all()
        assert np.isfinite(window.sharpness()).all()
        assert not window.within(np.zeros(0, np.int64)).any()


def test_scratch_may_be_shared_and_changes_no_bit(turning):
    scratch = Scratch()
    small, large = turning(count=400, reach=-0.3), turning(count=4000, seed=2)
    alone = [window_of(part).slopes(TRUE, 2.0).slope.tobytes() for part in (large, small, large)]
    shared = [window_of(part, scratch=scratch).slopes(TRUE, 2.0).slope.tobytes() for part in (large, small, large)]
    assert alone == shared


def test_the_same_stream_at_another_time_gives_the_same_bits(turning):
    near, shift = turning(count=2000), (1 << 60) - 60_000
    far = Events(near.t + shift, near.x, near.y, near.p, 320, 240)
    windows = (window_of(near), window_of(far, start_us=shift, stop_us=shift + 50_000))
    assert len({window.slopes(TRUE, 2.0).slope.tobytes() for window in windows}) == 1


def test_events_outside_of_the_window_are_refused():
    with pytest.raises(ValueError, match="slot must be"):
        window_of(Events([50_000], [1], [1], [1], 320, 240)).slopes(STILL, 2.0)
    with pytest.raises(ValueError, match="slot must be"):
        window_of(Events([-1], [1], [1], [1], 320, 240)).slopes(STILL, 2.0)


def test_widest_sensor_stays_within_the_memory_of_an_image():
    events = Events([0, 49_999], [0, 65_535], [0, 65_535], [1, 0], 65_536, 65_536)
    window = window_of(events, anchor_px=(32_768.0, 32_768.0))
    assert total(window, STILL)[0] == 2
    assert window._image.size <= 6 * 1.2 * (1 << 22)


def test_tiles_of_a_slope_find_their_events_again(turning):
    events = turning(CENTER, OMEGA, count=4000)
    window = window_of(events)
    slopes = window.slopes(TRUE, 2.0)
    assert slopes.events.sum() == len(events)
    some = slopes.tile[::3]
    assert abs(window.within(some).sum() - slopes.events[::3].sum()) <= 2  # one on a border may fall to either side
    assert window.within(slopes.tile).sum() >= len(events) - 2


def test_sums_of_folded_matrices_unfold_to_the_sums_of_the_tiles(turning):
    slopes = window_of(turning()).slopes(TRUE, 2.0)
    weight = np.linspace(0.1, 1.0, len(slopes.tile))
    curvature = slopes.curvature
    assert unfolded(weight @ slopes.bends) == pytest.approx(np.tensordot(weight, curvature, 1), rel=1e-9)
    assert unfolded(weight @ slopes.squares) == pytest.approx(np.tensordot(weight, slopes.spread, 1), rel=1e-9)
    assert np.array_equal(curvature, np.swapaxes(curvature, 1, 2))
    for column, (one, other) in zip(slopes.pan_curvature, ((2, 2), (2, 5), (5, 5)), strict=True):
        assert np.array_equal(column, curvature[:, one, other])
