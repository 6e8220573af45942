"""Run many plain cancellers over the same events in one launch, each on one thread: what a sweep asks for.

The rule is that of :mod:`tiegocancel.kernels.match`, with a ring as long as the stream: predictions fall due in the
order of their events, so the stream itself is the ring, and a prediction is computed when it is drained. A cell holds
the row of the event that made the prediction, plus one; 0 is empty. The table carries a border as wide as the widest
gate, so that no window needs a bounds test.

``chained`` keeps every prediction of a pixel instead of the last: a cell begins a chain of rows, newest first, and an
event takes the oldest that is still open. No device could afford it; it tells what the table's single cell costs.
"""

from functools import cache

from tiegocancel.kernels.runtime import start, ti

__all__ = ["cancel_many"]


def cancel_many(*, chained, **arguments):
    """Run one launch; the arguments are those of the kernel, by name."""
    start()
    _kernel(chained)(**arguments)


@cache
def _kernel(chained):
    @ti.kernel
    def run(
        width: ti.i32,
        height: ti.i32,
        stride: ti.i32,  # cells from one row of the table to the next
        origin: ti.i32,  # cell of pixel (0, 0)
        t: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [n] µs
        x: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        y: ti.types.ndarray(dtype=ti.u16, ndim=1),  # [n] px
        p: ti.types.ndarray(dtype=ti.u8, ndim=1),  # [n]
        horizon_us: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [m]
        gate_us: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [m]
        flip: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [m] 0: polarities agree, 1: they differ, 2: whatever they are
        window: ti.types.ndarray(dtype=ti.i32, ndim=2),  # [m, 2] first and last entry of `offsets`
        offsets: ti.types.ndarray(dtype=ti.i32, ndim=1),  # linear, nearest first
        entries: ti.types.ndarray(dtype=ti.i32, ndim=2),  # [m, S + 1] rows of events at which the entry changes
        coefficients: ti.types.ndarray(dtype=ti.i64, ndim=3),  # [m, S, 6] a b c d e f, 16 fractional bits
        cells: ti.types.ndarray(dtype=ti.i32, ndim=2),  # [m, table], overwritten
        older: ti.types.ndarray(dtype=ti.i32, ndim=2),  # [m, n] the rest of each chain, [m, 1] when not chained
        suppressed: ti.types.ndarray(dtype=ti.u8, ndim=2),  # [m, n] out
        source: ti.types.ndarray(dtype=ti.i32, ndim=2),  # [m, n] out: row of the event whose prediction was used, or −1
        high_water: ti.types.ndarray(dtype=ti.i64, ndim=1),  # [m] out: most events whose predictions waited
    ):
        ti.loop_config(block_dim=1)
        for j in range(cells.shape[0]):
            for cell in range(cells.shape[1]):
                cells[j, cell] = 0
            count = t.shape[0]
            horizon = horizon_us[j]
            gate = gate_us[j]
            kind = flip[j]
            head = 0
            entry = 0
            most = ti.cast(0, ti.i64)
            for i in range(count):
                now = t[i]
                # 1. drain: events before this one whose prediction's gate has opened
                while head < i and t[head] + horizon - gate <= now:
                    while entry + 1 < coefficients.shape[1] and head >= entries[j, entry + 1]:
                        entry += 1
                    column = ti.cast(x[head], ti.i64)
                    row = ti.cast(y[head], ti.i64)
                    ahead_x = (
                        (column << 16)
                        + coefficients[j, entry, 0] * column
                        + coefficients[j, entry, 1] * row
                        + coefficients[j, entry, 2]
                        + 32768
                    ) >> 16
                    ahead_y = (
                        (row << 16)
                        + coefficients[j, entry, 3] * column
                        + coefficients[j, entry, 4] * row
                        + coefficients[j, entry, 5]
                        + 32768
                    ) >> 16
                    if ahead_x >= 0 and ahead_x < width and ahead_y >= 0 and ahead_y < height:
                        cell = origin + ti.cast(ahead_y, ti.i32) * stride + ti.cast(ahead_x, ti.i32)
                        if ti.static(chained):
                            older[j, head] = cells[j, cell]
                        cells[j, cell] = head + 1
                    head += 1
                # 2. match
                here = origin + ti.cast(y[i], ti.i32) * stride + ti.cast(x[i], ti.i32)
                sign = ti.cast(p[i], ti.i32)
                met = -1
                k = window[j, 0]
                while k < window[j, 1]:
                    beside = here + offsets[k]
                    k += 1
                    made = cells[j, beside] - 1
                    if ti.static(chained):
                        # Walk from the newest to the oldest that is open; `before` links to what is taken out.
                        newer = -1
                        before = -1
                        while made >= 0:
                            if now - (t[made] + horizon) > gate:
                                made = -1  # and so is everything older
                            else:
                                if kind == 2 or (ti.cast(p[made], ti.i32) ^ sign) == kind:
                                    met = made
                                    before = newer
                                newer = made
                                made = older[j, made] - 1
                        if met >= 0:
                            if before < 0:
                                cells[j, beside] = older[j, met]
                            else:
                                older[j, before] = older[j, met]
                            k = window[j, 1]
                    else:
                        open_yet = made >= 0 and now - (t[made] + horizon) <= gate
                        if open_yet and (kind == 2 or (ti.cast(p[made], ti.i32) ^ sign) == kind):
                            cells[j, beside] = 0
                            met = made
                            k = window[j, 1]
                suppressed[j, i] = ti.cast(met >= 0, ti.u8)
                source[j, i] = met
                # 3. the prediction waits: it is the event itself
                most = ti.max(most, ti.cast(i + 1 - head, ti.i64))
            high_water[j] = most

    return run
