"""Measure how well the early and the late events of a window agree once warped, with slopes and curvature.

The agreement is ``E = 2·Σ_c I_c·L_c``: the early image times the late one, each ``Σ_i w_i·B(c − x'_i)`` with ``B`` a
quadratic B-spline, so ``E`` is a sum of ``w_i·w_j·K(x'_i − x'_j)`` over all pairs of an early and a late event, ``K``
being the autocorrelation of ``B``. Pairs of one moment are left out on purpose: a pixel that has fired does not fire
again at once, and the missing pairs push an estimate from short windows up.

Events near each other after warping share one velocity field ``F(x)·m``, so an event moves by ``−τ_i·F·dm``. Slope and
curvature of ``E`` are then sums over events of ``w_i·(−τ_i·S0' + S1')`` and ``w_i·(τ_i²·S0'' − 2τ_i·S1'' + S2'')``,
where ``S_k`` is the other half's image with weights ``w_j·τ_j^k``: three images of each half give the exact slope and
Newton's curvature, for any of the six affine rates, in two passes. One thread runs it, event after event, so that the
sums are the same bits each time.
"""

import numpy as np
from tiegocancel.kernels.runtime import start, ti

__all__ = ["SUMS", "energies", "rest", "slopes"]

SUMS = 8 + 36
"""Columns of a tile's row: events, energy, slope 6, curvature 3 × 6, summed squares of the slopes 3 × 6."""


@ti.func
def _spline(u: ti.f32) -> ti.math.vec3:
    return ti.Vector([0.5 * (0.5 - u) * (0.5 - u), 0.75 - u * u, 0.5 * (0.5 + u) * (0.5 + u)])


@ti.func
def _place(x: ti.f32, y: ti.f32, m0: ti.f32, m1: ti.f32, m2: ti.f32) -> ti.f32:
    return m0 * x + m1 * y + m2


@ti.kernel
def _splat(
    x: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n] px from the anchor
    y: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n] px from the anchor
    weight: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n] 0 leaves an event out
    slot: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n] row of tau and warp
    tau: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [slots] half windows from the middle, −1 to 1: early below 0
    warp: ti.types.ndarray(dtype=ti.f32, ndim=2),  # [slots, 12] px → px to the middle, then half the way
    cells_a_px: ti.f32,
    origin_x: ti.f32,  # anchor, in cells
    origin_y: ti.f32,
    image: ti.types.ndarray(
        dtype=ti.f32, ndim=3
    ),  # [rows, columns, 6] out, zeroed by the host: S0 S1 S2 early, then late
):
    rows = image.shape[0]
    columns = image.shape[1]
    ti.loop_config(serialize=True)
    for i in range(x.shape[0]):
        if weight[i] != 0.0:
            k = slot[i]
            at_x = _place(x[i], y[i], warp[k, 0], warp[k, 1], warp[k, 2]) * cells_a_px + origin_x
            at_y = _place(x[i], y[i], warp[k, 3], warp[k, 4], warp[k, 5]) * cells_a_px + origin_y
            # Compared as floats: a far warp must not wrap around into the image.
            if at_x >= 1.0 and at_x < columns - 2.0 and at_y >= 1.0 and at_y < rows - 2.0:
                c = ti.cast(at_x + 0.5, ti.i32)
                r = ti.cast(at_y + 0.5, ti.i32)
                across = _spline(at_x - c)
                down = _spline(at_y - r)
                w0 = weight[i]
                w1 = w0 * tau[k]
                w2 = w1 * tau[k]
                own = 0
                if tau[k] > 0.0:
                    own = 3
                for dr in ti.static(range(3)):
                    for dc in ti.static(range(3)):
                        share = across[dc] * down[dr]
                        image[r + dr - 1, c + dc - 1, own] += w0 * share
                        image[r + dr - 1, c + dc - 1, own + 1] += w1 * share
                        image[r + dr - 1, c + dc - 1, own + 2] += w2 * share


