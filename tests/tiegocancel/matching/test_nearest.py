"""Tree and grid find what a search through all pairs finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tiegocancel.matching.nearest import SpatialIndex, nearest_admissible


def everything(j: NDArray[np.int64], k: NDArray[np.int64], far: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.ones(len(j), np.bool_)


@pytest.mark.parametrize("index", ["tree", "grid"])
@given(
    seed=st.integers(0, 2**32 - 1),
    counts=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    reach_px=st.floats(0.1, 12.0),
    refused=st.floats(0.0, 1.0),
)
def test_the_nearest_admissible_is_that_of_all_pairs(
    index: SpatialIndex, seed: int, counts: tuple[int, int], reach_px: float, refused: float
) -> None:
    rng = np.random.default_rng(seed)
    asking, others = rng.uniform(-10, 10, (counts[0], 2)), rng.uniform(-10, 10, (counts[1], 2))
    allowed = rng.random(counts) >= refused
    far = np.hypot(*(asking[:, None] - others[None]).transpose(2, 0, 1))
    candidate = allowed & (far <= reach_px)
    wanted = np.where(candidate.any(axis=1), np.where(candidate, far, np.inf).argmin(axis=1), -1)
    found, distance = nearest_admissible(asking, others, reach_px, lambda j, k, d: allowed[j, k], index=index)
    np.testing.assert_array_equal(found, wanted)
    np.testing.assert_allclose(distance, np.where(candidate, far, np.inf).min(axis=1))


@pytest.mark.parametrize("index", ["tree", "grid"])
@pytest.mark.parametrize("reach_px", [0.0, 1.0, 2.0, np.sqrt(13.0), 5.0])
def test_a_distance_equal_to_the_reach_lies_within_it(index: SpatialIndex, reach_px: float) -> None:
    lattice = np.stack(np.meshgrid(np.arange(-6, 7), np.arange(-6, 7)), axis=-1).reshape(-1, 2).astype(np.float64)
    inside = np.rint((lattice**2).sum(axis=1)) <= np.rint(reach_px**2)
    found, _ = nearest_admissible(lattice, np.zeros((1, 2)), reach_px, everything, index=index)
    np.testing.assert_array_equal(found == 0, inside)


@pytest.mark.parametrize("index", ["tree", "grid"])
def test_without_points_nothing_is_found(index: SpatialIndex) -> None:
    none, one = np.zeros((0, 2)), np.zeros((1, 2))
    assert nearest_admissible(none, one, 1.0, everything, index=index)[0].tolist() == []
    assert nearest_admissible(one, none, 1.0, everything, index=index)[0].tolist() == [-1]
