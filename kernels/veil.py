"""Draw a mover before what is behind it, and keep count of how much of that is still seen."""

import numpy as np
from tiegocancel.kernels.render import bilinear, clamp
from tiegocancel.kernels.runtime import start, ti

__all__ = ["veil"]


@ti.kernel
def veil_kernel(
    rows: ti.types.ndarray(ti.i32, ndim=1),  # (m,) row in levels of each pixel that the mover may touch
    pixels: ti.types.ndarray(ti.i32, ndim=1),  # (n,) y * width + x
    mover: ti.types.ndarray(ti.f32, ndim=2),  # (rows, columns) log-intensity of the mover
    mover_cover: ti.types.ndarray(ti.f32, ndim=2),  # (rows, columns) share covered, 0 along the border
    corner_px: ti.types.ndarray(ti.f32, ndim=2),  # (steps, 2) x and y of the mover's first sample
    turn: ti.types.ndarray(ti.f32, ndim=2),  # (steps, 2) cosine and sine of its angle; (1, 2) where it stays upright
    gain: ti.types.ndarray(ti.f32, ndim=1),  # (steps,) logarithm of the light's strength
    levels: ti.types.ndarray(ti.f32, ndim=2),  # (n, steps) in, out: log-intensity, the light's included
    clear: ti.types.ndarray(ti.f32, ndim=2),  # (m, steps) in, out: share through which the background is seen
    width: ti.i32,
    samples_px: ti.f32,
    turns: ti.template(),  # compiled in: the picture turns about its middle
    lit: ti.template(),  # compiled in: the light changes
):
    """Blend the mover's picture into the levels, in the logarithm."""
    last_column = ti.cast(mover.shape[1], ti.f32) - 1.01
    last_row = ti.cast(mover.shape[0], ti.f32) - 1.01
    size_px = ti.Vector([mover.shape[1] - 1, mover.shape[0] - 1], dt=ti.f32) / samples_px
    for k in range(rows.shape[0]):
        i = rows[k]
        x = ti.cast(pixels[i] % width, ti.f32)
        y = ti.cast(pixels[i] // width, ti.f32)
        for step in range(levels.shape[1]):
            right = x - corner_px[step, 0]
            down = y - corner_px[step, 1]
            if ti.static(turns):
                away_x = right - 0.5 * size_px[0]
                away_y = down - 0.5 * size_px[1]
                right = 0.5 * size_px[0] + turn[step, 0] * away_x + turn[step, 1] * away_y
                down = 0.5 * size_px[1] + turn[step, 0] * away_y - turn[step, 1] * away_x
            if right > 0.0 and down > 0.0 and right < size_px[0] and down < size_px[1]:
                column = clamp(right * samples_px, last_column)
                row = clamp(down * samples_px, last_row)
                over = bilinear(mover_cover, column, row)
                if over > 0.0:
                    shade = bilinear(mover, column, row)
                    if ti.static(lit):
                        shade += gain[step]
                    levels[i, step] += over * (shade - levels[i, step])
                    clear[k, step] *= 1.0 - over


def veil(rows, pixels, *, mover, mover_cover, corner_px, gain, width, samples_px, levels, clear, turn=None):
    """Draw a mover into ``levels`` float32[n, steps], and let less through in ``clear`` float32[m, steps].

    ``rows`` int32[m] names, each once, the rows of ``levels`` that may change: the others are left alone; ``pixels``
    int32[n] are those of ``levels``. ``mover`` and ``mover_cover`` hold ``samples_px`` samples a pixel; ``corner_px``
    float32[steps, 2] is where their first sample lies, ``gain`` float32[steps] the light, which ``levels`` include.
    With ``turn`` float32[steps, 2] (cos θ, sin θ) the picture is turned about its middle, x towards y. Raise
    ``ValueError`` when a row does not exist or the shapes differ.
    """
    start()
    steps = levels.shape[1]
    if len(levels) != len(pixels) or clear.shape != (len(rows), steps) or gain.shape != (steps,):
        raise ValueError(f"levels {levels.shape}, clear {clear.shape} and gain {gain.shape} must agree")
    if corner_px.shape != (steps, 2):
        raise ValueError(f"corner_px must be of shape {(steps, 2)}, not {corner_px.shape}")
    if turn is not None and turn.shape != (steps, 2):
        raise ValueError(f"turn must be of shape {(steps, 2)}, not {turn.shape}")
    if mover.shape != mover_cover.shape:
        raise ValueError(f"mover {mover.shape} and mover_cover {mover_cover.shape} must have one shape")
    if len(rows) == 0 or min(mover.shape) < 2:
        return
    if int(rows.min()) < 0 or int(rows.max()) >= len(pixels):
        raise ValueError(f"rows must be from 0 to {len(pixels) - 1}, not {int(rows.min())} to {int(rows.max())}")
    veil_kernel(
        rows,
        pixels,
        mover,
        mover_cover,
        corner_px,
        np.array([[1.0, 0.0]], np.float32) if turn is None else turn,
        gain,
        levels,
        clear,
        width,
        float(samples_px),
        turn is not None,
        bool(gain.any()),
    )
