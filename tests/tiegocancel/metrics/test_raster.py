"""Signed images hold what was put into them, at sub-pixel places too."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.metrics.raster import gradient_energy, raster, variance

WIDTH, HEIGHT = 9, 7


@given(
    rows=st.lists(
        st.tuples(st.floats(-3, WIDTH + 2), st.floats(-3, HEIGHT + 2), st.sampled_from([-1, 1])), max_size=20
    ),
    nearest=st.booleans(),
)
def test_an_image_equals_the_sum_of_its_events(rows: list[tuple[float, float, int]], nearest: bool) -> None:
    wanted = np.zeros((HEIGHT, WIDTH))
    for x, y, weight in rows:
        x, y = (np.floor(value * 256 + 0.5) / 256 for value in (x, y))
        for column in range(WIDTH):
            for row in range(HEIGHT):
                if nearest:
                    wanted[row, column] += weight * (np.floor(x + 0.5) == column and np.floor(y + 0.5) == row)
                else:
                    wanted[row, column] += weight * max(0, 1 - abs(x - column)) * max(0, 1 - abs(y - row))
    x, y, weight = (list(column) for column in zip(*rows, strict=True)) if rows else ([], [], [])
    np.testing.assert_allclose(raster(x, y, weight, width=WIDTH, height=HEIGHT, nearest=nearest), wanted, atol=1e-12)


def test_an_event_and_its_anti_event_at_one_place_leave_nothing() -> None:
    places = np.array([2.3, 2.3]), np.array([4.8, 4.8])
    assert not raster(*places, [1, -1], width=WIDTH, height=HEIGHT).any()


def test_half_a_pixel_apart_they_leave_half_of_each() -> None:
    left = raster([3.0, 3.5], [3.0, 3.0], [1, -1], width=WIDTH, height=HEIGHT)
    assert np.abs(left).sum() == pytest.approx(1.0)


def test_a_blurred_image_is_less_sharp_by_either_objective() -> None:
    rng = np.random.default_rng(0)
    sharp = np.zeros((40, 40))
    sharp[:, 20] = 10.0
    blurred = sum(np.roll(sharp, shift, axis=1) for shift in range(-2, 3)) / 5
    for measure in (variance, gradient_energy):
        assert measure(sharp) > 2 * measure(blurred) > 0
        assert measure(np.full((8, 8), rng.random())) == pytest.approx(0.0, abs=1e-12)
