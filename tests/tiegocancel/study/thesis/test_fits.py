"""A decay is found where there is one, and none where there is none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tiegocancel.study.thesis.fits import cut_law, fit_decay
from tiegocancel.study.thesis.results import Curve

X = np.arange(0.0, 20_001.0, 1000.0)


def curve(y: np.ndarray) -> Curve:
    return Curve(X, y, np.zeros(len(X)), 1)


@given(amplitude=st.floats(0.3, 1.0), half_ms=st.floats(1.0, 15.0))
def test_an_exponential_is_found_again(amplitude: float, half_ms: float) -> None:
    fit = fit_decay(curve(amplitude * 2.0 ** (-X / 1000 / half_ms)))
    assert fit is not None
    assert (fit.amplitude, fit.half_ms) == (pytest.approx(amplitude, rel=1e-3), pytest.approx(half_ms, rel=1e-3))
    assert fit.rms < 1e-4


def test_a_flat_curve_has_no_half_life_and_a_short_one_no_fit() -> None:
    flat = fit_decay(curve(np.full(len(X), 0.8)))
    assert flat is not None
    assert math.isinf(flat.half_ms)
    assert fit_decay(curve(np.where(X < 3000, 0.5, np.nan))) is None


def test_a_window_that_is_cut_out_allows_what_overlaps() -> None:
    np.testing.assert_allclose(cut_law(np.array([0.0, 2500.0, 10_000.0, 20_000.0]), 10_000), [1.0, 0.75, 0.0, 0.0])
