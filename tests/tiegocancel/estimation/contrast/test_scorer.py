"""Check the twist's algebra and that contrast peaks where the motion is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.contrast.scorer import MAX_CELL_BITS, Contrast, Twist, fine_cell_bits
from tiegocancel.events import Events
from tiegocancel.motion.schedule import rotation_coefficients

STILL = Twist(0.0, 0.0, 0.0)
CENTER, OMEGA = (150.0, 110.0), 5.0


def contrast(events, *, cell_bits=1, signed=True, slots=512, anchor_px=(100.0, 90.0)):
    return Contrast(events, anchor_px=anchor_px, cell_bits=cell_bits, signed=signed, slots=slots)


@given(
    center=st.tuples(st.floats(-2000, 2000), st.floats(-2000, 2000)),
    omega=st.floats(0.01, 200),
    anchor=st.tuples(st.floats(0, 1280), st.floats(0, 720)),
)
def test_twist_and_centre_convert_both_ways(center, omega, anchor):
    assert Twist.about(center, omega, anchor).center_px(anchor) == pytest.approx(center, abs=1e-6)
    assert Twist.about(center, -omega, anchor).center_px(anchor) == pytest.approx(center, abs=1e-6)


def test_twist_is_the_velocity_of_the_anchor():
    assert Twist.about((100, 100), 2.0, (130, 100)) == (0.0, 60.0, 2.0)
    assert Twist.about((100, 100), 2.0, (100, 110)) == (-20.0, 0.0, 2.0)
    assert STILL.center_px((5.0, 6.0)) == (5.0, 6.0)


@given(
    center=st.tuples(st.floats(-500, 800), st.floats(-500, 700)),
    omega=st.floats(-100, 100).filter(lambda value: abs(value) > 0.01),
    anchor=st.tuples(st.floats(0, 320), st.floats(0, 240)),
)
def test_warp_of_a_twist_is_the_rotation_about_its_centre(center, omega, anchor):
    events = Events([0, 49_999], [1, 2], [1, 2], [0, 1], 320, 240)
    scorer = contrast(events, slots=4, anchor_px=anchor)
    mine = scorer._warp([Twist.about(center, omega, anchor)])[0]
    for row, slot_s in zip(mine, (-0.01875, -0.00625, 0.00625, 0.01875), strict=True):
        exact = rotation_coefficients(center[0], center[1], omega, -round(slot_s * 1e6))
        assert np.abs(row - exact).max() <= 1


def test_warp_of_a_translation_is_the_limit_of_small_rotations():
    events = Events([0, 49_999], [1, 2], [1, 2], [0, 1], 320, 240)
    scorer = contrast(events, slots=8)
    straight = scorer._warp([Twist(400.0, -300.0, 0.0)])[0]
    assert np.abs(straight - scorer._warp([Twist(400.0, -300.0, 1e-7)])[0]).max() <= 1
    assert straight[0, 2] == np.floor(400.0 * 0.021875 * 65536 + 0.5)


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize("cell_bits", [0, 1, 2])
def test_true_motion_gains_most_and_the_reverse_least(turning, signed, cell_bits):
    scorer = contrast(turning(CENTER, OMEGA), cell_bits=cell_bits, signed=signed)
    names = ("true", "still", "reverse", "faster", "beside")
    centers = [CENTER, CENTER, CENTER, CENTER, (180.0, 110.0)]
    twists = [
        Twist.about(center, omega, scorer.anchor_px)
        for center, omega in zip(centers, (OMEGA, 0.0, -OMEGA, 1.2 * OMEGA, OMEGA), strict=True)
    ]
    gain = dict(zip(names, scorer.gain(twists).tolist(), strict=True))
    assert gain["still"] == 1.0
    assert gain["true"] > max(gain["faster"], gain["beside"]) > 1.0 > gain["reverse"]


def test_events_thrown_out_of_the_image_do_not_raise_the_score(turning):
    scorer = contrast(turning(CENTER, OMEGA))
    assert scorer.gain([Twist(1e6, 0.0, 0.0)])[0] < 0.1


def test_scores_of_many_twists_equal_those_of_one_at_a_time(turning):
    scorer = contrast(turning(count=3000))
    twists = [Twist.about(CENTER, 0.2 * k, scorer.anchor_px) for k in range(75)]
    assert scorer.variance(twists).tolist() == [float(scorer.variance([twist])[0]) for twist in twists]
    assert len(scorer.variance([])) == 0


def test_times_far_from_zero_change_nothing(turning):
    near, far = contrast(turning(count=3000)), contrast(turning(count=3000, start_us=1 << 59))
    twists = [Twist.about(CENTER, OMEGA, near.anchor_px), STILL]
    assert near.variance(twists).tolist() == far.variance(twists).tolist()


@pytest.mark.parametrize(("side", "bits"), [(1, 1), (128, 1), (1280, 1), (2048, 1), (2049, 2), (8192, 3), (65536, 6)])
def test_cells_grow_on_very_wide_sensors(side, bits):
    assert fine_cell_bits(Events.empty(side, 1)) == bits <= MAX_CELL_BITS
