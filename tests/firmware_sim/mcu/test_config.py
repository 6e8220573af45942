"""A firmware's description is refused in one line that says field, rule and value."""

from __future__ import annotations

from typing import Any

import pytest
from tiegocancel.firmware_sim.mcu.config import McuConfig


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"input": "polling"}, "input must be one of dma, blocks, interrupt, not 'polling'"),
        ({"input_depth": 0}, "input_depth must be an integer from 1 to 1048576, not 0"),
        ({"input_depth": 7}, "input_depth must be even, for halves of the buffer, not 7"),
        ({"cores": 3}, "cores must be an integer from 1 to 2, not 3"),
        ({"coefficient_bits": 16}, "coefficient_bits must be one of 0, 32, 64, not 16"),
        ({"output_depth": True}, "output_depth must be an integer from 1 to 1048576, not True"),
    ],
)
def test_what_is_wrong_is_said(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match="^" + message.replace("'", ".") + "$"):
        McuConfig(**table)


def test_a_buffer_without_halves_may_be_odd() -> None:
    assert McuConfig(input="interrupt", input_depth=7).input_depth == 7