@ti.kernel
def _rest(
    x: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n] px from the anchor
    y: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n] px from the anchor
    weight: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n]
    cells_a_px: ti.f32,
    origin_x: ti.f32,
    origin_y: ti.f32,
    image: ti.types.ndarray(dtype=ti.f32, ndim=2),  # [rows, columns] out, zeroed by the host
):
    rows = image.shape[0]
    columns = image.shape[1]
    ti.loop_config(serialize=True)
    for i in range(x.shape[0]):
        at_x = x[i] * cells_a_px + origin_x
        at_y = y[i] * cells_a_px + origin_y
        if weight[i] != 0.0 and at_x >= 1.0 and at_x < columns - 2.0 and at_y >= 1.0 and at_y < rows - 2.0:
            c = ti.cast(at_x + 0.5, ti.i32)
            r = ti.cast(at_y + 0.5, ti.i32)
            across = _spline(at_x - c)
            down = _spline(at_y - r)
            for dr in ti.static(range(3)):
                for dc in ti.static(range(3)):
                    image[r + dr - 1, c + dc - 1] += weight[i] * across[dc] * down[dr]


@ti.kernel
def _energies(
    image: ti.types.ndarray(dtype=ti.f32, ndim=3),  # [rows, columns, 6] S0 S1 S2 early, then late
    sums: ti.types.ndarray(dtype=ti.f64, ndim=1),  # [6] out: early², late², early·late, early, late, cells
):
    own = ti.f64(0.0)
    other = ti.f64(0.0)
    shared = ti.f64(0.0)
    first = ti.f64(0.0)
    second = ti.f64(0.0)
    touched = ti.f64(0.0)
    ti.loop_config(serialize=True)
    for r in range(image.shape[0]):
        # A row is short enough for float32, an image is not.
        row = ti.Vector([0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        for c in range(image.shape[1]):
            early = image[r, c, 0]
            late = image[r, c, 3]
            if early != 0.0 or late != 0.0:
                row += ti.Vector([early * early, late * late, early * late, early, late, 1.0])
        own += row[0]
        other += row[1]
        shared += row[2]
        first += row[3]
        second += row[4]
        touched += row[5]
    sums[0] = own
    sums[1] = other
    sums[2] = shared
    sums[3] = first
    sums[4] = second
    sums[5] = touched


@ti.kernel
def _slopes(
    x: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n] px from the anchor
    y: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n] px from the anchor
    weight: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [n]
    slot: ti.types.ndarray(dtype=ti.i32, ndim=1),  # [n]
    tau: ti.types.ndarray(dtype=ti.f32, ndim=1),  # [slots]
    warp: ti.types.ndarray(dtype=ti.f32, ndim=2),  # [slots, 12]
    cells_a_px: ti.f32,
    origin_x: ti.f32,
    origin_y: ti.f32,
    scale: ti.f32,  # 1 / px: unit of length of the rates
    image: ti.types.ndarray(dtype=ti.f32, ndim=3),  # [rows, columns, 6]
    tile_cells: ti.i32,  # side of a tile
    tile_columns: ti.i32,
    sums: ti.types.ndarray(dtype=ti.f64, ndim=2),  # [tiles, SUMS] out, zeroed by the host
):
    rows = image.shape[0]
    columns = image.shape[1]
    ti.loop_config(serialize=True)
    for i in range(x.shape[0]):
        if weight[i] != 0.0:
            k = slot[i]
            at_x = _place(x[i], y[i], warp[k, 0], warp[k, 1], warp[k, 2]) * cells_a_px + origin_x
            at_y = _place(x[i], y[i], warp[k, 3], warp[k, 4], warp[k, 5]) * cells_a_px + origin_y
            if at_x >= 1.0 and at_x < columns - 2.0 and at_y >= 1.0 and at_y < rows - 2.0:
                c = ti.cast(at_x + 0.5, ti.i32)
                r = ti.cast(at_y + 0.5, ti.i32)
                u = at_x - c
                v = at_y - r
                across = _spline(u)
                down = _spline(v)
                slope_x = ti.Vector([u - 0.5, -2.0 * u, u + 0.5])
                slope_y = ti.Vector([v - 0.5, -2.0 * v, v + 0.5])
                t = tau[k]
                other = 3
                if t > 0.0:
                    other = 0
                level = 0.0
                gx = 0.0
                gy = 0.0
                hxx = 0.0
                hxy = 0.0
                hyy = 0.0
                for dr in ti.static(range(3)):
                    for dc in ti.static(range(3)):
                        s0 = image[r + dr - 1, c + dc - 1, other]
                        s1 = image[r + dr - 1, c + dc - 1, other + 1]
                        s2 = image[r + dr - 1, c + dc - 1, other + 2]
                        first = t * s0 - s1
                        second = t * (t * s0 - 2.0 * s1) + s2
                        level += s0 * across[dc] * down[dr]
                        gx += first * slope_x[dc] * down[dr]
                        gy += first * across[dc] * slope_y[dr]
                        # Second slope of the spline: 1, −2, 1.
                        hxx += second * down[dr] * ti.static(-2.0 if dc == 1 else 1.0)
                        hyy += second * across[dc] * ti.static(-2.0 if dr == 1 else 1.0)
                        hxy += second * slope_x[dc] * slope_y[dr]
                gx *= -weight[i] * cells_a_px
                gy *= -weight[i] * cells_a_px
                bend = weight[i] * cells_a_px * cells_a_px
                hxx *= bend
                hxy *= bend
                hyy *= bend
                # A change of the rates acts half the way on average: pull the slopes back to there.
                a = warp[k, 6]
                b = warp[k, 7]
                d = warp[k, 9]
                e = warp[k, 10]
                mid_x = _place(x[i], y[i], a, b, warp[k, 8]) * scale
                mid_y = _place(x[i], y[i], d, e, warp[k, 11]) * scale
                px = a * gx + d * gy
                py = b * gx + e * gy
                pxx = a * a * hxx + 2.0 * a * d * hxy + d * d * hyy
                pxy = a * b * hxx + (a * e + b * d) * hxy + d * e * hyy
                pyy = b * b * hxx + 2.0 * b * e * hxy + e * e * hyy
                moments = ti.Vector([mid_x * mid_x, mid_x * mid_y, mid_x, mid_y * mid_y, mid_y, 1.0])
                row = (r // tile_cells) * tile_columns + c // tile_cells
                sums[row, 0] += 1.0
                sums[row, 1] += weight[i] * level
                sums[row, 2] += px * mid_x
                sums[row, 3] += px * mid_y
                sums[row, 4] += px
                sums[row, 5] += py * mid_x
                sums[row, 6] += py * mid_y
                sums[row, 7] += py
                for j in ti.static(range(6)):
                    sums[row, 8 + j] += pxx * moments[j]
                    sums[row, 14 + j] += pxy * moments[j]
                    sums[row, 20 + j] += pyy * moments[j]
                    sums[row, 26 + j] += px * px * moments[j]
                    sums[row, 32 + j] += px * py * moments[j]
                    sums[row, 38 + j] += py * py * moments[j]


def slopes(*, x, y, weight, slot, tau, warp, cells_a_px, origin_cells, scale, image, tile_cells):
    """Return ``E``, its slopes and its curvatures tile by tile, float64[tiles, SUMS].

    ``x`` ``y`` float32[n] px from an anchor; ``weight`` float32[n], 0 leaves an event out; ``slot`` int32[n] row of
    ``tau`` float32[slots] (−1 to 1, time from the middle in half windows, early below 0) and of ``warp`` float32[slots,
    12] (the affine map, px to px from the anchor, that carries an event to the middle of the window, then the one that
    carries it half that way); ``cells_a_px`` and ``origin_cells`` place the anchor in ``image`` float32[rows, columns,
    6], which is overwritten; events beyond it are left out. Tiles are squares of ``tile_cells`` of the image, in
    row-major order. ``scale`` in 1/px.

    Rates ``a b c d e f`` are of the velocity field ``(a·X + b·Y + c, d·X + e·Y + f)``, ``X = scale·x``, in px a half
    window. Columns: 0 events; 1 energy; 2–7 slope of ``E`` along each rate (a share: the slope is the sum over all
    tiles); 8–25 curvature, ``xx xy yy`` each with the moments ``XX XY X YY Y 1``; 26–43 summed squares of the events'
    slopes in the same order. Raise ``ValueError`` when a shape, a dtype or a range is wrong.
    """
    _check(x, y, weight, slot, tau, warp, image)
    if tile_cells < 1:
        raise ValueError(f"tile_cells must be at least 1, not {tile_cells}")
    tile_rows, tile_columns = (-(-side // tile_cells) for side in image.shape[:2])
    sums = np.zeros((tile_rows * tile_columns, SUMS))
    image.fill(0.0)
    if len(x) == 0:
        return sums
    start()
    place = (cells_a_px, origin_cells[0], origin_cells[1])
    _splat(x, y, weight, slot, tau, warp, *place, image)
    _slopes(x, y, weight, slot, tau, warp, *place, scale, image, tile_cells, tile_columns, sums)
    return sums


def rest(*, x, y, weight, cells_a_px, origin_cells, image):
    """Fill ``image`` float32[rows, columns] with the events as they are; arguments as for :func:`slopes`."""
    if image.dtype != np.float32 or image.ndim != 2 or not image.flags.c_contiguous:
        raise ValueError(f"image must be contiguous float32[rows, columns], not {image.dtype}{image.shape}")
    _check_columns(("x", x, np.float32), ("y", y, np.float32), ("weight", weight, np.float32))
    image.fill(0.0)
    if len(x):
        start()
        _rest(x, y, weight, cells_a_px, origin_cells[0], origin_cells[1], image)


def energies(image):
    """Return sums over the cells of an image of :func:`slopes`, six floats.

    Squares of the early and of the late half, their product, both alone, and the count of cells with any event.
    Raise ``ValueError`` for another shape or dtype.
    """
    if image.dtype != np.float32 or image.ndim != 3 or image.shape[2] != 6 or not image.flags.c_contiguous:
        raise ValueError(f"image must be contiguous float32[rows, columns, 6], not {image.dtype}{image.shape}")
    sums = np.zeros(6)
    start()
    _energies(image, sums)
    return sums.tolist()


def _check(x, y, weight, slot, tau, warp, image):
    """Refuse what the kernels would read or write beyond an array."""
    _check_columns(("x", x, np.float32), ("y", y, np.float32), ("weight", weight, np.float32), ("slot", slot, np.int32))
    slots = len(tau)
    if tau.dtype != np.float32 or warp.dtype != np.float32 or warp.shape != (slots, 12) or tau.ndim != 1:
        raise ValueError(f"tau and warp must be float32[slots] and float32[slots, 12], not {tau.shape} {warp.shape}")
    if not (tau.flags.c_contiguous and warp.flags.c_contiguous):
        raise ValueError("tau and warp must be contiguous")
    if image.dtype != np.float32 or image.ndim != 3 or image.shape[2] != 6 or not image.flags.c_contiguous:
        raise ValueError(f"image must be contiguous float32[rows, columns, 6], not {image.dtype}{image.shape}")
    if len(x) and (int(slot.min()) < 0 or int(slot.max()) >= slots):
        raise ValueError(f"slot must be from 0 to {slots - 1}, not from {slot.min()} to {slot.max()}")


def _check_columns(*columns):
    """Refuse columns of another length or type than the first says."""
    count = len(columns[0][1])
    for name, column, dtype in columns:
        if column.dtype != dtype or column.shape != (count,) or not column.flags.c_contiguous:
            raise ValueError(f"{name} must be contiguous {dtype.__name__}[{count}], not {column.dtype}{column.shape}")
