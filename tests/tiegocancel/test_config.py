"""TOML tables fill dataclasses; what does not fit is named with the nearest key."""

from __future__ import annotations

from pathlib import Path

import pytest

from tiegocancel import CancelConfig, ConfigError
from tiegocancel.config import fill, load_toml
from tiegocancel.study import Settings


def test_nested_tables_fill_nested_dataclasses() -> None:
    settings = fill(Settings, {"cancel": {"horizon_us": 40_000, "tolerance_px": 2}, "read": {"width": 640}}, "f.toml")
    assert settings.cancel == CancelConfig(horizon_us=40_000)
    assert isinstance(settings.cancel.tolerance_px, float)
    assert settings.read.width == 640


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"cancle": {}}, r"f\.toml: unknown key 'cancle'; did you mean 'cancel'\?"),
        ({"cancel": {"horizon": 1}}, r"f\.toml \[cancel\]: unknown key 'horizon'; did you mean 'horizon_us'\?"),
        ({"cancel": {"horizon_us": -1}}, r"\[cancel\]: horizon_us must be an integer from 0 to \d+, not -1"),
        ({"cancel": {"horizon_us": "8"}}, r"\[cancel\] horizon_us must be int, not '8'"),
        ({"cancel": {"polarity": "both"}}, r"polarity must be one of 'opposite', 'equal', 'ignore', not 'both'"),
        ({"cancel": {"ring_capacity": True}}, r"ring_capacity must be int, not True"),
        ({"cancel": 3}, r"f\.toml cancel must be CancelConfig, not 3"),
    ],
)
def test_a_wrong_table_is_one_line_that_names_file_key_and_value(table: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        fill(Settings, table, "f.toml")


def test_a_file_that_is_no_toml_is_named(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    with pytest.raises(ConfigError, match="No such file"):
        load_toml(path)
    path.write_text("a = ", encoding="utf-8")
    with pytest.raises(ConfigError, match="not valid TOML"):
        load_toml(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tolerance_px": -1.0}, "tolerance_px must be a number from 0 to 64, not -1.0"),
        ({"tolerance_px": float("nan")}, "tolerance_px"),
        ({"ring_capacity": 0}, "ring_capacity must be an integer from 1"),
        ({"horizon_us": 8.0}, "horizon_us must be an integer"),
        ({"polarity": "x"}, "polarity must be"),
    ],
)
def test_cancel_config_names_field_rule_and_value(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        CancelConfig(**changes)  # type: ignore[arg-type]


def test_offsets_are_nearest_first_then_row_major() -> None:
    assert CancelConfig(tolerance_px=0).offsets == ((0, 0),)
    assert CancelConfig(tolerance_px=1.5).offsets == (
        (0, 0), (0, -1), (-1, 0), (1, 0), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1),
    )  # fmt: skip
    assert len(CancelConfig(tolerance_px=2).offsets) == 13
