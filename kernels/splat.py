"""Add signed events to an image at sub-pixel places, in fixed point: the same bits on any number of threads."""

from functools import cache

from tiegocancel.kernels.runtime import start, ti

__all__ = ["FRACTION_BITS", "splat"]

FRACTION_BITS = 8
"""Fractional bits of a place; an event adds 2^16 to the image in all."""


def splat(*, nearest, **arguments):
    """Add to ``image``; ``nearest`` takes the nearest pixel, otherwise the four around share by area (bilinear)."""
    start()
    _kernel(nearest)(**arguments)


@cache
def _kernel(nearest):
    @ti.kernel
    def run(
        x: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n] px, 8 fractional bits
        y: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n] px, 8 fractional bits
        weight: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n]
        image: ti.types.ndarray(dtype=ti.i64, ndim=2),  # [rows, columns] added to
    ):
        ti.loop_config(serialize=True)
        for i in range(x.shape[0]):
            if ti.static(nearest):
                c = (x[i] + 128) >> 8
                r = (y[i] + 128) >> 8
                if c >= 0 and c < image.shape[1] and r >= 0 and r < image.shape[0]:
                    image[r, c] += ti.cast(weight[i], ti.i64) << 16
            else:
                left = x[i] >> 8
                top = y[i] >> 8
                u = x[i] & 255
                v = y[i] & 255
                for dr in ti.static(range(2)):
                    for dc in ti.static(range(2)):
                        c = left + dc
                        r = top + dr
                        share = (u if dc else 256 - u) * (v if dr else 256 - v)
                        if c >= 0 and c < image.shape[1] and r >= 0 and r < image.shape[0]:
                            image[r, c] += ti.cast(weight[i] * share, ti.i64)

    return run
