"""Hold the kernel of the contrast's slopes equal to a plain NumPy model and to numerical derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiegocancel.kernels.slopes import SUMS, energies, rest, slopes

SHAPE = (40, 52, 6)
RADIUS = 20.0


def spline(u):
    return np.array([0.5 * (0.5 - u) ** 2, 0.75 - u * u, 0.5 * (0.5 + u) ** 2])


def model(x, y, weight, slot, tau, warp, cells_a_px, origin_cells, scale, image, tile_cells):
    """Compute in float64 what the docstring of the kernel says, one event after the other; return sums and image."""
    rows, columns, _ = image.shape
    image = np.zeros(image.shape)
    tile_columns = -(-columns // tile_cells)
    sums = np.zeros((-(-rows // tile_cells) * tile_columns, SUMS))
    placed = []
    for i in range(len(x)):
        table = warp[slot[i]].astype(np.float64).reshape(4, 3)
        at_x, at_y = (table[:2, :2] @ (x[i], y[i]) + table[:2, 2]) * cells_a_px + origin_cells
        inside = 1.0 <= at_x < columns - 2.0 and 1.0 <= at_y < rows - 2.0
        if weight[i] == 0.0 or not inside:
            continue
        c, r = int(at_x + 0.5), int(at_y + 0.5)
        t = float(tau[slot[i]])
        placed.append((i, c, r, at_x - c, at_y - r, t, table[2:]))
        share = np.outer(spline(at_y - r), spline(at_x - c))
        for level in range(3):
            image[r - 1 : r + 2, c - 1 : c + 2, level + (3 if t > 0.0 else 0)] += weight[i] * t**level * share
    for i, c, r, u, v, t, half in placed:
        s0, s1, s2 = np.moveaxis(image[r - 1 : r + 2, c - 1 : c + 2], -1, 0)[3 * (t <= 0.0) :][:3]
        first, second = t * s0 - s1, t * t * s0 - 2.0 * t * s1 + s2
        across, down = spline(u), spline(v)
        d_across, d_down, bend = np.array([u - 0.5, -2 * u, u + 0.5]), np.array([v - 0.5, -2 * v, v + 0.5]), (1, -2, 1)
        pull = half[:, :2]
        g = pull.T @ (-weight[i] * cells_a_px * np.array([down @ first @ d_across, d_down @ first @ across]))
        hxy = d_down @ second @ d_across
        h = np.array([[down @ second @ bend, hxy], [hxy, bend @ second @ across]])
        h = pull.T @ (weight[i] * cells_a_px**2 * h) @ pull
        mid_x, mid_y = (half[:, :2] @ (x[i], y[i]) + half[:, 2]) * scale
        moments = np.array([mid_x * mid_x, mid_x * mid_y, mid_x, mid_y * mid_y, mid_y, 1.0])
        shape = np.array([mid_x, mid_y, 1.0])
        row = sums[(r // tile_cells) * tile_columns + c // tile_cells]
        row[:8] += (1.0, weight[i] * (down @ s0 @ across), *(g[0] * shape), *(g[1] * shape))
        for k, value in enumerate((h[0, 0], h[0, 1], h[1, 1], g[0] * g[0], g[0] * g[1], g[1] * g[1])):
            row[8 + 6 * k : 14 + 6 * k] += value * moments
    return sums, image


def exponential(generator):
    """Return the exponential of one small matrix."""
    total, term = np.eye(3), np.eye(3)
    for k in range(1, 30):
        term = term @ generator / k
        total = total + term
    return total


def warp_of(rates, tau):
    """Return the maps of a velocity field ``a b c d e f`` in px a half window, positions in units of ``RADIUS``."""
    generator = np.zeros((3, 3))
    generator[:2] = np.reshape(rates, (2, 3)) * (1.0 / RADIUS, 1.0 / RADIUS, 1.0)
    maps = [[exponential(-share * t * generator)[:2].ravel() for t in tau.astype(np.float64)] for share in (1.0, 0.5)]
    return np.concatenate(maps, axis=1).astype(np.float32)


def arguments(seed, *, count=120, slots=8, rates=(0.5, -1.0, 2.0, 1.0, 0.3, -1.5), cells_a_px=0.5, smooth=False):
    rng = np.random.default_rng(seed)
    spread = 6.0 if smooth else 18.0
    x, y = (rng.normal(0.0, spread, count).astype(np.float32) for _ in range(2))
    tau = ((2.0 * np.arange(slots) + 1.0) / slots - 1.0).astype(np.float32)
    return {
        "x": x,
        "y": y,
        "weight": np.ones(count, np.float32) if smooth else rng.integers(-1, 2, count).astype(np.float32),
        "slot": np.sort(rng.integers(0, slots, count)).astype(np.int32),
        "tau": tau,
        "warp": warp_of(rates, tau),
        "cells_a_px": cells_a_px,
        "origin_cells": (25.3, 19.8),
        "scale": 1.0 / RADIUS,
        "image": np.full(SHAPE, 7.0, np.float32),
        "tile_cells": 8,
    }


def matrix(moments):
    """Unfold the columns ``xx xy yy`` × ``XX XY X YY Y 1`` into [6, 6]."""
    blocks = [moments[6 * k : 6 * k + 6][[0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(3, 3) for k in range(3)]
    return np.block([[blocks[0], blocks[1]], [blocks[1], blocks[2]]])


@given(
    seed=st.integers(0, 2**31),
    cells_a_px=st.sampled_from([0.25, 0.5, 1.0, 1.7]),
    tile_cells=st.sampled_from([1, 3, 8, 64]),
    speed=st.sampled_from([0.0, 1.0, 20.0]),
)
@settings(max_examples=30, deadline=None)
def test_sums_and_images_equal_the_model(seed, cells_a_px, tile_cells, speed):
    rates = speed * np.random.default_rng(seed).normal(size=6)
    given_ = arguments(seed, rates=rates, cells_a_px=cells_a_px) | {"tile_cells": tile_cells}
    expected, image = model(**given_)
    sums = slopes(**given_)
    # An event on the very border of cells, tiles or the image may fall to either side in single precision.
    assert np.abs(sums[:, 0] - expected[:, 0]).sum() <= 4
    if (sums[:, 0] == expected[:, 0]).all():
        assert given_["image"] == pytest.approx(image, abs=2e-4)
        scale = np.abs(expected).max(axis=0) + 1.0
        assert (np.abs(sums - expected) <= 3e-3 * scale).all()


def test_slope_is_the_derivative_of_the_energy_along_each_rate():
    rates, step = np.array([0.5, -1.0, 2.0, 1.0, 0.3, -1.5]), 2e-2
    given_ = arguments(5, count=4000, rates=rates, smooth=True)
    energy = {}
    for rate in range(6):
        for side in (-1, 1):
            moved = rates + side * step * np.eye(6)[rate]
            energy[rate, side] = slopes(**(given_ | {"warp": warp_of(moved, given_["tau"])}))[:, 1].sum()
    # The energy listed counts each pair once from its early and once from its late event: the sum is E itself.
    central = np.array([(energy[rate, 1] - energy[rate, -1]) / (2.0 * step) for rate in range(6)])
    slope = slopes(**given_)[:, 2:8].sum(axis=0)
    assert slope == pytest.approx(central, rel=0.02, abs=0.01 * np.abs(central).max())


def test_curvature_is_the_second_derivative_of_the_energy_at_a_peak():
    rates, step = np.array([0.2, -0.3, 0.5, 0.3, 0.1, -0.4]), 0.05
    given_ = arguments(6, count=6000, rates=rates)
    # Points that move with the rates: the warp carries each point's events to one place.
    rng = np.random.default_rng(6)
    point = rng.integers(0, 60, 6000)
    place = np.stack([*rng.uniform(-16.0, 16.0, (2, 60)), np.ones(60)])[:, point]
    generator = np.zeros((3, 3))
    generator[:2] = np.reshape(rates, (2, 3)) * (1.0 / RADIUS, 1.0 / RADIUS, 1.0)
    forth = np.stack([exponential(t * generator) for t in given_["tau"].astype(np.float64)])[given_["slot"]]
    given_["x"], given_["y"] = np.einsum("nij,jn->in", forth[:, :2], place).astype(np.float32, order="C")
    given_["weight"] = (point % 2 * 2 - 1).astype(np.float32)

    def slope_at(point):
        return slopes(**(given_ | {"warp": warp_of(point, given_["tau"])}))[:, 2:8].sum(axis=0)

    numeric = np.array([(slope_at(rates + step * e) - slope_at(rates - step * e)) / (2.0 * step) for e in np.eye(6)])
    curvature = matrix(slopes(**given_)[:, 8:26].sum(axis=0))
    assert (np.linalg.eigvalsh(curvature) < 0.0).all()
    # Second slopes of a quadratic spline are constant over a cell: they are right on average over where events fall.
    assert curvature == pytest.approx(numeric, abs=0.08 * np.abs(numeric).max())


def test_spread_is_the_outer_product_of_a_lone_events_slope():
    given_ = arguments(8, rates=(0.0, 0.0, 0.6, 0.0, 0.0, -0.4)) | {"tile_cells": 1}
    total = matrix(slopes(**given_)[:, 26:44].sum(axis=0))
    assert (np.linalg.eigvalsh(total) >= -1e-6 * np.trace(total)).all()
    pair = {name: given_[name][[0, -1]].copy() for name in ("x", "y", "weight", "slot")}
    pair["x"][:], pair["y"][:], pair["weight"][:] = (4.0, 6.5), (3.0, 4.5), 1.0  # one cell apart, in a tile each
    sums = slopes(**(given_ | pair))
    for row in sums[sums[:, 0] > 0.0]:
        assert row[0] == 1
        assert np.abs(row[2:8]).min() > 0.0
        assert matrix(row[26:44]) == pytest.approx(np.outer(row[2:8], row[2:8]), rel=1e-4)
    assert (sums[:, 0] > 0.0).sum() == 2


@pytest.mark.parametrize("half", ["early", "late"])
def test_events_of_one_half_alone_have_no_energy(half):
    given_ = arguments(9)
    given_["slot"][:] = 1 if half == "early" else 6
    sums = slopes(**given_)
    assert sums[:, 0].sum() > 0
    assert not sums[:, 1:].any()


def test_events_of_weight_0_take_no_part():
    given_ = arguments(10)
    given_["weight"][:] = 0.0
    assert not slopes(**given_).any()
    assert not given_["image"].any()


def test_two_runs_give_the_same_bits():
    one, other = arguments(11, count=5000), arguments(11, count=5000)
    assert slopes(**one).tobytes() == slopes(**other).tobytes()
    assert one["image"].tobytes() == other["image"].tobytes()


def test_no_events_clear_the_image():
    given_ = arguments(1, count=0)
    assert not slopes(**given_).any()
    assert not given_["image"].any()
    still = np.ones((4, 4), np.float32)
    rest(**{name: given_[name] for name in ("x", "y", "weight", "cells_a_px", "origin_cells")}, image=still)
    assert not still.any()


FAR = [np.nan, np.inf, -np.inf, 1e30, -1e30, float(1 << 31), -float(1 << 31), float(1 << 32) * 2]


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("place", ["warp", "cells_a_px", "origin_cells", "x"])
def test_events_far_away_or_nowhere_write_nothing(far, place):
    guarded = np.full((200, *SHAPE), 5.0, np.float32)  # what lies around the image must stay as it is
    given_ = arguments(3) | {"image": guarded[100]}
    if place == "warp":
        given_["warp"][:, :6] = far
    elif place == "x":
        given_["x"][:] = far
    else:
        given_[place] = far if place == "cells_a_px" else (far, far)
    assert not slopes(**given_).any()
    assert not guarded[100].any()
    assert (np.delete(guarded, 100, axis=0) == 5.0).all()
    # At rest there is no warp to be far.
    still = np.full((200, 40, 52), 5.0, np.float32)
    columns = {name: given_[name] for name in ("x", "y", "weight", "cells_a_px", "origin_cells")}
    rest(**columns, image=still[100])
    assert (np.delete(still, 100, axis=0) == 5.0).all()
    assert still[100].any() == (place == "warp")


@pytest.mark.parametrize("shape", [(1, 1), (2, 7), (3, 3), (4, 4), (1, 200), (5, 4)])
def test_images_of_any_size_are_never_written_beyond(shape):
    guarded = np.full((3, *shape, 6), 5.0, np.float32)
    for origin in np.arange(-2.0, 6.0, 0.25).tolist():
        given_ = arguments(4) | {"image": guarded[1], "origin_cells": (origin, origin)}
        sums = slopes(**given_)
        assert np.isfinite(sums).all()
        assert (guarded[[0, 2]] == 5.0).all()


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_energies_are_sums_over_the_cells_with_any_event(seed):
    rng = np.random.default_rng(seed)
    image = rng.normal(size=SHAPE).astype(np.float32) * (rng.random(SHAPE) < 0.2)
    early, late = image[:, :, 0].astype(np.float64), image[:, :, 3].astype(np.float64)
    squares = ((early**2).sum(), (late**2).sum(), (early * late).sum())
    expected = (*squares, early.sum(), late.sum(), ((early != 0) | (late != 0)).sum())
    assert energies(image) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    "image", [np.zeros(SHAPE), np.zeros((4, 4), np.float32), np.zeros((4, 4, 12), np.float32)[..., ::2]]
)
def test_energies_of_another_image_are_refused(image):
    with pytest.raises(ValueError, match="image must be contiguous float32"):
        energies(image)


def test_events_at_rest_keep_their_weight_and_place():
    given_ = arguments(2)
    still = np.ones((60, 80), np.float32)
    columns = {name: given_[name] for name in ("x", "y", "weight")}
    rest(**columns, cells_a_px=0.5, origin_cells=(40.0, 30.0), image=still)
    assert still.sum() == pytest.approx(given_["weight"].sum(), abs=1e-3)
    assert np.arange(80) @ still.sum(axis=0) == pytest.approx(
        float(given_["weight"] @ (given_["x"] * 0.5 + 40.0)), abs=0.05
    )


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("slot", np.full(120, 8, np.int32), "slot must be from 0 to 7"),
        ("slot", np.full(120, -1, np.int32), "slot must be from 0 to 7"),
        ("slot", np.zeros(120, np.int64), "slot must be contiguous int32"),
        ("x", np.zeros(120), "x must be contiguous float32"),
        ("y", np.zeros(119, np.float32), r"y must be contiguous float32\[120\]"),
        ("y", np.zeros(240, np.float32)[::2], "y must be contiguous"),
        ("weight", np.zeros(120, np.int32), "weight must be contiguous float32"),
        ("tau", np.zeros(7, np.float32), "tau and warp must be"),
        ("tau", np.zeros(8), "tau and warp must be"),
        ("tau", np.zeros(16, np.float32)[::2], "tau and warp must be contiguous"),
        ("warp", np.zeros((8, 6), np.float32), "tau and warp must be"),
        ("warp", np.zeros((12, 8), np.float32).T, "tau and warp must be contiguous"),
        ("image", np.zeros((40, 52, 6)), "image must be contiguous float32"),
        ("image", np.zeros((40, 52, 5), np.float32), "image must be contiguous float32"),
        ("image", np.zeros((40, 52), np.float32), "image must be contiguous float32"),
        ("image", np.zeros((80, 52, 6), np.float32)[::2], "image must be contiguous float32"),
        ("tile_cells", 0, "tile_cells must be at least 1"),
    ],
)
def test_misuse_is_refused_before_the_launch(name, value, message):
    with pytest.raises(ValueError, match=message):
        slopes(**(arguments(1) | {name: value}))


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("x", np.zeros(3), "x must be contiguous float32"),
        ("y", np.zeros(4, np.float32), r"y must be contiguous float32\[3\]"),
        ("image", np.zeros((9, 9, 6), np.float32), "image must be contiguous float32"),
        ("image", np.zeros((9, 18), np.float32)[:, ::2], "image must be contiguous float32"),
    ],
)
def test_misuse_at_rest_is_refused_before_the_launch(name, value, message):
    three = np.zeros(3, np.float32)
    fine = {"x": three, "y": three, "weight": three, "image": np.zeros((9, 9), np.float32)}
    with pytest.raises(ValueError, match=message):
        rest(**(fine | {name: value}), cells_a_px=1.0, origin_cells=(4.0, 4.0))
