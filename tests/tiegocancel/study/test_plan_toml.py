"""What is written fills the settings with the same configuration."""

from __future__ import annotations

import tomllib

from hypothesis import given
from hypothesis import strategies as st

from tiegocancel import CancelConfig
from tiegocancel.config import fill
from tiegocancel.study.plan_toml import cancel_toml
from tiegocancel.study.settings import Settings


@given(
    tolerance_px=st.floats(0, 64, allow_subnormal=False),
    gate_us=st.none() | st.integers(0, 3),
    more=st.booleans(),
    sets=st.none() | st.tuples(st.integers(0, 10), st.integers(0, 10)),
    at=st.sampled_from(["event", "gate"]),
    capacity=st.integers(1, 1 << 20),
)
def test_filling_gives_the_configuration_again(
    tolerance_px: float,
    gate_us: int | None,
    more: bool,
    sets: tuple[int, int] | None,
    at: str,
    capacity: int,
) -> None:
    config = CancelConfig(
        horizon_us=8192,
        tolerance_us=1024,
        tolerance_px=tolerance_px,
        early_us=None if gate_us is None else gate_us << 9,
        more_horizons_us=(12_288, 16_384) if more else (),
        set_bits=sets,
        motion_at=at,  # type: ignore[arg-type]
        tick_bits=9,
        ring_capacity=capacity,
    )
    text = cancel_toml(config, remarks=["of\nlines [x]"])
    assert fill(Settings, tomllib.loads(text), "plan.toml").cancel == config
