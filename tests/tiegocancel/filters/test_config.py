"""A filter's settings are checked once, by name."""

from __future__ import annotations

from typing import Any

import pytest

from tiegocancel.config import fill
from tiegocancel.errors import ConfigError
from tiegocancel.filters import FilterConfig


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"refractory_us": -1}, "refractory_us must be an integer from 0 to 268435455, not -1"),
        ({"refractory_us": 1.5}, "refractory_us must be an integer .* not 1.5"),
        ({"background_us": True}, "background_us must be an integer .* not True"),
        ({"background_us": 1 << 28}, "background_us must be an integer from 0 to 268435455"),
        ({"background_radius_px": 0}, "background_radius_px must be an integer from 1 to 8, not 0"),
        ({"background_support": 9}, "background_support must be an integer from 1 to 8, not 9"),
        ({"hot_events": 11, "hot_window_us": 10}, "hot_events must be an integer from 0 to 10, not 11"),
        ({"hot_window_us": 0}, "hot_window_us must be an integer from 1 to"),
        ({"flicker_periods": 16}, "flicker_periods must be an integer from 0 to 15, not 16"),
        ({"flicker_min_hz": 0.5}, "flicker_min_hz must be a number from 1 to 100000, not 0.5"),
        ({"flicker_min_hz": float("nan")}, "flicker_min_hz must be a number from 1 to 100000, not nan"),
        ({"flicker_max_hz": 80}, "flicker_max_hz must be a number from 90 to 100000, not 80"),
        ({"flicker_max_hz": "100"}, "flicker_max_hz must be a number from 90 to 100000, not '100'"),
        ({"refractory_by_polarity": 1}, "refractory_by_polarity must be true or false, not 1"),
    ],
)
def test_values_out_of_range_are_refused_by_name(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FilterConfig(**settings)


def test_all_is_off_by_default_and_order_is_fixed() -> None:
    assert FilterConfig().active == ()
    on = FilterConfig(background_us=1, refractory_us=1, flicker_periods=1, hot_events=1)
    assert on.active == ("hot_pixel", "flicker", "refractory", "background")


def test_a_toml_table_fills_it() -> None:
    config = fill(FilterConfig, {"hot_events": 20, "flicker_min_hz": 45}, "run.toml [filter]")
    assert (config.hot_leak_us, config.flicker_gaps_us) == (5000, (7692, 22_223))
    with pytest.raises(ConfigError, match="unknown key 'refractory'; did you mean 'refractory_us'"):
        fill(FilterConfig, {"refractory": 20}, "run.toml [filter]")
