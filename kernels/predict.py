"""Predict where events are expected one horizon later, by six integers with 16 fractional bits."""

from functools import cache

from tiegocancel.kernels.runtime import start, ti

__all__ = ["predict"]


def predict(**arguments):
    """Fill ``ahead``; the arguments are those of the kernel, by name."""
    start()
    _kernel()(**arguments)


@cache
def _kernel():
    @ti.kernel
    def run(
        width: ti.i32,
        height: ti.i32,
        stride: ti.i32,  # cells from one row of the table to the next
        origin: ti.i32,  # cell of pixel (0, 0)
        segments: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [S + 1] rows of events at which the entry changes
        coefficients: ti.types.ndarray(dtype=ti.i64, ndim=2),  # [S, 6] a b c d e f
        x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        ahead: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n or more] out: cell of the prediction, −1 beyond the sensor
    ):
        ti.loop_config(serialize=True)
        for s in range(coefficients.shape[0]):
            a = coefficients[s, 0]
            b = coefficients[s, 1]
            c = coefficients[s, 2] + 32768
            d = coefficients[s, 3]
            e = coefficients[s, 4]
            f = coefficients[s, 5] + 32768
            for i in range(ti.cast(segments[s], ti.i32), ti.cast(segments[s + 1], ti.i32)):
                column = ti.cast(x[i], ti.i64)
                row = ti.cast(y[i], ti.i64)
                ahead_x = ((column << 16) + a * column + b * row + c) >> 16
                ahead_y = ((row << 16) + d * column + e * row + f) >> 16
                inside = ahead_x >= 0 and ahead_x < width and ahead_y >= 0 and ahead_y < height
                cell = origin + ti.cast(ahead_y, ti.i32) * stride + ti.cast(ahead_x, ti.i32)
                ahead[i] = ti.select(inside, cell, -1)

    return run
