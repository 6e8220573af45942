"""Check where the renderer of the far world puts things, against a plain projection."""

from __future__ import annotations

import numpy as np
import pytest
from tiegocancel.kernels.world import render_world

WIDTH, HEIGHT, FOCAL_PX = 9, 7, 4.0
SIZE = WIDTH * HEIGHT


def turn(axis, angle_rad):
    """A right-handed turn about x, y or z, float64[3, 3]."""
    matrix = np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix[[first, second], [first, second]] = np.cos(angle_rad)
    matrix[second, first], matrix[first, second] = np.sin(angle_rad), -np.sin(angle_rad)
    return matrix


def rendered(*attitudes, wall=None, change=None):
    """Render one step for each attitude before a wall whose brightness is its place."""
    axis = np.linspace(-1.0, 1.0, 801)
    steps = len(attitudes)
    arguments = {
        "wall": (axis[None, :] + 10.0 * axis[:, None]).astype(np.float32) if wall is None else wall,
        "attitude": np.asarray(attitudes, np.float32),
        "width": WIDTH,
        "height": HEIGHT,
        "focal_px": FOCAL_PX,
        "principal_px": (4.0, 3.0),
        "levels": np.empty((SIZE, steps), np.float32),
        **(change or {}),
    }
    render_world(np.arange(SIZE, dtype=np.int32), **arguments)
    return arguments["levels"]


def plain(attitude):
    """Return the level of every pixel, one after the other."""
    levels = []
    for pixel in range(SIZE):
        ray = np.array([(pixel % WIDTH - 4.0) / FOCAL_PX, (pixel // WIDTH - 3.0) / FOCAL_PX, 1.0])
        world = attitude @ ray
        longest = int(np.abs(world).argmax())
        across, along = world[[[2, 1], [0, 2], [0, 1]][longest]] / abs(world[longest])
        levels.append(across * (1.2 - 0.2 * across**2) + 10.0 * along * (1.2 - 0.2 * along**2))
    return np.array(levels)


@pytest.mark.parametrize("seed", range(6))
def test_every_pixel_meets_the_wall_where_its_ray_does(seed):
    rng = np.random.default_rng(seed)
    attitudes = [turn(0, rng.uniform(-3, 3)) @ turn(1, rng.uniform(-3, 3)) @ turn(2, rng.uniform(-3, 3)) for _ in "ab"]
    levels = rendered(*attitudes)
    for step, attitude in enumerate(attitudes):
        # A ray within rounding of an edge of the cube may meet either wall; the two differ there.
        wrong = np.abs(levels[:, step] - plain(attitude)) > 2e-3
        assert wrong.sum() <= 1


def test_looking_right_moves_what_was_ahead_to_the_left():
    wall = np.zeros((801, 801), np.float32)
    wall[370:431, 370:431] = 1.0
    ahead = rendered(np.eye(3), wall=wall)
    right = rendered(turn(1, np.arctan(0.5)), wall=wall)
    assert np.unravel_index(ahead.argmax(), (HEIGHT, WIDTH)) == (3, 4)
    assert np.unravel_index(right.argmax(), (HEIGHT, WIDTH)) == (3, 2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"levels": np.empty((3, 1), np.float32)}, "levels"),
        ({"attitude": np.zeros((1, 9), np.float32)}, "attitude must be of shape"),
        ({"wall": np.zeros((3, 4), np.float32)}, "wall must be square"),
        ({"height": 3}, "pixels must be from 0 to 26, not 0 to 62"),
    ],
)
def test_shapes_that_differ_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        rendered(np.eye(3), change=change)
