"""Events alone between long pauses are given when the line falls silent, exactly and without a bad byte."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tiegocancel import Events
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions

bursts = st.lists(st.tuples(st.integers(20_000, 900_000), st.integers(1, 4)), min_size=1, max_size=12)


@pytest.mark.parametrize("protocol", ["edvs:E2", "edvs:E3", "edvs:E4", "evt2", "framed"])
@given(bursts=bursts, seed=st.integers(0, 100))
@settings(max_examples=25)
def test_a_silent_line_gives_what_it_holds(protocol: str, bursts: list[tuple[int, int]], seed: int) -> None:
    name, _, form = protocol.partition(":")
    if name == "framed":
        pytest.importorskip("cobs", reason="the framed protocol needs the extra link")
    options = ProtocolOptions(width=128, height=128, edvs_format=form or "E3")
    rng = np.random.default_rng(seed)
    encoder, decoder = registry.encoder(name, options), registry.decoder(name, options)
    decoder.feed(encoder.begin())
    t, wanted, found = 0, [], []
    for pause_us, count in bursts:
        times = t + pause_us + np.cumsum(rng.integers(0, 300, count))
        t = int(times[-1])
        x, y, p = (rng.integers(0, most, count) for most in (128, 128, 2))
        burst = Events(times, x, y, p, 128, 128)
        wanted.append(burst)
        found += [decoder.feed(encoder.encode(burst)), decoder.settle()]
    sent, got = Events.concatenate(wanted), Events.concatenate([part for part in found if len(part)])
    for column in "xyp":
        assert np.array_equal(getattr(got, column), getattr(sent, column)), column
    steps = np.diff(sent.t) % (1 << 16) if form == "E2" else np.diff(sent.t)
    assert np.array_equal(np.diff(got.t), steps)
    assert decoder.counters.bad_bytes == 0
