"""Many cancellers at once decide what each of them decides alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel.events import Events
from tiegocancel.matching import many
from tiegocancel.matching.canceller import Canceller
from tiegocancel.matching.config import CancelConfig
from tiegocancel.matching.many import cancel_many
from tiegocancel.motion.rotation import RotationTrajectory
from tiegocancel.motion.schedule import MotionSchedule

WIDTH, HEIGHT = 60, 50

points = st.lists(
    st.tuples(
        st.builds(
            CancelConfig,
            horizon_us=st.sampled_from([0, 1, 500, 3000]),
            tolerance_us=st.sampled_from([0, 100, 4000]),
            tolerance_px=st.sampled_from([0.0, 1.0, 2.0, 5.0]),
            polarity=st.sampled_from(["opposite", "equal", "ignore"]),
            ring_capacity=st.just(4096),
        ),
        st.sampled_from([-40.0, 0.0, 25.0, 90.0]),
    ),
    max_size=5,
)


def stream(seed: int, count: int) -> Events:
    """Return events in a corner, so dense that they meet."""
    rng = np.random.default_rng(seed)
    t = np.sort(rng.integers(-2000, 20_000, count))
    return Events(t, rng.integers(0, 15, count), rng.integers(0, 12, count), rng.integers(0, 2, count), WIDTH, HEIGHT)


def schedule(omega: float, horizon_us: int) -> MotionSchedule:
    """Return a rotation that speeds up, an entry a millisecond."""
    times = np.array([0, 10_000], np.int64)
    motion = RotationTrajectory(
        t_us=times, center_px=np.array([[7.0, 6.0]] * 2), omega_rad_s=np.array([omega, 1.5 * omega])
    )
    return motion.schedule(horizon_us)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 400), wanted=points, launches=st.integers(1, 3))
@settings(max_examples=60)
def test_each_row_equals_a_canceller_of_its_own(
    seed: int, count: int, wanted: list[tuple[CancelConfig, float]], launches: int
) -> None:
    events = stream(seed, count)
    pairs = [(config, schedule(omega, config.horizon_us)) for config, omega in wanted]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(many, "MAX_TABLE_BYTES", launches * 4 * (WIDTH + 5) * (HEIGHT + 11))
        found = cancel_many(events, pairs)
    assert found.suppressed.shape == found.source.shape == (len(pairs), count)
    for row, (config, motion) in enumerate(pairs):
        canceller = Canceller(config, motion, width=WIDTH, height=HEIGHT)
        alone = canceller.process(events)
        np.testing.assert_array_equal(found.suppressed[row], alone.suppressed)
        np.testing.assert_array_equal(found.source[row], alone.source)
        assert found.ring_high_water[row] >= canceller.counters.ring_high_water


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 150), wanted=points)
@settings(max_examples=40)
def test_chained_cells_lose_no_prediction(seed: int, count: int, wanted: list[tuple[CancelConfig, float]]) -> None:
    events = stream(seed, count)
    pairs = [(config, schedule(omega, config.horizon_us)) for config, omega in wanted]
    found = cancel_many(events, pairs, chained=True)
    for row, (config, motion) in enumerate(pairs):
        np.testing.assert_array_equal(found.source[row], unbounded(events, config, motion))


def unbounded(events: Events, config: CancelConfig, motion: MotionSchedule) -> list[int]:
    """State the rule with every prediction kept: nearest pixel first, of one pixel the oldest that is open."""
    ahead_x, ahead_y = motion.predict(events.t, events.x, events.y)
    due = events.t + config.horizon_us
    left = set()
    found = []
    for i in range(len(events)):
        now = int(events.t[i])
        left |= {k for k in range(i) if due[k] - config.tolerance_us <= now and k not in found}
        met = -1
        for dx, dy in config.offsets:
            there = [
                k
                for k in sorted(left)
                if (ahead_x[k], ahead_y[k]) == (int(events.x[i]) + dx, int(events.y[i]) + dy)
                and 0 <= ahead_x[k] < WIDTH
                and 0 <= ahead_y[k] < HEIGHT
                and abs(now - due[k]) <= config.tolerance_us
                and (config.polarity == "ignore" or (events.p[k] == events.p[i]) == (config.polarity == "opposite"))
            ]
            if there:
                met = there[0]
                left.discard(met)
                break
        found.append(met)
    return found


def test_what_it_cannot_run_is_refused() -> None:
    events = stream(0, 10)
    with pytest.raises(ValueError, match="plain rule"):
        cancel_many(events, [(CancelConfig(uses=2), MotionSchedule.still())])
    with pytest.raises(ValueError, match="horizon"):
        cancel_many(events, [(CancelConfig(horizon_us=5), schedule(1.0, 6))])
