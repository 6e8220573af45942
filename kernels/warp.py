"""Accumulate images of warped events in fixed point, many candidate motions in one launch.

All arithmetic is in integers: the result is the same bits on any number of threads, and a NumPy model can be held
equal to it. Candidates run in parallel, the events of one candidate in order, so no atomics are needed.
"""

import numpy as np
from tiegocancel.kernels.runtime import start, ti

__all__ = ["EVENT_WEIGHT", "MAX_EVENTS", "warp_energy"]

FRACTION_BITS = 16
SUBCELL_BITS = 6
WEIGHT_SHIFT = 14
EVENT_WEIGHT = 1 << (2 * (2 * SUBCELL_BITS + 1) - WEIGHT_SHIFT)
"""What one event adds to the image in all: 2^12, but for the rounding of its nine shares."""
MAX_EVENTS = 1 << 18
"""Most events of one image: its sum stays near 2^30 and its energy, at most the square of that, near 2^60."""


@ti.kernel
def _energy(
    x: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n] px
    y: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n] px
    weight: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n] −1, 0 or 1
    slot: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n] row of the warp table, one a time slot
    warp: ti.types.ndarray(dtype=ti.i64, ndim=3),  # [m, slots, 6] a b c d e f, 16 fractional bits
    cell_bits: ti.i32,  # side of a cell is 2^cell_bits px
    margin: ti.i32,  # cells around the sensor on each side
    image: ti.types.ndarray(dtype=ti.i32, ndim=3),  # [m, rows, columns] out
    total: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [m] out: sum over the image
    energy: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [m] out: sum of squares over the image
):
    rows = image.shape[1]
    columns = image.shape[2]
    ti.loop_config(block_dim=1)
    for h in range(image.shape[0]):
        for r in range(rows):
            for c in range(columns):
                image[h, r, c] = 0
        for i in range(x.shape[0]):
            k = slot[i]
            px = ti.cast(x[i], ti.i64)
            py = ti.cast(y[i], ti.i64)
            to_x = (px << FRACTION_BITS) + warp[h, k, 0] * px + warp[h, k, 1] * py + warp[h, k, 2]
            to_y = (py << FRACTION_BITS) + warp[h, k, 3] * px + warp[h, k, 4] * py + warp[h, k, 5]
            # Cell centres lie at whole numbers of (v / side); keep SUBCELL_BITS of the place between two borders.
            fine_x = (to_x >> (FRACTION_BITS + cell_bits - SUBCELL_BITS)) + (1 << (SUBCELL_BITS - 1))
            fine_y = (to_y >> (FRACTION_BITS + cell_bits - SUBCELL_BITS)) + (1 << (SUBCELL_BITS - 1))
            wide_c = (fine_x >> SUBCELL_BITS) + margin
            wide_r = (fine_y >> SUBCELL_BITS) + margin
            # Compared in 64 bits: a far warp must not wrap around into the image.
            if wide_c >= 1 and wide_c < columns - 1 and wide_r >= 1 and wide_r < rows - 1:
                c = ti.cast(wide_c, ti.i32)
                r = ti.cast(wide_r, ti.i32)
                u = ti.cast(fine_x & ((1 << SUBCELL_BITS) - 1), ti.i32)
                v = ti.cast(fine_y & ((1 << SUBCELL_BITS) - 1), ti.i32)
                # Quadratic B-spline over three cells; the three weights add up to 2^(2·SUBCELL_BITS + 1).
                left = ((1 << SUBCELL_BITS) - u) ** 2
                right = u * u
                above = ((1 << SUBCELL_BITS) - v) ** 2
                below = v * v
                for dr in ti.static((-1, 0, 1)):
                    wy = above
                    if ti.static(dr == 0):
                        wy = (2 << (2 * SUBCELL_BITS)) - above - below
                    if ti.static(dr == 1):
                        wy = below
                    for dc in ti.static((-1, 0, 1)):
                        wx = left
                        if ti.static(dc == 0):
                            wx = (2 << (2 * SUBCELL_BITS)) - left - right
                        if ti.static(dc == 1):
                            wx = right
                        image[h, r + dr, c + dc] += weight[i] * ((wx * wy + (1 << (WEIGHT_SHIFT - 1))) >> WEIGHT_SHIFT)
        whole = ti.cast(0, ti.i64)
        squares = ti.cast(0, ti.i64)
        for r in range(rows):
            for c in range(columns):
                value = ti.cast(image[h, r, c], ti.i64)
                whole += value
                squares += value * value
        total[h] = whole
        energy[h] = squares


def warp_energy(x, y, weight, slot, warp, cell_bits, margin, image):
    """Splat events under ``m`` candidate warps; return the sum and the sum of squares of each image, int64[m] each.

    ``x`` ``y`` int32[n] in px; ``weight`` int32[n], −1, 0 or 1; ``slot`` int32[n], the row of ``warp`` that an event
    uses; ``warp`` int64[m, slots, 6], displacement coefficients ``a b c d e f`` with 16 fractional bits, as in
    :class:`tiegocancel.motion.schedule.MotionSchedule`; a cell of the image is ``2^cell_bits`` px wide (0 to 6);
    ``image`` int32[≥ m, rows, columns] is overwritten, its first ``m`` layers are the images, in units of
    ``1 / EVENT_WEIGHT``. Cell ``(margin, margin)`` is centred on pixel (0, 0). Events that a warp carries beyond the
    image are left out. A quadratic B-spline spreads each event over 3 × 3 cells, so the image is smoothed by about
    half a cell (σ). Raise ``ValueError`` when a shape, a dtype or a range is wrong.
    """
    count = len(x)
    if count > MAX_EVENTS:
        raise ValueError(f"at most {MAX_EVENTS} events fit one image, not {count}")
    for name, column in (("x", x), ("y", y), ("weight", weight), ("slot", slot)):
        if column.dtype != np.int32 or column.shape != (count,) or not column.flags.c_contiguous:
            raise ValueError(f"{name} must be contiguous int32[{count}], not {column.dtype}{list(column.shape)}")
    if warp.dtype != np.int64 or warp.ndim != 3 or warp.shape[2] != 6 or not warp.flags.c_contiguous:
        raise ValueError(f"warp must be contiguous int64[m, slots, 6], not {warp.dtype}{list(warp.shape)}")
    if image.dtype != np.int32 or image.ndim != 3 or len(image) < len(warp) or not image.flags.c_contiguous:
        raise ValueError(f"image must be contiguous int32[≥ {len(warp)}, rows, columns], not of shape {image.shape}")
    if not 0 <= cell_bits <= 6:
        raise ValueError(f"cell_bits must be from 0 to 6, not {cell_bits}")
    if margin < 0:
        raise ValueError(f"margin must not be negative, not {margin}")
    if count and not (int(slot.min()) >= 0 and int(slot.max()) < warp.shape[1]):
        raise ValueError(f"slot must be from 0 to {warp.shape[1] - 1}, not from {slot.min()} to {slot.max()}")
    if count and not (int(weight.min()) >= -1 and int(weight.max()) <= 1):
        raise ValueError(f"weight must be from -1 to 1, not from {weight.min()} to {weight.max()}")
    total = np.zeros(len(warp), np.int64)
    energy = np.zeros(len(warp), np.int64)
    if count == 0 or len(warp) == 0:
        image[: len(warp)] = 0
        return total, energy
    start()
    _energy(x, y, weight, slot, warp, cell_bits, margin, image[: len(warp)], total, energy)
    return total, energy
