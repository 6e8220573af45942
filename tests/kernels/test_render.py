"""Check where the renderer puts the disc, and that its rim and its light are mixed in."""

from __future__ import annotations

import numpy as np
import pytest
from tiegocancel.kernels.render import render

SIDE = 21
CENTER = (10.0, 10.0)


def rendered(*, angle_rad=0.0, dot=(6, 0), gain=0.0, change=None):
    """Render one step of a dark disc of radius 9 px with a bright dot at ``dot`` px from its centre."""
    y, x = np.mgrid[:SIDE, :SIDE]
    disc = np.full((41, 41), -2.0, np.float32)  # two samples a pixel, the centre at sample 20
    row, column = 20 + 2 * dot[1], 20 + 2 * dot[0]
    disc[row - 1 : row + 2, column - 1 : column + 2] = 1.0
    arguments = {
        "board": np.zeros(SIDE * SIDE, np.float32),
        "disc_cover": (np.hypot(x - 10, y - 10) <= 9).astype(np.float32).reshape(-1),
        "disc": disc,
        "turn": np.array([[np.cos(angle_rad), np.sin(angle_rad)]], np.float32),
        "gain": np.array([gain], np.float32),
        "width": SIDE,
        "center_px": CENTER,
        "radius_px": 9.0,
        "samples_px": 2.0,
        "levels": np.empty((SIDE * SIDE, 1), np.float32),
        **(change or {}),
    }
    render(np.arange(SIDE * SIDE, dtype=np.int32), **arguments)
    return arguments["levels"].reshape(SIDE, SIDE)


def test_a_positive_angle_turns_x_towards_y():
    still = rendered(dot=(6, 2))
    turned = rendered(dot=(6, 2), angle_rad=np.pi / 2)
    eighth = rendered(dot=(5, 0), angle_rad=np.arctan2(3.0, 4.0))
    assert np.unravel_index(still.argmax(), still.shape) == (12, 16)
    assert np.unravel_index(turned.argmax(), turned.shape) == (16, 8)
    assert np.unravel_index(eighth.argmax(), eighth.shape) == (13, 14)


def test_the_board_is_seen_beside_the_disc_and_only_there():
    image = rendered()
    assert image[0, 0] == 0.0
    assert image[10, 8] == pytest.approx(-2.0)


def test_the_light_scales_everything():
    dim = rendered(gain=-0.5)
    full = rendered()
    np.testing.assert_allclose(dim, full - 0.5, atol=1e-6)


def test_a_centre_that_moves_takes_disc_and_rim_along():
    everywhere = {"disc_cover": np.ones(SIDE * SIDE, np.float32), "center_px": np.array([[12.0, 9.0]], np.float32)}
    still = rendered(dot=(4, 2))
    moved = rendered(dot=(4, 2), change=everywhere)
    assert np.unravel_index(still.argmax(), still.shape) == (12, 14)
    assert np.unravel_index(moved.argmax(), moved.shape) == (11, 16)
    y, x = np.mgrid[:SIDE, :SIDE]
    away = np.hypot(x - 12, y - 9)
    assert (moved[away > 9.5] == 0.0).all()
    assert (moved[away < 8.5] < -1.0)[moved[away < 8.5] < 0.9].all()


def test_a_rim_pixel_that_is_covered_by_half_is_mixed():
    change = {"disc_cover": np.ones(SIDE * SIDE, np.float32), "center_px": np.array([[10.25, 10.0]], np.float32)}
    image = rendered(change=change)
    # The pixel at x = 19 lies 8.75 px from the centre, so that three quarters of it are disc.
    assert image[10, 19] == pytest.approx(-2.0 * 0.75)


def test_shapes_that_differ_are_refused():
    with pytest.raises(ValueError, match="levels"):
        rendered(change={"levels": np.empty((3, 1), np.float32)})
    with pytest.raises(ValueError, match="board and disc_cover"):
        rendered(change={"disc_cover": np.zeros(5, np.float32)})
    with pytest.raises(ValueError, match="center_px must be one point or 1, not of shape"):
        rendered(change={"center_px": np.zeros((3, 2), np.float32)})
    with pytest.raises(ValueError, match="pixels must be from 0"):
        rendered(change={"board": np.zeros(5, np.float32), "disc_cover": np.zeros(5, np.float32)})
