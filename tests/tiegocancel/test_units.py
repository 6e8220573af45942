"""Rates read well at every size."""

from __future__ import annotations

import pytest

from tiegocancel.units import rate_text


@pytest.mark.parametrize(
    ("rate_hz", "text"),
    [(0.0, "0 ev/s"), (92.4, "92.4 ev/s"), (999.9, "1 kev/s"), (12_305, "12.3 kev/s"), (3_741_320, "3.74 Mev/s")],
)
def test_a_rate_has_three_digits_and_a_unit(rate_hz: float, text: str) -> None:
    assert rate_text(rate_hz) == text
