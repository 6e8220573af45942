"""Render the built-in scene pixel by pixel: a turning disc on a still board."""

import numpy as np
from tiegocancel.kernels.runtime import start, ti

__all__ = ["bilinear", "clamp", "render"]


@ti.func
def bilinear(image: ti.template(), column: ti.f32, row: ti.f32) -> ti.f32:
    """Sample ``image`` (rows, columns) between its samples; the place must lie inside, short of the last of each."""
    left = ti.cast(column, ti.i32)
    top = ti.cast(row, ti.i32)
    across = column - left
    down = row - top
    upper = image[top, left] + across * (image[top, left + 1] - image[top, left])
    lower = image[top + 1, left] + across * (image[top + 1, left + 1] - image[top + 1, left])
    return upper + down * (lower - upper)


@ti.func
def clamp(place: ti.f32, last: ti.f32) -> ti.f32:
    """Hold a place inside the samples 0 to ``last``."""
    return ti.max(0.0, ti.min(place, last))


@ti.kernel
def render_kernel(
    pixels: ti.types.ndarray(ti.i32, ndim=1),  # (n,) y * width + x
    board: ti.types.ndarray(ti.f32, ndim=1),  # (size,) log-intensity of what stands still
    disc_cover: ti.types.ndarray(ti.f32, ndim=1),  # (size,) share of the pixel that the disc covers, at most
    disc: ti.types.ndarray(ti.f32, ndim=2),  # (rows, columns) log-intensity on the disc, its centre in the middle
    turn: ti.types.ndarray(ti.f32, ndim=2),  # (steps, 2) cosine and sine of the disc's angle
    center_px: ti.types.ndarray(ti.f32, ndim=2),  # (steps, 2) x and y of the disc's centre; (1, 2) where it stays
    gain: ti.types.ndarray(ti.f32, ndim=1),  # (steps,) logarithm of the light's strength
    levels: ti.types.ndarray(ti.f32, ndim=2),  # (n, steps) out: log-intensity
    width: ti.i32,
    center_x_px: ti.f32,
    center_y_px: ti.f32,
    radius_px: ti.f32,
    disc_samples_px: ti.f32,
    stays: ti.template(),  # compiled in: the centre stays, and disc_cover is exact
):
    """Blend board and disc in the logarithm: exact but for the pixel-wide rim."""
    middle_column = 0.5 * ti.cast(disc.shape[1] - 1, ti.f32)
    middle_row = 0.5 * ti.cast(disc.shape[0] - 1, ti.f32)
    last_column = ti.cast(disc.shape[1], ti.f32) - 1.01
    last_row = ti.cast(disc.shape[0], ti.f32) - 1.01
    for i in range(pixels.shape[0]):
        pixel = pixels[i]
        x = ti.cast(pixel % width, ti.f32)
        y = ti.cast(pixel // width, ti.f32)
        away_x = (x - center_x_px) * disc_samples_px
        away_y = (y - center_y_px) * disc_samples_px
        still = board[pixel]
        most = disc_cover[pixel]
        for step in range(turn.shape[0]):
            value = still
            if most > 0.0:
                share = most
                if ti.static(not stays):
                    away_x = (x - center_px[step, 0]) * disc_samples_px
                    away_y = (y - center_px[step, 1]) * disc_samples_px
                    away_px = ti.sqrt(away_x * away_x + away_y * away_y) / disc_samples_px
                    share = ti.max(0.0, ti.min(radius_px + 0.5 - away_px, 1.0))
                cosine = turn[step, 0]
                sine = turn[step, 1]
                column = clamp(middle_column + cosine * away_x + sine * away_y, last_column)
                row = clamp(middle_row + cosine * away_y - sine * away_x, last_row)
                value += share * (bilinear(disc, column, row) - still)
            levels[i, step] = value + gain[step]


def render(
    pixels,
    *,
    board,
    disc_cover,
    disc,
    turn,
    gain,
    width,
    center_px,
    samples_px,
    levels,
    radius_px=0.0,
):
    """Fill ``levels`` float32[n, steps] with the log-intensity of ``pixels`` int32[n].

    ``board`` and ``disc_cover`` are float32 over the whole sensor, row by row; ``disc`` holds ``samples_px`` samples a
    pixel; ``turn`` float32[steps, 2] (cos θ, sin θ), ``gain`` float32[steps]. A positive θ turns x towards y.
    ``center_px`` is one point, or float32[steps, 2] for a disc that moves: its cover is then that of a circle of
    ``radius_px`` about each, and ``disc_cover`` above 0 wherever any of them comes. Raise ``ValueError`` when a pixel
    index lies outside the sensor or the shapes differ.
    """
    start()
    shape = (len(pixels), len(turn))
    centers = np.asarray(center_px, np.float32)
    stays = centers.ndim == 1
    if centers.shape != ((2,) if stays else (shape[1], 2)):
        raise ValueError(f"center_px must be one point or {shape[1]}, not of shape {centers.shape}")
    if levels.shape != shape or len(gain) != shape[1]:
        raise ValueError(f"levels {levels.shape} must be {shape}, and gain as long")
    if min(disc.shape) < 2:
        raise ValueError(f"disc must have at least 2 × 2 samples, not {disc.shape}")
    if len(board) != len(disc_cover):
        raise ValueError(f"board and disc_cover must have one shape, not {board.shape} and {disc_cover.shape}")
    if len(pixels) == 0:
        return
    if int(pixels.min()) < 0 or int(pixels.max()) >= len(board):
        raise ValueError(f"pixels must be from 0 to {len(board) - 1}, not {int(pixels.min())} to {int(pixels.max())}")
    render_kernel(
        pixels,
        board,
        disc_cover,
        disc,
        turn,
        np.ascontiguousarray(centers.reshape(-1, 2)),
        gain,
        levels,
        width,
        float(centers.flat[0]),
        float(centers.flat[1]),
        float(radius_px),
        float(samples_px),
        stays,
    )
