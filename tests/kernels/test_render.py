"""Check where the renderer puts things, and what it calls covered."""

from __future__ import annotations

import numpy as np
import pytest
from tiegocancel.kernels.render import render

SIDE = 21
CENTER = (10.0, 10.0)


def rendered(*, angle_rad=0.0, corner_px=(-100.0, -100.0), dot=(6, 0), gain=0.0, change=None):
    """Render one step of a dark disc of radius 9 px with a bright dot at ``dot`` px from its centre."""
    y, x = np.mgrid[:SIDE, :SIDE]
    disc = np.full((41, 41), -2.0, np.float32)  # two samples a pixel, the centre at sample 20
    row, column = 20 + 2 * dot[1], 20 + 2 * dot[0]
    disc[row - 1 : row + 2, column - 1 : column + 2] = 1.0
    arguments = {
        "board": np.zeros(SIDE * SIDE, np.float32),
        "disc_cover": (np.hypot(x - 10, y - 10) <= 9).astype(np.float32).reshape(-1),
        "disc": disc,
        "mover": np.full((7, 7), 3.0, np.float32),
        "mover_cover": np.pad(np.ones((5, 5), np.float32), 1),
        "turn": np.array([[np.cos(angle_rad), np.sin(angle_rad)]], np.float32),
        "corner_px": np.array([corner_px], np.float32),
        "gain": np.array([gain], np.float32),
        "width": SIDE,
        "center_px": CENTER,
        "samples_px": (2.0, 1.0),
        "levels": np.empty((SIDE * SIDE, 1), np.float32),
        "covered": np.empty((SIDE * SIDE, 1), np.uint8),
        **(change or {}),
    }
    render(np.arange(SIDE * SIDE, dtype=np.int32), **arguments)
    return arguments["levels"].reshape(SIDE, SIDE), arguments["covered"].reshape(SIDE, SIDE)


def test_a_positive_angle_turns_x_towards_y():
    still, _ = rendered(dot=(6, 2))
    turned, _ = rendered(dot=(6, 2), angle_rad=np.pi / 2)
    eighth, _ = rendered(dot=(5, 0), angle_rad=np.arctan2(3.0, 4.0))
    assert np.unravel_index(still.argmax(), still.shape) == (12, 16)
    assert np.unravel_index(turned.argmax(), turned.shape) == (16, 8)
    assert np.unravel_index(eighth.argmax(), eighth.shape) == (13, 14)


def test_the_board_is_seen_beside_the_disc_and_only_there():
    image, covered = rendered()
    assert image[0, 0] == 0.0
    assert image[10, 8] == pytest.approx(-2.0)
    assert covered.max() == 0


def test_the_mover_hides_what_is_behind_it_and_says_where():
    image, covered = rendered(corner_px=(4.0, 6.0))
    rows, columns = np.nonzero(covered)
    # Cover is 0 on the border samples at 4 and 10 px, so the pixels from 5 to 9 are hidden and no others.
    assert (columns.min(), columns.max(), rows.min(), rows.max()) == (5, 9, 7, 11)
    assert (image[covered > 0] == 3.0).all()
    assert (image[covered == 0] < 3.0).all()


def test_a_pixel_that_the_mover_covers_by_half_is_mixed_and_counts_as_covered():
    image, covered = rendered(corner_px=(4.5, 6.0))
    # Between the border sample (cover 0) at 4.5 px and the next (cover 1) at 5.5 px, on a disc of −2.
    assert covered[9, 5] == 1
    assert image[9, 5] == pytest.approx(-2.0 + 0.5 * 5.0)
    assert covered[9, 4] == 0


def test_the_light_scales_everything():
    dim, _ = rendered(gain=-0.5, corner_px=(4.0, 6.0))
    full, _ = rendered(corner_px=(4.0, 6.0))
    np.testing.assert_allclose(dim, full - 0.5, atol=1e-6)


def test_a_mover_partly_outside_the_sensor_is_cut_off():
    image, covered = rendered(corner_px=(-3.0, -3.0))
    assert covered[:3, :3].all()
    assert covered.sum() == 9
    assert image[5, 5] == pytest.approx(-2.0)


def test_shapes_that_differ_are_refused():
    with pytest.raises(ValueError, match="levels"):
        rendered(change={"levels": np.empty((3, 1), np.float32)})
    with pytest.raises(ValueError, match="board and disc_cover"):
        rendered(change={"disc_cover": np.zeros(5, np.float32)})
    with pytest.raises(ValueError, match="pixels must be from 0"):
        rendered(change={"board": np.zeros(5, np.float32), "disc_cover": np.zeros(5, np.float32)})
