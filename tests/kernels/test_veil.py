"""Check where a mover is drawn, and how much of the background it lets through."""

from __future__ import annotations

import numpy as np
import pytest
from tiegocancel.kernels.veil import veil

SIDE = 21
EVERYWHERE = np.arange(SIDE * SIDE, dtype=np.int32)


def drawn(*, corner_px=(4.0, 6.0), angle_rad=None, gain=0.0, rows=EVERYWHERE, change=None):
    """Draw a square of 3.0, 7 × 7 samples with a border of cover 0, before a background of −2; one step."""
    rows = np.asarray(rows, np.int32)
    levels = np.full((SIDE * SIDE, 1), -2.0, np.float32)
    clear = np.ones((len(rows), 1), np.float32)
    turn = None if angle_rad is None else np.array([[np.cos(angle_rad), np.sin(angle_rad)]], np.float32)
    arguments = {
        "mover": np.full((7, 7), 3.0, np.float32),
        "mover_cover": np.pad(np.ones((5, 5), np.float32), 1),
        "corner_px": np.array([corner_px], np.float32),
        "turn": turn,
        "gain": np.array([gain], np.float32),
        "width": SIDE,
        "samples_px": 1.0,
        "levels": levels,
        "clear": clear,
        **(change or {}),
    }
    veil(rows, EVERYWHERE, **arguments)
    return levels.reshape(SIDE, SIDE), clear


def test_the_mover_hides_what_is_behind_it_and_says_where():
    image, clear = drawn()
    rows, columns = np.nonzero(clear.reshape(SIDE, SIDE) < 1.0)
    # Cover is 0 on the border samples at 4 and 10 px, so the pixels from 5 to 9 are hidden and no others.
    assert (columns.min(), columns.max(), rows.min(), rows.max()) == (5, 9, 7, 11)
    hidden = clear.reshape(SIDE, SIDE) == 0.0
    assert hidden.sum() == 25
    assert (image[hidden] == 3.0).all()
    assert (image[~hidden] == -2.0).all()


def test_a_pixel_that_is_covered_by_half_is_mixed():
    image, clear = drawn(corner_px=(4.5, 6.0))
    # Between the border sample (cover 0) at 4.5 px and the next (cover 1) at 5.5 px.
    assert image[9, 5] == pytest.approx(-2.0 + 0.5 * 5.0)
    assert clear.reshape(SIDE, SIDE)[9, 5] == pytest.approx(0.5)
    assert clear.reshape(SIDE, SIDE)[9, 4] == 1.0


def test_two_movers_let_through_what_both_do():
    levels, clear = np.full((SIDE * SIDE, 1), -2.0, np.float32), np.ones((SIDE * SIDE, 1), np.float32)
    for _ in range(2):
        drawn(corner_px=(4.5, 6.0), change={"levels": levels, "clear": clear})
    pixel = 9 * SIDE + 5
    assert clear[pixel, 0] == pytest.approx(0.25)
    assert levels[pixel, 0] == pytest.approx(0.25 * -2.0 + 0.75 * 3.0)


def test_a_mover_partly_outside_the_sensor_is_cut_off():
    _, clear = drawn(corner_px=(-3.0, -3.0))
    assert (clear.reshape(SIDE, SIDE)[:3, :3] == 0.0).all()
    assert np.count_nonzero(clear < 1.0) == 9


def test_the_light_falls_on_the_mover_too():
    image, _ = drawn(gain=-0.5)
    assert image[9, 7] == pytest.approx(2.5)
    assert image[0, 0] == -2.0


def test_a_positive_angle_turns_the_picture_from_x_towards_y():
    mark = np.full((7, 7), 3.0, np.float32)
    mark[3, 5] = 9.0  # right of the middle
    upright, _ = drawn(change={"mover": mark})
    turned, _ = drawn(angle_rad=np.pi / 2, change={"mover": mark})
    assert np.unravel_index(upright.argmax(), upright.shape) == (9, 9)
    assert np.unravel_index(turned.argmax(), turned.shape) == (11, 7)
    same, _ = drawn(angle_rad=0.0, change={"mover": mark})
    np.testing.assert_allclose(same, upright, atol=1e-5)


def test_rows_that_are_not_listed_are_left_alone():
    image, clear = drawn(rows=[9 * SIDE + 7, 0])
    assert np.count_nonzero(image != -2.0) == 1
    assert clear[:, 0].tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"levels": np.empty((3, 1), np.float32)}, "levels"),
        ({"clear": np.ones((3, 1), np.float32)}, "must agree"),
        ({"gain": np.zeros(2, np.float32)}, "must agree"),
        ({"corner_px": np.zeros((2, 2), np.float32)}, "corner_px must be of shape"),
        ({"turn": np.zeros((1, 3), np.float32)}, "turn must be of shape"),
        ({"mover_cover": np.zeros((2, 2), np.float32)}, "must have one shape"),
    ],
)
def test_shapes_that_differ_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        drawn(change=change)


def test_a_row_that_does_not_exist_is_refused():
    with pytest.raises(ValueError, match="rows must be from 0 to 440, not 3 to 441"):
        drawn(rows=[3, SIDE * SIDE])
