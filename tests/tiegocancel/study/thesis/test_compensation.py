"""Both methods are told the motion, none and the wrong one, and only the first helps either."""

from __future__ import annotations

import numpy as np

from tiegocancel.study.thesis.compensation import compare_compensation
from tiegocancel.study.thesis.experiments import base_of
from tiegocancel.study.thesis.probe import Bench
from tiegocancel.study.thesis.qualitative import panels
from tiegocancel.study.thesis.settings import ThesisSettings


def test_only_the_true_motion_sharpens_and_only_it_saves_events(
    small_bench: Bench, small_settings: ThesisSettings
) -> None:
    found, images = compare_compensation(small_bench, small_settings)
    assert images is not None
    for one in found:
        assert one.variance["original"] == one.gradient["original"] == 1.0
        assert one.variance["warped"] > 1.2
        assert one.variance["warped"] > one.variance["warped_reversed"] + 0.2
        assert one.suppressed > one.suppressed_zero + 0.2
        assert one.suppressed > one.suppressed_reversed + 0.2
    # As many events lie in an image as were not suppressed, signs aside: a residual of no motion holds far more.
    assert np.abs(images.residual_zero).sum() > 1.3 * np.abs(images.residual).sum()


def test_pictures_name_their_controls(small_bench: Bench, small_settings: ThesisSettings) -> None:
    shown = panels(small_bench, base_of("gated", small_settings).at(horizon_us=8000))
    assert set(shown.controls) >= {"zero motion", "reversed motion", "the mover"}
    assert shown.ratio > shown.controls["zero motion"] + 0.2
    assert shown.ratio > shown.controls["reversed motion"] + 0.2
