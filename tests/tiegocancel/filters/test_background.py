"""An event passes when its neighbours fired lately."""

from __future__ import annotations

from collections.abc import Callable

import pytest

Pixel = Callable[..., list[bool]]


def test_support_lasts_exactly_the_delay(kept: Pixel) -> None:
    assert kept([0, 1000], x=[2, 3], background_us=1000) == [False, True]
    assert kept([0, 1001], x=[2, 3], background_us=1000) == [False, False]


def test_a_pixel_does_not_support_itself(kept: Pixel) -> None:
    assert kept([0, 1, 2], background_us=1000) == [False, False, False]
    assert kept([0, 1, 2], background_us=1000, background_radius_px=3) == [False, False, False]


@pytest.mark.parametrize("radius", [1, 2, 3])
def test_neighbours_fill_a_square(kept: Pixel, radius: int) -> None:
    for dx in range(-2, 4):
        for dy in (-1, 0, 1, 2):
            near = 0 < max(abs(dx), abs(dy)) <= radius
            pair = kept([0, 5], x=[2, 2 + dx], y=[1, 1 + dy], background_us=10, background_radius_px=radius)
            assert pair[1] is near


@pytest.mark.parametrize("radius", [1, 3])
def test_the_left_edge_is_no_neighbour_of_the_right_one(kept: Pixel, radius: int) -> None:
    for row in (0, 1, 2):
        both = kept([0, 1], x=[5, 0], y=[1, row], background_us=10, background_radius_px=radius)
        assert both == [False, False]


def test_an_event_that_was_removed_still_supports_the_next(kept: Pixel) -> None:
    assert kept([0, 1, 2], x=[1, 2, 3], background_us=10) == [False, True, True]


def test_support_counts_pixels_not_events(kept: Pixel) -> None:
    two = {"background_us": 10, "background_support": 2}
    assert kept([0, 1, 2], x=[1, 1, 2], **two) == [False, False, False]
    assert kept([0, 1, 2], x=[1, 3, 2], **two) == [False, False, True]


def test_support_does_not_come_back_when_relative_time_wraps(kept: Pixel) -> None:
    for k in range(29, 36):
        assert not any(kept([i * (1 << k) for i in range(6)], x=[1, 2] * 3, background_us=(1 << 28) - 1))
