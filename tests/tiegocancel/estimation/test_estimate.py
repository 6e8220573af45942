"""Estimates become a causal trajectory; what they do not know is left out and told."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.estimation.estimate import MotionEstimate, trajectory_of

FINITE = st.floats(-1e4, 1e4, allow_subnormal=False)


@given(
    times=st.lists(st.integers(-(10**12), 10**12), min_size=1, max_size=20, unique=True).map(sorted),
    data=st.data(),
)
def test_every_row_with_a_centre_holds_from_its_own_time_on(times: list[int], data: st.DataObject) -> None:
    rows = [
        MotionEstimate(
            t_us=t,
            center_px=data.draw(st.tuples(FINITE, FINITE) | st.just((math.nan, math.nan))),
            omega_rad_s=data.draw(FINITE),
            omega_dot_rad_s2=data.draw(FINITE),
        )
        for t in times
    ]
    known = [row for row in rows if row.has_center]
    if not known:
        with pytest.raises(ValueError, match="knows a centre"):
            trajectory_of(rows, source="s")
        return
    motion = trajectory_of(rows, source="s")
    assert motion.interpolation == "causal"
    assert motion.t_us.tolist() == [row.t_us for row in known]
    cx, cy, omega = motion.at(motion.t_us)
    assert [*zip(cx.tolist(), cy.tolist(), omega.tolist(), strict=True)] == [
        (*row.center_px, row.omega_rad_s) for row in known
    ]
    assert len(motion.notes) == (len(known) < len(rows))


def test_a_row_is_carried_on_until_the_next_and_never_sees_it() -> None:
    rows = [
        MotionEstimate(t_us=0, center_px=(1.0, 2.0), omega_rad_s=1.0, omega_dot_rad_s2=100.0),
        MotionEstimate(t_us=10_000, center_px=(3.0, 4.0), omega_rad_s=-5.0),
    ]
    cx, _, omega = trajectory_of(rows, source="s").at(np.array([5_000, 9_999, 10_000]))
    assert cx.tolist() == [1.0, 1.0, 3.0]
    assert omega == pytest.approx([1.5, 1.9999, -5.0])
    alone = trajectory_of(rows[:1], source="s").at(np.array([5_000, 9_999]))[2]
    assert alone.tolist() == omega[:2].tolist()


def test_doubtful_rows_are_kept_and_counted() -> None:
    rows = [
        MotionEstimate(t_us=t, center_px=(1.0, 2.0), omega_rad_s=1.0, confident=t > 0, doubt="dark") for t in range(3)
    ]
    motion = trajectory_of(rows, source="s")
    assert len(motion) == 3
    assert motion.notes == ("1 of 3 estimates are marked doubtful",)


@pytest.mark.parametrize("center", [(math.nan, 1.0), (1.0, math.inf)])
def test_half_a_centre_is_none(center: tuple[float, float]) -> None:
    assert not MotionEstimate(t_us=0, center_px=center, omega_rad_s=0.0).has_center
