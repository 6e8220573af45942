"""Render the built-in scene pixel by pixel: a turning disc on a still board, with a mover in front."""

from tiegocancel.kernels.runtime import start, ti

__all__ = ["render"]


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
    disc_cover: ti.types.ndarray(ti.f32, ndim=1),  # (size,) share of the pixel that the disc covers
    disc: ti.types.ndarray(ti.f32, ndim=2),  # (rows, columns) log-intensity on the disc, its centre in the middle
    mover: ti.types.ndarray(ti.f32, ndim=2),  # (rows, columns) log-intensity of the mover
    mover_cover: ti.types.ndarray(ti.f32, ndim=2),  # (rows, columns) share covered, 0 along the border
    turn: ti.types.ndarray(ti.f32, ndim=2),  # (steps, 2) cosine and sine of the disc's angle
    corner_px: ti.types.ndarray(ti.f32, ndim=2),  # (steps, 2) x and y of the mover's first sample
    gain: ti.types.ndarray(ti.f32, ndim=1),  # (steps,) logarithm of the light's strength
    levels: ti.types.ndarray(ti.f32, ndim=2),  # (n, steps) out: log-intensity
    covered: ti.types.ndarray(ti.u8, ndim=2),  # (n, steps) out: 1 where the mover covers any of the pixel
    width: ti.i32,
    center_x_px: ti.f32,
    center_y_px: ti.f32,
    disc_samples_px: ti.f32,
    mover_samples_px: ti.f32,
):
    """Blend board, disc and mover in the logarithm: exact but for the pixel-wide rims."""
    middle_column = 0.5 * ti.cast(disc.shape[1] - 1, ti.f32)
    middle_row = 0.5 * ti.cast(disc.shape[0] - 1, ti.f32)
    last_column = ti.cast(disc.shape[1], ti.f32) - 1.01
    last_row = ti.cast(disc.shape[0], ti.f32) - 1.01
    mover_width_px = ti.cast(mover.shape[1] - 1, ti.f32) / mover_samples_px
    mover_height_px = ti.cast(mover.shape[0] - 1, ti.f32) / mover_samples_px
    for i in range(pixels.shape[0]):
        pixel = pixels[i]
        x = ti.cast(pixel % width, ti.f32)
        y = ti.cast(pixel // width, ti.f32)
        away_x = (x - center_x_px) * disc_samples_px
        away_y = (y - center_y_px) * disc_samples_px
        still = board[pixel]
        share = disc_cover[pixel]
        for step in range(turn.shape[0]):
            value = still
            if share > 0.0:
                cosine = turn[step, 0]
                sine = turn[step, 1]
                column = clamp(middle_column + cosine * away_x + sine * away_y, last_column)
                row = clamp(middle_row + cosine * away_y - sine * away_x, last_row)
                value += share * (bilinear(disc, column, row) - still)
            hidden = ti.cast(0, ti.u8)
            right = x - corner_px[step, 0]
            down = y - corner_px[step, 1]
            if right > 0.0 and down > 0.0 and right < mover_width_px and down < mover_height_px:
                column = clamp(right * mover_samples_px, ti.cast(mover.shape[1], ti.f32) - 1.01)
                row = clamp(down * mover_samples_px, ti.cast(mover.shape[0], ti.f32) - 1.01)
                over = bilinear(mover_cover, column, row)
                if over > 0.0:
                    value += over * (bilinear(mover, column, row) - value)
                    hidden = ti.cast(1, ti.u8)
            levels[i, step] = value + gain[step]
            covered[i, step] = hidden


def render(
    pixels,
    *,
    board,
    disc_cover,
    disc,
    mover,
    mover_cover,
    turn,
    corner_px,
    gain,
    width,
    center_px,
    samples_px,
    levels,
    covered,
):
    """Fill ``levels`` float32[n, steps] and ``covered`` uint8[n, steps] for ``pixels`` int32[n].

    ``board`` and ``disc_cover`` are float32 over the whole sensor, row by row; ``disc``, ``mover`` and ``mover_cover``
    hold ``samples_px`` = (of the disc, of the mover) samples a pixel; ``turn`` float32[steps, 2] (cos θ, sin θ),
    ``corner_px`` float32[steps, 2], ``gain`` float32[steps]. A positive θ turns x towards y. Raise ``ValueError`` when
    a pixel index lies outside the sensor or the shapes differ.
    """
    start()
    shape = (len(pixels), len(turn))
    if levels.shape != shape or covered.shape != shape or len(corner_px) != shape[1] or len(gain) != shape[1]:
        raise ValueError(f"levels {levels.shape} and covered {covered.shape} must be {shape}")
    if min(disc.shape) < 2:
        raise ValueError(f"disc must have at least 2 × 2 samples, not {disc.shape}")
    if len(board) != len(disc_cover) or mover.shape != mover_cover.shape:
        raise ValueError("board and disc_cover, mover and mover_cover must have one shape each")
    if len(pixels) == 0:
        return
    if int(pixels.min()) < 0 or int(pixels.max()) >= len(board):
        raise ValueError(f"pixels must be from 0 to {len(board) - 1}, not {int(pixels.min())} to {int(pixels.max())}")
    render_kernel(
        pixels,
        board,
        disc_cover,
        disc,
        mover,
        mover_cover,
        turn,
        corner_px,
        gain,
        levels,
        covered,
        width,
        float(center_px[0]),
        float(center_px[1]),
        float(samples_px[0]),
        float(samples_px[1]),
    )
