"""Check what is painted: pages, print, board and hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tiegocancel.scene import MoverConfig, RigConfig, SceneConfig, photograph
from tiegocancel.scene.mover import MOVER_SAMPLES_PX, draw_mover
from tiegocancel.scene.paint import DISC_SAMPLES_PX, disc_cover, paint_board, paint_disc
from tiegocancel.scene.patterns import contour_lines, scattered_shapes


def page(side_px=130.0):
    axis = np.arange(-side_px / 2, side_px / 2, 0.5)
    return axis[None, :], axis[:, None]


@pytest.mark.parametrize("period_px", [12.0, 19.0])
def test_contour_lines_keep_their_distance(period_px):
    x, y = page()
    for seed in range(5):
        ink = contour_lines(x, y, side_px=130.0, period_px=period_px, rng=np.random.default_rng(seed)) < 0.0
        assert 0.3 < ink.mean() < 0.7
        runs = [np.diff(np.flatnonzero(np.diff(row.astype(int)))) / 2.0 for row in np.concatenate([ink, ink.T])]
        # A straight cut meets a line at its own width or wider; only hilltops and necks are narrower.
        assert np.mean(np.concatenate(runs) < 0.3 * period_px) < 0.1


def test_shapes_cover_a_part_of_the_page_in_many_pieces():
    from scipy.ndimage import label

    x, y = page()
    ink = scattered_shapes(x, y, side_px=130.0, pitch_px=26.0, rng=np.random.default_rng(1)) < 0.0
    assert 0.1 < ink.mean() < 0.5
    assert label(ink)[1] >= 15


def test_the_disc_has_two_pages_of_shapes_and_four_of_lines():
    rig = SceneConfig().rig
    seen = np.exp(paint_disc(rig))
    middle = seen.shape[0] // 2
    pitch = 0.508 * rig.radius_px * DISC_SAMPLES_PX
    half = int(0.35 * pitch)
    dark = []
    for row in (-1, 0, 1):
        for column in (-0.5, 0.5):
            y, x = int(middle + row * pitch), int(middle + column * pitch)
            inside = seen[y - half : y + half, x - half : x + half]
            assert inside.max() > 0.95 * rig.paper_reflectance
            assert inside.min() < 1.1 * rig.ink_reflectance
            dark.append(float((inside < 0.5 * (rig.paper_reflectance + rig.ink_reflectance)).mean()))
    assert max(dark[:2]) < min(dark[2:])


def test_another_pattern_seed_prints_other_pages():
    rig = SceneConfig(width=320, height=180).rig
    assert (paint_disc(rig) != paint_disc(replace(rig, pattern_seed=99))).any()
    np.testing.assert_array_equal(paint_disc(rig), paint_disc(rig))


def test_no_edge_is_sharper_than_the_lens():
    rig = SceneConfig().rig
    step = np.abs(np.diff(np.exp(paint_disc(rig)), axis=1)).max() * DISC_SAMPLES_PX
    darkest = 0.44
    assert step < (rig.paper_reflectance - darkest) / (np.sqrt(2.0 * np.pi) * rig.blur_px) * 1.1


def test_the_board_shows_axes_at_the_lower_left_only():
    rig = SceneConfig().rig
    board = np.exp(paint_board(rig, 1280, 720)).reshape(720, 1280)
    lower_left = board[460:, :420]
    assert lower_left.min() < 0.22
    assert board[:400].min() > 0.22


def test_the_cover_of_the_disc_is_its_area():
    rig = SceneConfig().rig
    cover = disc_cover(rig, 1280, 720)
    assert cover.sum() == pytest.approx(np.pi * rig.radius_px**2, rel=1e-3)
    assert (cover.min(), cover.max()) == (0.0, 1.0)


def test_the_hand_ends_before_the_border_of_its_picture():
    for size_px in (3.0, 40.0, 120.0):
        level, cover = draw_mover(replace(SceneConfig().mover, size_px=size_px))
        assert level.shape == cover.shape
        assert np.isfinite(level).all()
        rim = np.concatenate([cover[0], cover[-1], cover[:, 0], cover[:, -1]])
        assert rim.max() == 0.0
        extent_px = np.ptp(np.flatnonzero(cover.max(axis=0))) / MOVER_SAMPLES_PX
        assert 0.9 * size_px < extent_px < 1.2 * size_px + 4.0


def test_a_photograph_shows_the_disc_turned():
    config = SceneConfig.disc(width=320, height=180, mover=False)
    first, turned = photograph(config), photograph(config, time_s=np.pi / 3.6)
    assert first.shape == (180, 320)
    assert first.min() > 0.0
    assert first.max() < 1.0
    # Half a turn later the picture is point-symmetric about the centre.
    x0, y0 = config.rig.center_px
    x, y = np.meshgrid(np.arange(-20, 21), np.arange(-20, 21))
    column, row = round(x0), round(y0)
    shifted = replace(config, rig=replace(config.rig, center_px=(float(column), float(row))))
    first, turned = photograph(shifted), photograph(shifted, time_s=np.pi / 3.6)
    np.testing.assert_allclose(first[row + y, column + x], turned[row - y, column - x], atol=2e-3)


@pytest.mark.parametrize("time_s", [0.0, 0.03, 0.11])
def test_a_wobbling_disc_is_seen_whole_about_its_middle_of_the_moment(time_s):
    still = SceneConfig(width=320, height=180, rig=RigConfig(omega_rad_s=2.0), mover=MoverConfig(enabled=False))
    wobbling = replace(still, rig=replace(still.rig, wobble_px=(8.0, 5.0), wobble_hz=4.0))
    middle = wobbling.rig.center_at(np.array([time_s]))[0]
    there = replace(still, rig=replace(still.rig, center_px=(float(middle[0]), float(middle[1]))))
    seen, expected = photograph(wobbling, time_s=time_s), photograph(there, time_s=time_s)
    y, x = np.mgrid[:180, :320]
    away = np.hypot(x - middle[0], y - middle[1])
    inside, outside = away < still.rig.radius_px - 1.0, away > still.rig.radius_px + 1.0
    np.testing.assert_allclose(seen[inside], expected[inside], atol=2e-3)
    board = np.exp(paint_board(still.rig, 320, 180)).reshape(180, 320)
    np.testing.assert_allclose(seen[outside], board[outside], atol=1e-5)


def test_a_disc_without_blur_can_be_painted():
    assert np.isfinite(paint_disc(SceneConfig(width=64, height=48, rig=RigConfig(blur_px=0.0)).rig)).all()
